#include "client/cli/server_book.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "client/library/error.h"

namespace vantage::cli {
namespace {

using ::testing::HasSubstr;

constexpr char kBook[] = R"(default = "office"

[servers.office]
address = "vantage.example:7443"
tls_ca = "office-ca.pem"
token_file = "~/token"
timeout_s = 60

[servers.laptop]
address = "127.0.0.1:7464"
)";

TEST(ServerBook, NamesServersWithFilesBesideIt) {
  setenv("HOME", "/home/ada", 1);
  const auto book = ParseServerBook(kBook, "/etc/vantage/config.toml");
  ASSERT_TRUE(book.ok()) << book.status();
  EXPECT_EQ(book->default_server, "office");
  ASSERT_EQ(book->servers.size(), 2u);
  const NamedServer office = book->Find("office").value();
  EXPECT_EQ(office.address, "vantage.example:7443");
  EXPECT_EQ(office.tls_ca, "/etc/vantage/office-ca.pem");
  EXPECT_EQ(office.token_file, "/home/ada/token");
  EXPECT_EQ(office.timeout, 60);
  EXPECT_FALSE(book->Find("laptop").value().tls_ca.has_value());
  const auto nobody = book->Find("offce");
  EXPECT_EQ(nobody.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(client::Explain(nobody.status()).fix, HasSubstr("laptop, office"));
}

TEST(ServerBook, WhatIsWrongIsNamedWithItsLineAndACure) {
  const struct {
    const char* text;
    const char* cause;
    const char* fix;
  } kWrong[] = {
      {"default = \"x\"\n", "line 1: the default 'x' is none of the servers", "[servers.office]"},
      {"[servers.a]\naddress = \"h:1\"\n\n[servers.b]\nadress = \"h:2\"\n",
       "line 5: a server has no key 'adress'", "address, tls_ca"},
      {"[servers.a]\ntls_ca = \"x\"\n", "line 1: the server 'a' has no address", "HOST:PORT"},
      {"[servers.a]\naddress = \"h\"\n", "line 2: 'h' is no address", "HOST:PORT"},
      {"[servers.a]\naddress = 7464\n", "line 2: 'address' has to be a text", "quotes"},
      {"[servers.a]\naddress = \"h:1\"\ntimeout_s = \"30\"\n", "line 3: 'timeout_s'",
       "timeout_s = 30"},
      {"servers = 3\n", "line 1: there is no key 'servers'", "default and servers"},
      {"[servers.a\n", "line 1", "TOML"}};
  for (const auto& wrong : kWrong) {
    const auto book = ParseServerBook(wrong.text, "config.toml");
    ASSERT_EQ(book.status().code(), absl::StatusCode::kInvalidArgument) << wrong.text;
    const client::Explanation why = client::Explain(book.status());
    EXPECT_THAT(why.cause, HasSubstr("config.toml, "));
    EXPECT_THAT(why.cause, HasSubstr(wrong.cause));
    EXPECT_THAT(why.fix, HasSubstr(wrong.fix));
  }
}

TEST(ServerBook, OnlyAFileThatWasAskedForHasToBeThere) {
  EXPECT_FALSE(ReadServerBook("/nowhere/config.toml", false).value().found);
  EXPECT_EQ(ReadServerBook("/nowhere/config.toml", true).status().code(),
            absl::StatusCode::kNotFound);
}

TEST(ServerBook, AnAddressIsToldFromAName) {
  EXPECT_TRUE(IsServerName("office"));
  for (const char* address :
       {"office:7443", "127.0.0.1:7464", "unix:/run/vantage.sock", "[::1]:1"}) {
    EXPECT_FALSE(IsServerName(address)) << address;
  }
}

}  // namespace
}  // namespace vantage::cli

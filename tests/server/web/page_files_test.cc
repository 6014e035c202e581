#include "server/web/page_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace vantage::web {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// A folder with a page in it, and beside it what is nobody's business.
class PageFilesTest : public ::testing::Test {
 protected:
  PageFilesTest() {
    std::string name = ::testing::TempDir() + "/page-XXXXXX";
    base_ = mkdtemp(name.data());
    std::filesystem::create_directories(base_ + "/page/assets");
    Write("secret.txt", "the secret");
    Write("page/index.html", "<!doctype html>");
    Write("page/assets/app-1a2b.js", script_);
    Write("page/icon.svg", "<svg/>");
  }
  ~PageFilesTest() override {
    std::error_code ignored;
    std::filesystem::remove_all(base_, ignored);
  }
  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(base_ + "/" + name, std::ios::binary) << text;
  }
  PageFiles ReadPage() const {
    absl::StatusOr<PageFiles> page = PageFiles::Read(base_ + "/page");
    EXPECT_TRUE(page.ok()) << page.status();
    return page.ok() ? *std::move(page) : PageFiles();
  }
  static Response Get(const PageFiles& page, const std::string& target,
                      const std::vector<Field>& fields = {}, const std::string& method = "GET") {
    Request request;
    request.method = method;
    request.target = target;
    request.fields = fields;
    return page.Answer(request);
  }
  static std::string FieldOf(const Response& response, const std::string& name) {
    for (const Field& field : response.fields) {
      if (field.name == name) return field.value;
    }
    return "";
  }

  std::string base_;
  const std::string script_ = [] {
    std::string text;
    for (int i = 0; i < 500; ++i) text += "console.log('line " + std::to_string(i) + "');\n";
    return text;
  }();
};

std::string Unpacked(const std::string& packed) {
  z_stream stream{};
  inflateInit2(&stream, MAX_WBITS + 16);
  std::string plain(1 << 20, '\0');
  // NOLINTBEGIN: the library's signature
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.next_out = reinterpret_cast<Bytef*>(plain.data());
  // NOLINTEND
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.avail_out = static_cast<uInt>(plain.size());
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  plain.resize(stream.total_out);
  inflateEnd(&stream);
  return plain;
}

TEST_F(PageFilesTest, ServesItsFilesWithTheirTypes) {
  const PageFiles page = ReadPage();
  EXPECT_EQ(page.size(), 3);
  for (const char* target : {"/", "/index.html", "/?from=link"}) {
    const Response index = Get(page, target);
    EXPECT_EQ(index.status, 200) << target;
    EXPECT_EQ(*index.body, "<!doctype html>");
    EXPECT_EQ(FieldOf(index, "content-type"), "text/html; charset=utf-8");
    EXPECT_EQ(FieldOf(index, "cache-control"), "no-cache");
    EXPECT_THAT(FieldOf(index, "content-security-policy"), HasSubstr("default-src 'self'"));
    EXPECT_THAT(FieldOf(index, "content-security-policy"), Not(HasSubstr("unsafe")));
  }
  const Response script = Get(page, "/assets/app-1a2b.js");
  EXPECT_EQ(*script.body, script_);
  EXPECT_EQ(FieldOf(script, "content-type"), "text/javascript; charset=utf-8");
  EXPECT_EQ(FieldOf(script, "cache-control"), "max-age=31536000, immutable");
  EXPECT_EQ(FieldOf(Get(page, "/icon.svg"), "content-type"), "image/svg+xml");
}

TEST_F(PageFilesTest, NoPathLeadsOutOfTheFolder) {
  std::filesystem::create_symlink(base_ + "/secret.txt", base_ + "/page/link.txt");
  std::filesystem::create_directory_symlink(base_, base_ + "/page/up");
  const PageFiles page = ReadPage();
  EXPECT_EQ(page.size(), 3);
  for (const char* target :
       {"/../secret.txt", "/assets/../../secret.txt", "/..%2fsecret.txt", "/%2e%2e/secret.txt",
        "/link.txt", "/up/secret.txt", "//etc/passwd", "/assets", "/assets/", "/.", "", "*",
        "index.html", "/index.html/", "/INDEX.HTML", "http://x/index.html"}) {
    EXPECT_EQ(Get(page, target).status, 404) << target;
  }
}

TEST_F(PageFilesTest, WhatIsLargeIsCompressedForThoseWhoTakeIt) {
  const PageFiles page = ReadPage();
  const std::string target = "/assets/app-1a2b.js";
  const Response packed = Get(page, target, {{"accept-encoding", "gzip, deflate, br"}});
  EXPECT_EQ(FieldOf(packed, "content-encoding"), "gzip");
  EXPECT_EQ(FieldOf(packed, "vary"), "accept-encoding");
  EXPECT_LT(packed.body->size() * 4, script_.size());
  EXPECT_EQ(Unpacked(*packed.body), script_);
  const Response plain = Get(page, target, {{"accept-encoding", "gzip;q=0"}});
  EXPECT_EQ(FieldOf(plain, "content-encoding"), "");
  EXPECT_NE(FieldOf(plain, "etag"), FieldOf(packed, "etag"));
  EXPECT_EQ(FieldOf(Get(page, "/icon.svg", {{"accept-encoding", "gzip"}}), "content-encoding"), "");
}

TEST_F(PageFilesTest, WhoHasAFileIsNotSentItAgain) {
  const std::string etag = FieldOf(Get(ReadPage(), "/"), "etag");
  const Response same = Get(ReadPage(), "/", {{"if-none-match", "\"other\", W/" + etag}});
  EXPECT_EQ(same.status, 304);
  EXPECT_EQ(same.body, nullptr);
  EXPECT_EQ(FieldOf(same, "etag"), etag);
  Write("page/index.html", "<!doctype html><title>new</title>");
  EXPECT_EQ(Get(ReadPage(), "/", {{"if-none-match", etag}}).status, 200);
}

TEST_F(PageFilesTest, OnlyGetAndHeadReadThePage) {
  const PageFiles page = ReadPage();
  EXPECT_EQ(Get(page, "/", {}, "HEAD").status, 200);
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "get", ""}) {
    const Response refused = Get(page, "/", {}, method);
    EXPECT_EQ(refused.status, 405) << method;
    EXPECT_EQ(FieldOf(refused, "allow"), "GET, HEAD");
  }
}

TEST_F(PageFilesTest, AFolderThatIsNoPageIsRefused) {
  EXPECT_TRUE(absl::IsNotFound(PageFiles::Read(base_).status()));
  EXPECT_TRUE(absl::IsNotFound(PageFiles::Read(base_ + "/nowhere").status()));
  for (int i = 0; i < 4200; ++i) Write("page/assets/" + std::to_string(i), "");
  EXPECT_TRUE(absl::IsFailedPrecondition(PageFiles::Read(base_ + "/page").status()));
}

TEST_F(PageFilesTest, AFileMayBeAddedAlsoWhereThereIsNoPage) {
  PageFiles page;
  page.Add("/authority.crt", "application/x-x509-ca-cert", std::string("\0der", 4));
  const Response added = Get(page, "/authority.crt");
  EXPECT_EQ(added.status, 200);
  EXPECT_EQ(*added.body, std::string("\0der", 4));
  EXPECT_EQ(FieldOf(added, "content-type"), "application/x-x509-ca-cert");
  EXPECT_EQ(FieldOf(added, "cache-control"), "no-cache");
  EXPECT_THAT(*Get(page, "/").body, HasSubstr("--web-root"));
}

TEST_F(PageFilesTest, WithoutAPageItSaysHowToGetOne) {
  const Response none = Get(PageFiles(), "/");
  EXPECT_EQ(none.status, 404);
  EXPECT_THAT(*none.body, HasSubstr("--web-root"));
}

}  // namespace
}  // namespace vantage::web

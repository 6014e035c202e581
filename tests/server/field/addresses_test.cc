#include "server/field/addresses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace vantage::field {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::vector<std::string> TextsOf(const std::vector<InterfaceAddress>& addresses) {
  std::vector<std::string> texts;
  texts.reserve(addresses.size());
  for (const InterfaceAddress& one : addresses) texts.push_back(one.address);
  return texts;
}

// A laptop with a Wi-Fi, a hotspot of its own, a cable, a container's bridge and a tunnel.
std::vector<InterfaceAddress> Laptop() {
  return {
      {"lo", "127.0.0.1", true, false, Medium::kVirtual},
      {"lo", "::1", true, false, Medium::kVirtual},
      {"tun0", "10.8.0.2", true, false, Medium::kVirtual},
      {"docker0", "172.17.0.1", false, false, Medium::kVirtual},
      {"eth0", "192.168.1.5", true, false, Medium::kWired},
      {"eth0", "2001:db8::5", true, false, Medium::kWired},
      {"eth0", "2001:db8::bad", true, true, Medium::kWired},
      {"eth0", "fe80::5", true, false, Medium::kWired},
      {"eth1", "169.254.7.9", true, false, Medium::kWired},
      {"wlan0", "fd00::7", true, false, Medium::kWireless},
      {"wlan0", "192.168.1.7", true, false, Medium::kWireless},
      {"wlan1", "10.42.0.1", true, false, Medium::kWireless},
      {"wlan1", "febf::1", true, false, Medium::kWireless},
  };
}

TEST(ReachableAddresses, AreThoseOfWorkingNetworksTheLikeliestForATabletFirst) {
  EXPECT_THAT(
      TextsOf(ReachableAddresses(Laptop())),
      ElementsAre("192.168.1.7", "10.42.0.1", "fd00::7", "192.168.1.5", "2001:db8::5", "10.8.0.2"));
}

// A certificate is made anew when they change, so the order in which the system tells them must
// not.
TEST(ReachableAddresses, DoNotDependOnTheOrderInWhichTheyAreTold) {
  const auto expected = ReachableAddresses(Laptop());
  std::mt19937 random(7);  // NOLINT: the same each time
  for (int i = 0; i < 50; ++i) {
    std::vector<InterfaceAddress> shuffled = Laptop();
    std::shuffle(shuffled.begin(), shuffled.end(), random);
    EXPECT_EQ(ReachableAddresses(shuffled), expected);
  }
}

TEST(ReachableAddresses, AreNoneWithoutANetwork) {
  EXPECT_THAT(ReachableAddresses({{"lo", "127.0.0.1", true, false, Medium::kVirtual},
                                  {"lo", "127.0.1.1", true, false, Medium::kVirtual},
                                  {"wlan0", "192.168.1.7", false, false, Medium::kWireless}}),
              IsEmpty());
}

TEST(SystemAddresses, HaveTheLoopbackOfThisMachine) {
  const auto all = SystemAddresses();
  EXPECT_TRUE(std::any_of(all.begin(), all.end(), [](const InterfaceAddress& one) {
    return one.address == "127.0.0.1" || one.address == "::1";
  }));
}

// As proc(5) shows it: temporary (01), deprecated (20), tentative (40), permanent (80).
TEST(PassingAddresses, AreReadFromTheSystemsTable) {
  EXPECT_THAT(PassingAddresses("20010db8000000000000000000000005 02 40 00 80     eth0\n"
                               "20010db8000000000000000000000006 02 40 00 01     eth0\n"
                               "20010db8000000000000000000000007 02 40 00 a0     eth0\n"
                               "fe800000000000000000000000000008 02 40 20 c0     eth0\n"
                               "fd000000000000000000000000000009 02 40 00 00     eth0\n"
                               "nonsense 02\n20010db8 02 40 00 01     eth0\n"),
              ElementsAre("2001:db8::6", "2001:db8::7", "fe80::8"));
}

TEST(CanonicalAddress, IsOneTextForOneAddress) {
  EXPECT_EQ(CanonicalAddress("192.168.1.5"), "192.168.1.5");
  EXPECT_EQ(CanonicalAddress("2001:DB8:0:0::5"), "2001:db8::5");
  for (const char* wrong :
       {"", "laptop", "192.168.1", "192.168.1.5:7443", "[::1]", "fe80::1%eth0"}) {
    EXPECT_EQ(CanonicalAddress(wrong), "") << wrong;
  }
  EXPECT_EQ(AddressOfBytes("abc"), "");
}

TEST(UrlOf, HasBracketsAroundAnAddressWithColons) {
  EXPECT_EQ(UrlOf("192.168.1.5", 7443), "https://192.168.1.5:7443");
  EXPECT_EQ(UrlOf("2001:db8::5", 1), "https://[2001:db8::5]:1");
}

TEST(PlainHostName, IsWhatACertificateMaySay) {
  EXPECT_EQ(PlainHostName("Site-Laptop"), "site-laptop");
  EXPECT_EQ(PlainHostName("laptop.fritz.box"), "laptop.fritz.box");
  // Nothing that an extension's text would read as a second name.
  const std::vector<std::string> wrong_names = {
      "", "-a", "a-", "a..b", "a,DNS:bank.example", "a_b", "laptop.", "ä", std::string(64, 'a')};
  for (const std::string& wrong : wrong_names) {
    EXPECT_EQ(PlainHostName(wrong), "") << wrong;
  }
}

}  // namespace
}  // namespace vantage::field

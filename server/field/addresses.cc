#include "server/field/addresses.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <system_error>
#include <tuple>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace vantage::field {
namespace {

// Flags of /proc/net/if_inet6, as linux/if_addr.h has them: temporary, its check for doubles
// failed, deprecated, not checked yet.
constexpr uint32_t kPassingFlags = 0x01 | 0x08 | 0x20 | 0x40;
constexpr size_t kIpv6Bytes = 16;

bool IsSix(const std::string& address) { return absl::StrContains(address, ':'); }

bool HoldsOnOneLink(const std::string& address) {
  in6_addr six{};
  if (inet_pton(AF_INET6, address.c_str(), &six) == 1) return IN6_IS_ADDR_LINKLOCAL(&six);
  return absl::StartsWith(address, "169.254.");
}

bool IsOwnMachine(const std::string& address) {
  return address == "::1" || absl::StartsWith(address, "127.");
}

Medium MediumOf(const std::string& interface) {
  const std::filesystem::path folder = std::filesystem::path("/sys/class/net") / interface;
  std::error_code error;
  if (std::filesystem::exists(folder / "wireless", error) ||
      std::filesystem::exists(folder / "phy80211", error)) {
    return Medium::kWireless;
  }
  return std::filesystem::exists(folder / "device", error) ? Medium::kWired : Medium::kVirtual;
}

std::string TextOf(const sockaddr& address) {
  // NOLINTBEGIN: the system's way
  const auto bytes_of = [](const auto& binary) {
    return std::string(reinterpret_cast<const char*>(&binary), sizeof binary);
  };
  if (address.sa_family == AF_INET) {
    return AddressOfBytes(bytes_of(reinterpret_cast<const sockaddr_in&>(address).sin_addr));
  }
  if (address.sa_family == AF_INET6) {
    return AddressOfBytes(bytes_of(reinterpret_cast<const sockaddr_in6&>(address).sin6_addr));
  }
  // NOLINTEND
  return "";
}

}  // namespace

std::vector<InterfaceAddress> SystemAddresses() {
  ifaddrs* listed = nullptr;
  if (getifaddrs(&listed) != 0) return {};
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> owned(listed, &freeifaddrs);
  std::ostringstream told;
  told << std::ifstream("/proc/net/if_inet6").rdbuf();
  const std::vector<std::string> passing = PassingAddresses(told.str());
  std::vector<InterfaceAddress> found;
  for (const ifaddrs* at = listed; at != nullptr; at = at->ifa_next) {
    if (at->ifa_addr == nullptr) continue;
    const std::string address = TextOf(*at->ifa_addr);
    if (address.empty()) continue;
    constexpr unsigned kUp = IFF_UP | IFF_RUNNING;
    found.push_back({at->ifa_name, address, (at->ifa_flags & kUp) == kUp,
                     std::find(passing.begin(), passing.end(), address) != passing.end(),
                     MediumOf(at->ifa_name)});
  }
  return found;
}

std::vector<InterfaceAddress> ReachableAddresses(std::vector<InterfaceAddress> all) {
  const auto left_out = [](const InterfaceAddress& one) {
    return !one.up || one.passing || IsOwnMachine(one.address) || HoldsOnOneLink(one.address);
  };
  all.erase(std::remove_if(all.begin(), all.end(), left_out), all.end());
  std::sort(all.begin(), all.end(), [](const InterfaceAddress& a, const InterfaceAddress& b) {
    return std::forward_as_tuple(a.medium, IsSix(a.address), a.interface, a.address) <
           std::forward_as_tuple(b.medium, IsSix(b.address), b.interface, b.address);
  });
  return all;
}

std::vector<std::string> PassingAddresses(absl::string_view if_inet6) {
  std::vector<std::string> passing;
  for (const absl::string_view line : absl::StrSplit(if_inet6, '\n')) {
    // Address, number of the interface, length of the prefix, scope, flags, interface.
    const std::vector<absl::string_view> words = absl::StrSplit(line, ' ', absl::SkipEmpty());
    uint32_t flags = 0;
    if (words.size() != 6 || words[0].size() != 2 * kIpv6Bytes ||
        !absl::SimpleHexAtoi(words[4], &flags) || (flags & kPassingFlags) == 0) {
      continue;
    }
    passing.push_back(AddressOfBytes(absl::HexStringToBytes(words[0])));
  }
  return passing;
}

std::string AddressOfBytes(const std::string& bytes) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  const bool known = bytes.size() == sizeof(in_addr) || bytes.size() == sizeof(in6_addr);
  if (!known || inet_ntop(bytes.size() == sizeof(in_addr) ? AF_INET : AF_INET6, bytes.data(),
                          text.data(), static_cast<socklen_t>(text.size())) == nullptr) {
    return "";
  }
  return text.data();
}

std::string CanonicalAddress(const std::string& text) {
  std::string bytes(sizeof(in_addr), '\0');
  if (inet_pton(AF_INET, text.c_str(), bytes.data()) == 1) return AddressOfBytes(bytes);
  bytes.resize(sizeof(in6_addr));
  return inet_pton(AF_INET6, text.c_str(), bytes.data()) == 1 ? AddressOfBytes(bytes) : "";
}

std::string UrlOf(const std::string& address, int port) {
  return IsSix(address) ? absl::StrCat("https://[", address, "]:", port)
                        : absl::StrCat("https://", address, ":", port);
}

std::string PlainHostName(absl::string_view name) {
  constexpr size_t kMaxLabel = 63;
  constexpr size_t kMaxName = 253;
  if (name.size() > kMaxName) return "";
  for (const absl::string_view label : absl::StrSplit(name, '.')) {
    if (label.empty() || label.size() > kMaxLabel || label.front() == '-' || label.back() == '-' ||
        !std::all_of(label.begin(), label.end(),
                     [](char c) { return absl::ascii_isalnum(c) || c == '-'; })) {
      return "";
    }
  }
  return absl::AsciiStrToLower(name);
}

std::string HostName() {
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) != 0) return "";
  return PlainHostName(name.data());
}

}  // namespace vantage::field

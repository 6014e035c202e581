// The addresses by which other devices reach this machine.
#ifndef VANTAGE_SERVER_FIELD_ADDRESSES_H_
#define VANTAGE_SERVER_FIELD_ADDRESSES_H_

#include <string>
#include <vector>

#include "absl/strings/string_view.h"

namespace vantage::field {

// How a network is reached. Tablets come by the first kind above all, also where this machine is
// itself the access point; the last are bridges of containers, tunnels and the like.
enum class Medium { kWireless, kWired, kVirtual };

// One address of one interface, as the system tells it.
struct InterfaceAddress {
  std::string interface;  // 'wlan0'
  std::string address;    // as inet_ntop writes it, without a zone
  bool up = false;        // is switched on and has a link
  bool passing = false;   // IPv6: temporary, deprecated, or not (yet) the interface's own
  Medium medium = Medium::kVirtual;

  bool operator==(const InterfaceAddress&) const = default;
};

// What the system has now; empty where it does not tell.
std::vector<InterfaceAddress> SystemAddresses();

// Those by which others reach this machine, the likeliest for a tablet first: by medium, IPv4
// before IPv6, then by interface and address. Left out are interfaces without a link, loopback,
// addresses that hold on one link only (169.254.0.0/16, fe80::/10), whose IPv6 ones no browser
// takes, and those that pass away by themselves.
std::vector<InterfaceAddress> ReachableAddresses(std::vector<InterfaceAddress> all);

// The IPv6 addresses in the text of /proc/net/if_inet6 that are `passing`, as inet_ntop writes
// them.
std::vector<std::string> PassingAddresses(absl::string_view if_inet6);

// The text of an address as inet_ntop writes it; empty: it is none.
std::string CanonicalAddress(const std::string& text);

// The same of 4 or 16 bytes in network order.
std::string AddressOfBytes(const std::string& bytes);

// 'https://192.168.1.5:7443', 'https://[2001:db8::7]:7443'.
std::string UrlOf(const std::string& address, int port);

// The name of this machine in lower case, 'site-laptop'; empty where it is none that a certificate
// may have: letters, digits and '-', labels of 63 at most with dots between.
std::string HostName();
// The same of a given name.
std::string PlainHostName(absl::string_view name);

}  // namespace vantage::field

#endif  // VANTAGE_SERVER_FIELD_ADDRESSES_H_

// What a proxy in front tells of the client whose call it passes on.
#ifndef VANTAGE_SERVER_AUTH_FORWARDED_H_
#define VANTAGE_SERVER_AUTH_FORWARDED_H_

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace vantage::auth {

// The names by which a client's certificate may stand in the callers file: its subject alternative
// names (DNS, e-mail, URI, IP address) in their order, then its common name. These are those that a
// connection with that certificate would have, in the same order. `text` is the certificate as DER
// in base64. INVALID_ARGUMENT: it is none; the message does not quote it. Does not check who signed
// it, nor until when it is good: the proxy has.
absl::StatusOr<std::vector<std::string>> CertificateNames(absl::string_view text);

// The client's address in the form that gRPC gives peers, 'ipv4:10.0.0.7' or 'ipv6:[2001:db8::7]'.
// An IPv4 address written as IPv6 is the IPv4 address. nullopt: `text` is no address.
std::optional<std::string> ClientAddress(absl::string_view text);

}  // namespace vantage::auth

#endif  // VANTAGE_SERVER_AUTH_FORWARDED_H_

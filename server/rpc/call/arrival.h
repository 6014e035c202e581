// Where a call comes from: straight to gRPC, or by this process's own web gateway, which tells on
// whose behalf it calls.
#ifndef VANTAGE_SERVER_RPC_CALL_ARRIVAL_H_
#define VANTAGE_SERVER_RPC_CALL_ARRIVAL_H_

#include <grpcpp/server_context.h>

#include <map>
#include <optional>
#include <string>

namespace vantage::rpc {

// What keys of metadata must not begin with that an operator names for a proxy.
inline constexpr char kWebPrefix[] = "vantage-web-";

struct Arrival {
  // As gRPC names peers: 'ipv4:10.0.0.7:51234', 'ipv6:[::1]:51234', 'unix:'.
  std::string peer;
  // That the client showed to the web listener: DER in base64. What it showed to gRPC's own ports
  // is in the context.
  std::optional<std::string> certificate;
  bool by_web = false;
};

// Proves that a call comes from this process's gateway: a secret of 256 random bits that it has
// from the server, and that no client ever sees. Calls in process are the only ones that have no
// address, either.
class WebSeal {
 public:
  // A seal that no call has.
  WebSeal() = default;
  static WebSeal New();

  // Metadata that gateway adds to a call of somebody's.
  std::multimap<std::string, std::string> Metadata(const Arrival& arrival) const;
  // Metadata of this kind without the seal, or in a call from elsewhere, count for nothing.
  Arrival Read(const grpc::ServerContextBase& context) const;

 private:
  std::string secret_;
};

}  // namespace vantage::rpc

#endif  // VANTAGE_SERVER_RPC_CALL_ARRIVAL_H_

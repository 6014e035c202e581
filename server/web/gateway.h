// The web listener: the page, and the API over the Connect protocol, on HTTP/1.1. What calls is
// this process's own gRPC server, in process: so RPCs are admitted, limited, answered and audited
// by the same code as over gRPC.
#ifndef VANTAGE_SERVER_WEB_GATEWAY_H_
#define VANTAGE_SERVER_WEB_GATEWAY_H_

#include <grpcpp/channel.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "server/auth/tls_files.h"
#include "server/rpc/call/arrival.h"
#include "server/telemetry/metrics.h"
#include "server/web/connection.h"
#include "server/web/page_files.h"
#include "server/web/router.h"

namespace vantage::web {

struct GatewayOptions {
  // '127.0.0.1:7480', '[::]:0', 'localhost:0' or 'unix:PATH'. What is at the path is removed first,
  // and when the gateway ends; whoever starts it has looked that nobody uses it.
  std::string address;
  RouterOptions router;
  // As Common has them.
  std::vector<std::string> passed_on = {"authorization", "traceparent"};
  std::vector<std::string> passed_on_by_proxy;
  int64_t message_bytes = 4 << 20;
  // Certificates of clients; only where the listener is encrypted.
  bool ask_for_certificates = false;
  bool require_certificates = false;
  // At a time. A page has two or three; each takes some 20 KiB, and 35 more where it is encrypted.
  size_t connections = 4096;
  // Of one address at a time, but for those of this machine and of a proxy's socket: a crew behind
  // one address.
  size_t connections_of_address = 256;
  // Requests and answers of all connections together.
  int64_t memory_bytes = int64_t{256} << 20;
  int threads = 2;
  Patience patience;
};

class Gateway {
 public:
  // Starts to serve. `tls`: null where nothing is encrypted; else it outlives the gateway, as
  // `metrics` does. `server`: a channel to the server in process, which knows `seal`.
  // INVALID_ARGUMENT: not an address, or certificates that cannot be used; UNAVAILABLE: the address
  // cannot be bound.
  static absl::StatusOr<std::unique_ptr<Gateway>> Start(GatewayOptions options, PageFiles page,
                                                        std::shared_ptr<grpc::Channel> server,
                                                        rpc::WebSeal seal,
                                                        const auth::TlsFiles* tls,
                                                        telemetry::Metrics& metrics);
  ~Gateway();
  Gateway(const Gateway&) = delete;
  Gateway& operator=(const Gateway&) = delete;

  // 0: it listens on a socket of the file system.
  int port() const;

  // New connections get the certificates that there are now.
  absl::Status RefreshTls();
  // From now on connections end with their next answer.
  void Drain();
  // Takes no further connections, and ends those that there are, what is under way by the time that
  // is given; then calls are cancelled. To be called before the gRPC server shuts down, which cuts
  // off calls in process at once. Idempotent.
  void Stop(std::chrono::milliseconds patience);

 private:
  class Listener;
  Gateway();
  std::unique_ptr<Listener> listener_;
};

}  // namespace vantage::web

#endif  // VANTAGE_SERVER_WEB_GATEWAY_H_

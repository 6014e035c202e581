// The server as one object: everything that runs behind the gRPC port, started and stopped in
// order. main() and tests start it.
#ifndef VANTAGE_SERVER_MAIN_SERVER_H_
#define VANTAGE_SERVER_MAIN_SERVER_H_

#include <grpcpp/grpcpp.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/auth/tls_files.h"
#include "server/execution/planning_pool.h"
#include "server/execution/steadied_clock.h"
#include "server/execution/task_pool.h"
#include "server/execution/timer.h"
#include "server/main/credentials.h"
#include "server/rpc/call/authorizer.h"
#include "server/rpc/call/call_counts.h"
#include "server/rpc/services.h"
#include "server/session/session_registry.h"
#include "server/store/instrumented_store.h"
#include "server/store/store.h"
#include "server/telemetry/http_listener.h"
#include "server/telemetry/log.h"
#include "server/telemetry/metrics.h"
#include "server/web/gateway.h"

namespace vantage::server {

struct ServerOptions {
  // HOST:PORT (port 0: one that is free) or unix:PATH, for owner and group of the server's process.
  std::vector<std::string> listen = {"127.0.0.1:7464"};
  auth::AccessOptions access;
  // The address of metrics, health and the status page; empty: there are none. An address other
  // than loopback needs http_allow_remote.
  std::string http_listen;
  bool http_allow_remote = false;
  // Where the page and the API over the Connect protocol are: HOST:PORT or unix:PATH, protected as
  // `listen` has to be. Empty: nowhere.
  std::string web_listen;
  // The folder of the page; empty: the web listener has the API alone.
  std::string web_root;
  // Origins whose pages may call, beside that page: 'https://crew.example'.
  std::vector<std::string> web_allowed_origins;
  // An authority that the page's clients may want to trust: its certificate as DER, which they get
  // at /authority.crt. Empty: there is none.
  std::string web_authority;
  std::string data_folder;  // whose free space is shown; empty: none
  int threads = 0;          // that compute; 0: one per core
  int request_threads = 4;  // that answer
  size_t queued_requests = 1024;
  contract::Limits limits;
  int64_t memory_bytes = 0;  // for models and plans; 0: no limit
  // The interval at which data past their time are collected.
  std::chrono::milliseconds collect_every = std::chrono::minutes(10);
  // The longest silence of a stream; the contract promises 15 s at most. Behind HAProxy a client of
  // HTTP/1.1 that left is noticed by the second message that nobody takes, so within twice this.
  std::chrono::milliseconds heartbeat = std::chrono::seconds(7);
  // How long a shutdown may take: plans end and merges finish in this time.
  std::chrono::milliseconds drain_patience{20'000};
};

class Server {
 public:
  // Starts serving: NOT_SERVING until every session that the store has is loaded, SERVING then.
  // INVALID_ARGUMENT: an address that is not loopback and not protected, or files of `access` that
  // cannot be used. UNAVAILABLE: an address cannot be bound. `store` and `log` outlive the server.
  static absl::StatusOr<std::unique_ptr<Server>> Start(
      const ServerOptions& options, store::Store& store, telemetry::Log& log,
      session::Algorithms algorithms = session::Algorithms::Core(),
      session::Journal::Clock clock = absl::Now);
  // Drains first if that has not happened.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  // Where it listens, with the ports that it got.
  const std::vector<std::string>& addresses() const { return addresses_; }
  // Of the first address that has one; 0: it listens on sockets alone.
  int port() const { return port_; }
  // 0: no HTTP listener.
  int http_port() const { return http_ == nullptr ? 0 : http_->port(); }
  // 0: no web listener, or one on a socket of the file system.
  int web_port() const { return web_ == nullptr ? 0 : web_->port(); }
  session::SessionRegistry& sessions() { return *sessions_; }

  // Reads the callers file, the JWT keys, and the certificates, again now, where there are any;
  // they are looked at every 2 s anyway.
  void RefreshCallers();
  void RefreshJwtKeys();
  void RefreshTlsFiles();

  // Stops in order: health says NOT_SERVING, new work is refused, plans end with their best answer,
  // streams are told where to resume, merges finish, the port closes. Idempotent.
  void Drain();

 private:
  Server(const ServerOptions& options, store::Store& store, telemetry::Log& log,
         std::unique_ptr<auth::CallersFile> callers, std::unique_ptr<auth::JwtIssuer> jwts,
         std::unique_ptr<auth::TlsFiles> tls_files, session::Algorithms algorithms,
         session::Journal::Clock clock);
  absl::Status Serve(const Credentials& credentials);
  absl::Status Listen(grpc::ServerBuilder& builder, const Credentials& credentials);
  void TellJump(absl::Duration by, bool followed);
  void SetServing(bool serving);
  absl::Status ServeHttp();
  absl::Status ServeWeb();
  void CollectLater() ABSL_EXCLUSIVE_LOCKS_REQUIRED(collect_mutex_);
  void Collect();
  void RefreshLater() ABSL_EXCLUSIVE_LOCKS_REQUIRED(refresh_mutex_);

  const ServerOptions options_;
  const std::unique_ptr<auth::TlsFiles> tls_files_;  // null: the ports are not encrypted
  telemetry::Log& log_;
  bool drained_ = false;
  std::vector<std::string> addresses_;
  int port_ = 0;
  std::mutex collect_mutex_;  // held while it collects
  bool collects_ ABSL_GUARDED_BY(collect_mutex_) = false;
  std::mutex refresh_mutex_;
  bool refreshes_ ABSL_GUARDED_BY(refresh_mutex_) = false;
  // What is already logged.
  std::string refresh_error_ ABSL_GUARDED_BY(refresh_mutex_);
  std::string jwt_refresh_error_ ABSL_GUARDED_BY(refresh_mutex_);
  telemetry::Metrics metrics_;
  store::InstrumentedStore store_;
  rpc::CallCounts calls_;
  std::atomic<const char*> state_{"starting"};
  execution::SteadiedClock clock_;
  const rpc::WebSeal web_seal_ = rpc::WebSeal::New();
  rpc::Authorizer authorizer_;
  execution::Timer timer_;
  session::MemoryAccount memory_;
  execution::PlanningPool pool_;
  execution::TaskPool tasks_;
  std::unique_ptr<session::SessionRegistry> sessions_;
  std::unique_ptr<rpc::Services> services_;
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<web::Gateway> web_;  // whose calls reach server_
  std::unique_ptr<telemetry::HttpListener> http_;
};

}  // namespace vantage::server

#endif  // VANTAGE_SERVER_MAIN_SERVER_H_

// The server as one object: everything that runs behind the gRPC port, started and stopped in
// order. What main() and the tests start.
#ifndef VANTAGE_SERVER_MAIN_SERVER_H_
#define VANTAGE_SERVER_MAIN_SERVER_H_

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <memory>
#include <mutex>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/execution/planning_pool.h"
#include "server/execution/task_pool.h"
#include "server/execution/timer.h"
#include "server/observe/log.h"
#include "server/rpc/services.h"
#include "server/session/session_registry.h"
#include "server/store/store.h"

namespace vantage {

struct ServerOptions {
  std::string listen = "127.0.0.1:7464";  // port 0: one that is free
  bool allow_insecure_remote = false;     // serve addresses other than loopback without TLS
  int threads = 0;                        // that compute; 0: one per core
  int request_threads = 4;                // that answer
  size_t queued_requests = 1024;
  Limits limits;
  // How often what is past its time is collected.
  std::chrono::milliseconds collect_every = std::chrono::minutes(10);
  // How long a shutdown may take: plans end and merges finish in this time.
  std::chrono::milliseconds drain_patience{20'000};
};

class Server {
 public:
  // Starts serving: NOT_SERVING until every session that the store has is taken up, SERVING then.
  // INVALID_ARGUMENT: an address that is not loopback without allow_insecure_remote.
  // UNAVAILABLE: the address cannot be had. `store` and `log` outlive the server.
  static absl::StatusOr<std::unique_ptr<Server>> Start(const ServerOptions& options, Store& store,
                                                       Log& log,
                                                       Algorithms algorithms = Algorithms::Core(),
                                                       Journal::Clock clock = absl::Now);
  // Drains first, where that has not happened.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  int port() const { return port_; }
  SessionRegistry& sessions() { return *sessions_; }

  // Ends in order: health says NOT_SERVING, new work is refused, plans end with their best,
  // streams are told where to resume, merges finish, the port closes. Idempotent.
  void Drain();

 private:
  Server(const ServerOptions& options, Store& store, Log& log, Algorithms algorithms,
         Journal::Clock clock);
  absl::Status Serve();
  void SetServing(bool serving);
  void CollectLater() ABSL_EXCLUSIVE_LOCKS_REQUIRED(collect_mutex_);
  void Collect();

  const ServerOptions options_;
  Log& log_;
  bool drained_ = false;
  int port_ = 0;
  std::mutex collect_mutex_;  // held while it collects
  bool collects_ ABSL_GUARDED_BY(collect_mutex_) = false;
  Timer timer_;
  PlanningPool pool_;
  TaskPool tasks_;
  std::unique_ptr<SessionRegistry> sessions_;
  std::unique_ptr<Services> services_;
  std::unique_ptr<grpc::Server> server_;
};

// True for 127.0.0.0/8, [::1], localhost and unix sockets, with or without a port.
bool IsLoopback(const std::string& address);

}  // namespace vantage

#endif  // VANTAGE_SERVER_MAIN_SERVER_H_

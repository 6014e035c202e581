// Calls to this process's own gRPC server, by the names of their methods, with messages as bytes.
#ifndef VANTAGE_SERVER_WEB_UPSTREAM_H_
#define VANTAGE_SERVER_WEB_UPSTREAM_H_

#include <grpcpp/channel.h>
#include <grpcpp/support/status.h>

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

namespace vantage::web {

struct UpstreamRequest {
  std::string path;  // '/vantage.v1.PlanService/CreatePlan'
  std::multimap<std::string, std::string> metadata;
  std::optional<std::chrono::milliseconds> timeout;
  std::string message;  // serialized
};

// A call under way. What it was given is called on gRPC's threads, which must not wait. Of what the
// server sends but messages and status nothing is passed on. Thread safe.
class Upstream {
 public:
  virtual ~Upstream() = default;
  // Ends the call early; it is still told how it ended. Idempotent.
  virtual void Cancel() = 0;
  // Of a stream: asks for the next message. To be called once after each message, and at the
  // beginning.
  virtual void Next() = 0;
};

// `done` is called once, with the answer where the status is OK.
std::shared_ptr<Upstream> CallUnary(const std::shared_ptr<grpc::Channel>& channel,
                                    const UpstreamRequest& request,
                                    std::function<void(grpc::Status, std::string)> done);

// Nothing is read ahead: a message is fetched when it is asked for, so none queue up. `message` is
// called once for each Next() that brings one, and `done` once, after all messages. Whoever asks
// for no further message has to Cancel().
std::shared_ptr<Upstream> CallStream(const std::shared_ptr<grpc::Channel>& channel,
                                     const UpstreamRequest& request,
                                     std::function<void(std::string)> message,
                                     std::function<void(grpc::Status)> done);

}  // namespace vantage::web

#endif  // VANTAGE_SERVER_WEB_UPSTREAM_H_

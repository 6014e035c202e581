// A gRPC server in process that answers every call with messages without end.
#ifndef VANTAGE_TESTS_SERVER_WEB_ENDLESS_SERVER_H_
#define VANTAGE_TESTS_SERVER_WEB_ENDLESS_SERVER_H_

#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <future>
#include <memory>
#include <string>

namespace vantage::web {

class EndlessServer {
 public:
  explicit EndlessServer(size_t message_bytes);
  ~EndlessServer();

  std::shared_ptr<grpc::Channel> channel() { return channel_; }
  // Messages whose writing ended: somebody has read them.
  int64_t written() const { return written_; }
  // Until the first call has ended.
  void WaitForEnd() { ended_.get_future().wait(); }

 private:
  class Service : public grpc::CallbackGenericService {
   public:
    explicit Service(EndlessServer& server) : server_(server) {}
    grpc::ServerGenericBidiReactor* CreateReactor(
        grpc::GenericCallbackServerContext* context) override;

   private:
    EndlessServer& server_;
  };
  friend class EndlessStream;

  const grpc::ByteBuffer message_;
  std::atomic<int64_t> written_{0};
  std::atomic<bool> told_{false};
  std::promise<void> ended_;
  Service service_{*this};
  std::unique_ptr<grpc::Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
};

}  // namespace vantage::web

#endif  // VANTAGE_TESTS_SERVER_WEB_ENDLESS_SERVER_H_

#include "tests/server/web/endless_server.h"

namespace vantage::web {
namespace {

grpc::ByteBuffer Filled(size_t bytes) {
  const grpc::Slice slice(std::string(bytes, 'm'));
  return grpc::ByteBuffer(&slice, 1);
}

}  // namespace

class EndlessStream final : public grpc::ServerGenericBidiReactor {
 public:
  explicit EndlessStream(EndlessServer& server) : server_(server) { Write(); }

  void OnWriteDone(bool ok) override {
    if (!ok) return Finish(grpc::Status::CANCELLED);
    ++server_.written_;
    Write();
  }
  void OnDone() override {
    if (!server_.told_.exchange(true)) server_.ended_.set_value();
    delete this;
  }

 private:
  void Write() {
    message_ = server_.message_;
    StartWrite(&message_);
  }
  EndlessServer& server_;
  grpc::ByteBuffer message_;
};

grpc::ServerGenericBidiReactor* EndlessServer::Service::CreateReactor(
    grpc::GenericCallbackServerContext*) {
  return new EndlessStream(server_);
}

EndlessServer::EndlessServer(size_t message_bytes) : message_(Filled(message_bytes)) {
  grpc::ServerBuilder builder;
  builder.RegisterCallbackGenericService(&service_);
  server_ = builder.BuildAndStart();
  channel_ = server_->InProcessChannel({});
}

EndlessServer::~EndlessServer() {
  channel_ = nullptr;
  server_->Shutdown(std::chrono::system_clock::now());
}

}  // namespace vantage::web

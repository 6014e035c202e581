// The gRPC services: each method hands its call to a handler or a stream.
#ifndef VANTAGE_SERVER_RPC_SERVICES_H_
#define VANTAGE_SERVER_RPC_SERVICES_H_

#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>
#include <vector>

#include "server/rpc/call/dependencies.h"

namespace vantage::rpc {

class Services {
 public:
  explicit Services(const RpcDependencies& dependencies);
  ~Services();

  void Register(grpc::ServerBuilder& builder);
  // Full names, as health knows them.
  static std::vector<std::string> Names();

 private:
  std::vector<std::unique_ptr<grpc::Service>> services_;
};

}  // namespace vantage::rpc

#endif  // VANTAGE_SERVER_RPC_SERVICES_H_

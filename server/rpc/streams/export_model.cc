#include "server/rpc/streams/file_stream.h"
#include "server/rpc/streams/streams.h"
#include "server/session/export.h"

namespace vantage::rpc {

grpc::ServerWriteReactor<v1::ExportModelResponse>* ExportModel(
    const RpcDependencies& dependencies, const std::shared_ptr<RpcCall>& call,
    grpc::CallbackServerContext* context, const v1::ExportModelRequest& request) {
  return StreamFile<session::Export, v1::ExportModelRequest, v1::ExportModelResponse>(
      dependencies, call, context, request);
}

}  // namespace vantage::rpc

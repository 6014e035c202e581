#include "server/report/report.h"
#include "server/rpc/streams/file_stream.h"
#include "server/rpc/streams/streams.h"

namespace vantage::rpc {

grpc::ServerWriteReactor<v1::ExportReportResponse>* ExportReport(
    const RpcDependencies& dependencies, const std::shared_ptr<RpcCall>& call,
    grpc::CallbackServerContext* context, const v1::ExportReportRequest& request) {
  return StreamFile<report::Report, v1::ExportReportRequest, v1::ExportReportResponse>(
      dependencies, call, context, request);
}

}  // namespace vantage::rpc

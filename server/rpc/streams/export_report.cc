#include <memory>
#include <utility>

#include "server/conversion/check_request.h"
#include "server/report/report.h"
#include "server/rpc/handlers/lookup.h"
#include "server/rpc/streams/file_stream.h"
#include "server/rpc/streams/streams.h"

namespace vantage::rpc {

grpc::ServerWriteReactor<v1::ExportReportResponse>* ExportReport(
    const RpcDependencies& dependencies, const std::shared_ptr<RpcCall>& call,
    grpc::CallbackServerContext* context, const v1::ExportReportRequest& request) {
  using Refused = RefusedStream<grpc::ServerWriteReactor<v1::ExportReportResponse>>;
  absl::Status open = dependencies.sessions.CheckTakesWork();
  if (!open.ok()) return new Refused(*call, open, context);
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindSession(call->sessions(), request.name(), "name");
  if (!session.ok()) return new Refused(*call, session.status(), context);
  absl::Status valid = conversion::CheckRequest(request);
  if (!valid.ok()) return new Refused(*call, valid, context);
  absl::StatusOr<std::unique_ptr<report::Report>> source =
      report::Report::Create(*session, request);
  if (!source.ok()) return new Refused(*call, source.status(), context);
  return BeginStream<FileStream<v1::ExportReportResponse, report::Report>>(
      dependencies, call, context, *std::move(source));
}

}  // namespace vantage::rpc

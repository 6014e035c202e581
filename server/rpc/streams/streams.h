// The streaming RPCs, for admitted calls. Each has its own file.
#ifndef VANTAGE_SERVER_RPC_STREAMS_STREAMS_H_
#define VANTAGE_SERVER_RPC_STREAMS_STREAMS_H_

#include <grpcpp/grpcpp.h>

#include <memory>

#include "server/rpc/call/dependencies.h"
#include "server/rpc/call/rpc_call.h"
#include "vantage/v1/model_service.pb.h"
#include "vantage/v1/plan_service.pb.h"
#include "vantage/v1/scan_service.pb.h"
#include "vantage/v1/session_service.pb.h"

namespace vantage::rpc {

grpc::ServerWriteReactor<v1::WatchSessionResponse>* WatchSession(
    const RpcDependencies& dependencies, const std::shared_ptr<RpcCall>& call,
    grpc::CallbackServerContext* context, const v1::WatchSessionRequest& request);

grpc::ServerWriteReactor<v1::WatchPlanResponse>* WatchPlan(const RpcDependencies& dependencies,
                                                           const std::shared_ptr<RpcCall>& call,
                                                           grpc::CallbackServerContext* context,
                                                           const v1::WatchPlanRequest& request);

grpc::ServerWriteReactor<v1::CreateTourResponse>* CreateTour(const RpcDependencies& dependencies,
                                                             const std::shared_ptr<RpcCall>& call,
                                                             grpc::CallbackServerContext* context,
                                                             const v1::CreateTourRequest& request);

grpc::ServerBidiReactor<v1::UploadScanRequest, v1::UploadScanResponse>* UploadScan(
    const RpcDependencies& dependencies, const std::shared_ptr<RpcCall>& call,
    grpc::CallbackServerContext* context);

grpc::ServerWriteReactor<v1::ExportModelResponse>* ExportModel(
    const RpcDependencies& dependencies, const std::shared_ptr<RpcCall>& call,
    grpc::CallbackServerContext* context, const v1::ExportModelRequest& request);

grpc::ServerWriteReactor<v1::ExportReportResponse>* ExportReport(
    const RpcDependencies& dependencies, const std::shared_ptr<RpcCall>& call,
    grpc::CallbackServerContext* context, const v1::ExportReportRequest& request);

}  // namespace vantage::rpc

#endif  // VANTAGE_SERVER_RPC_STREAMS_STREAMS_H_

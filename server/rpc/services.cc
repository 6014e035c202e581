#include "server/rpc/services.h"

#include <string>

#include "server/rpc/call/rules.h"
#include "server/rpc/call/unary_call.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/streams/pumped_writer.h"
#include "server/rpc/streams/streams.h"
#include "vantage/v1/fleet_service.grpc.pb.h"
#include "vantage/v1/model_service.grpc.pb.h"
#include "vantage/v1/plan_service.grpc.pb.h"
#include "vantage/v1/scan_service.grpc.pb.h"
#include "vantage/v1/session_service.grpc.pb.h"

namespace vantage::rpc {
namespace {

using Context = grpc::CallbackServerContext;

// A unary method whose handler has the method's name.
#define VANTAGE_UNARY(Method)                                                            \
  grpc::ServerUnaryReactor* Method(Context* context, const v1::Method##Request* request, \
                                   v1::Method##Response* response) override {            \
    static constexpr const RpcRule& kRule = RuleOf(#Method);                             \
    return UnaryCall<v1::Method##Request, v1::Method##Response>::Start(                  \
        dependencies_, kRule, context, request, response, handlers::Method);             \
  }

// A server-streaming method: if the call is admitted, the function of the method's name makes the
// stream.
#define VANTAGE_STREAM(Method)                                                   \
  grpc::ServerWriteReactor<v1::Method##Response>* Method(                        \
      Context* context, const v1::Method##Request* request) override {           \
    static constexpr const RpcRule& kRule = RuleOf(#Method);                     \
    const auto call = std::make_shared<RpcCall>(dependencies_, kRule, *context); \
    call->Concerns(*request);                                                    \
    if (!call->admitted().ok()) {                                                \
      return new RefusedStream<grpc::ServerWriteReactor<v1::Method##Response>>(  \
          *call, call->admitted(), context);                                     \
    }                                                                            \
    return rpc::Method(dependencies_, call, context, *request);                  \
  }

class SessionServiceImpl final : public v1::SessionService::CallbackService {
 public:
  explicit SessionServiceImpl(const RpcDependencies& dependencies) : dependencies_(dependencies) {}
  VANTAGE_UNARY(CreateSession)
  VANTAGE_UNARY(GetSession)
  VANTAGE_UNARY(ListSessions)
  VANTAGE_UNARY(UpdateSession)
  VANTAGE_UNARY(DeleteSession)
  VANTAGE_UNARY(ImportSession)
  VANTAGE_STREAM(WatchSession)

 private:
  const RpcDependencies dependencies_;
};

class ScanServiceImpl final : public v1::ScanService::CallbackService {
 public:
  explicit ScanServiceImpl(const RpcDependencies& dependencies) : dependencies_(dependencies) {}
  VANTAGE_UNARY(CreateUpload)
  VANTAGE_UNARY(GetUpload)
  VANTAGE_UNARY(ListUploads)
  VANTAGE_UNARY(AbortUpload)
  VANTAGE_UNARY(UploadPiece)
  VANTAGE_UNARY(GetScan)
  VANTAGE_UNARY(ListScans)
  VANTAGE_UNARY(AcceptScan)
  VANTAGE_UNARY(CompareScanPoses)
  VANTAGE_UNARY(SetScanPose)
  VANTAGE_UNARY(WithdrawScan)
  grpc::ServerBidiReactor<v1::UploadScanRequest, v1::UploadScanResponse>* UploadScan(
      Context* context) override {
    using Reactor = grpc::ServerBidiReactor<v1::UploadScanRequest, v1::UploadScanResponse>;
    static constexpr const RpcRule& kRule = RuleOf("UploadScan");
    const auto call = std::make_shared<RpcCall>(dependencies_, kRule, *context);
    if (!call->admitted().ok()) {
      call->Audit(call->admitted());
      return new RefusedStream<Reactor>(*call, call->admitted(), context);
    }
    return vantage::rpc::UploadScan(dependencies_, call, context);
  }

 private:
  const RpcDependencies dependencies_;
};

class PlanServiceImpl final : public v1::PlanService::CallbackService {
 public:
  explicit PlanServiceImpl(const RpcDependencies& dependencies) : dependencies_(dependencies) {}
  VANTAGE_UNARY(CreatePlan)
  VANTAGE_UNARY(CancelPlan)
  VANTAGE_UNARY(DeletePlan)
  VANTAGE_UNARY(GetPlan)
  VANTAGE_UNARY(ListPlans)
  VANTAGE_UNARY(EvaluateView)
  VANTAGE_UNARY(RejectView)
  VANTAGE_UNARY(ListRejections)
  VANTAGE_UNARY(DeleteRejection)
  VANTAGE_STREAM(WatchPlan)
  VANTAGE_STREAM(CreateTour)

 private:
  const RpcDependencies dependencies_;
};

class FleetServiceImpl final : public v1::FleetService::CallbackService {
 public:
  explicit FleetServiceImpl(const RpcDependencies& dependencies) : dependencies_(dependencies) {}
  VANTAGE_UNARY(CreateScanner)
  VANTAGE_UNARY(GetScanner)
  VANTAGE_UNARY(ListScanners)
  VANTAGE_UNARY(UpdateScanner)
  VANTAGE_UNARY(DeleteScanner)
  VANTAGE_UNARY(ClaimView)
  VANTAGE_UNARY(RenewClaim)
  VANTAGE_UNARY(ReleaseClaim)
  VANTAGE_UNARY(GetClaim)
  VANTAGE_UNARY(ListClaims)
  VANTAGE_UNARY(CreateStation)
  VANTAGE_UNARY(GetStation)
  VANTAGE_UNARY(ListStations)
  VANTAGE_UNARY(DeleteStation)

 private:
  const RpcDependencies dependencies_;
};

class ModelServiceImpl final : public v1::ModelService::CallbackService {
 public:
  explicit ModelServiceImpl(const RpcDependencies& dependencies) : dependencies_(dependencies) {}
  VANTAGE_UNARY(GetCoverage)
  VANTAGE_UNARY(GetPoseGraph)
  VANTAGE_UNARY(SetSitePrior)
  VANTAGE_UNARY(GetSitePrior)
  VANTAGE_UNARY(ClearSitePrior)
  VANTAGE_STREAM(ExportModel)
  VANTAGE_STREAM(ExportReport)

 private:
  const RpcDependencies dependencies_;
};

#undef VANTAGE_UNARY
#undef VANTAGE_STREAM

}  // namespace

Services::Services(const RpcDependencies& dependencies) {
  services_.push_back(std::make_unique<SessionServiceImpl>(dependencies));
  services_.push_back(std::make_unique<ScanServiceImpl>(dependencies));
  services_.push_back(std::make_unique<PlanServiceImpl>(dependencies));
  services_.push_back(std::make_unique<FleetServiceImpl>(dependencies));
  services_.push_back(std::make_unique<ModelServiceImpl>(dependencies));
}

Services::~Services() = default;

void Services::Register(grpc::ServerBuilder& builder) {
  for (const auto& service : services_) builder.RegisterService(service.get());
}

std::vector<std::string> Services::Names() {
  return {
      v1::SessionService::service_full_name(), v1::ScanService::service_full_name(),
      v1::PlanService::service_full_name(),    v1::FleetService::service_full_name(),
      v1::ModelService::service_full_name(),
  };
}

}  // namespace vantage::rpc

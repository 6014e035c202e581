#include "server/rpc/services.h"

#include <string>

#include "server/rpc/handlers.h"
#include "server/rpc/streams.h"
#include "server/rpc/unary_call.h"
#include "vantage/v1/fleet_service.grpc.pb.h"
#include "vantage/v1/model_service.grpc.pb.h"
#include "vantage/v1/plan_service.grpc.pb.h"
#include "vantage/v1/scan_service.grpc.pb.h"
#include "vantage/v1/session_service.grpc.pb.h"

namespace vantage {
namespace {

using Context = grpc::CallbackServerContext;

// A method whose handler has its name.
#define VANTAGE_UNARY(Method)                                                            \
  grpc::ServerUnaryReactor* Method(Context* context, const v1::Method##Request* request, \
                                   v1::Method##Response* response) override {            \
    return UnaryCall<v1::Method##Request, v1::Method##Response>::Start(                  \
        around_, #Method, context, request, response, handlers::Method);                 \
  }

class SessionServiceImpl final : public v1::SessionService::CallbackService {
 public:
  explicit SessionServiceImpl(const RpcEnvironment& around) : around_(around) {}
  grpc::ServerUnaryReactor* CreateSession(Context* context, const v1::CreateSessionRequest* request,
                                          v1::CreateSessionResponse* response) override {
    using Call = UnaryCall<v1::CreateSessionRequest, v1::CreateSessionResponse>;
    return Call::Start(
        around_, "CreateSession", context, request, response,
        [tenant = TenantOf(*context)](
            SessionRegistry& sessions, const v1::CreateSessionRequest& asked,
            const Call::Done& done) { done(handlers::CreateSession(sessions, asked, tenant)); });
  }
  VANTAGE_UNARY(GetSession)
  VANTAGE_UNARY(ListSessions)
  VANTAGE_UNARY(UpdateSession)
  VANTAGE_UNARY(DeleteSession)
  grpc::ServerWriteReactor<v1::WatchSessionResponse>* WatchSession(
      Context* context, const v1::WatchSessionRequest* request) override {
    return vantage::WatchSession(around_, context, *request);
  }

 private:
  // As the caller's metadata say, where they may.
  std::string TenantOf(const Context& context) const {
    const std::string& key = around_.sessions.around().limits.tenant_metadata;
    if (key.empty()) return "";
    const auto named = context.client_metadata().find(key);
    if (named == context.client_metadata().end()) return "";
    return {named->second.data(), named->second.size()};
  }

  const RpcEnvironment around_;
};

class ScanServiceImpl final : public v1::ScanService::CallbackService {
 public:
  explicit ScanServiceImpl(const RpcEnvironment& around) : around_(around) {}
  VANTAGE_UNARY(CreateUpload)
  VANTAGE_UNARY(GetUpload)
  VANTAGE_UNARY(UploadPiece)
  VANTAGE_UNARY(GetScan)
  VANTAGE_UNARY(ListScans)
  VANTAGE_UNARY(AcceptScan)
  VANTAGE_UNARY(SetScanPose)
  VANTAGE_UNARY(WithdrawScan)
  grpc::ServerBidiReactor<v1::UploadScanRequest, v1::UploadScanResponse>* UploadScan(
      Context* context) override {
    return vantage::UploadScan(around_, context);
  }

 private:
  const RpcEnvironment around_;
};

class PlanServiceImpl final : public v1::PlanService::CallbackService {
 public:
  explicit PlanServiceImpl(const RpcEnvironment& around) : around_(around) {}
  VANTAGE_UNARY(CreatePlan)
  VANTAGE_UNARY(CancelPlan)
  VANTAGE_UNARY(GetPlan)
  VANTAGE_UNARY(ListPlans)
  VANTAGE_UNARY(EvaluateView)
  VANTAGE_UNARY(RejectView)
  grpc::ServerWriteReactor<v1::WatchPlanResponse>* WatchPlan(
      Context* context, const v1::WatchPlanRequest* request) override {
    return vantage::WatchPlan(around_, context, *request);
  }

 private:
  const RpcEnvironment around_;
};

class FleetServiceImpl final : public v1::FleetService::CallbackService {
 public:
  explicit FleetServiceImpl(const RpcEnvironment& around) : around_(around) {}
  VANTAGE_UNARY(AddScanner)
  VANTAGE_UNARY(ListScanners)
  VANTAGE_UNARY(ClaimView)
  VANTAGE_UNARY(RenewClaim)
  VANTAGE_UNARY(ReleaseClaim)
  VANTAGE_UNARY(ListClaims)

 private:
  const RpcEnvironment around_;
};

class ModelServiceImpl final : public v1::ModelService::CallbackService {
 public:
  explicit ModelServiceImpl(const RpcEnvironment& around) : around_(around) {}
  VANTAGE_UNARY(GetCoverage)
  grpc::ServerWriteReactor<v1::ExportModelResponse>* ExportModel(
      Context* context, const v1::ExportModelRequest* request) override {
    return vantage::ExportModel(around_, context, *request);
  }

 private:
  const RpcEnvironment around_;
};

#undef VANTAGE_UNARY

}  // namespace

Services::Services(const RpcEnvironment& around) {
  services_.push_back(std::make_unique<SessionServiceImpl>(around));
  services_.push_back(std::make_unique<ScanServiceImpl>(around));
  services_.push_back(std::make_unique<PlanServiceImpl>(around));
  services_.push_back(std::make_unique<FleetServiceImpl>(around));
  services_.push_back(std::make_unique<ModelServiceImpl>(around));
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

}  // namespace vantage

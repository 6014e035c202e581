// The role that each RPC needs of its caller, in one table that has every RPC of the contract.
#ifndef VANTAGE_SERVER_RPC_CALL_RULES_H_
#define VANTAGE_SERVER_RPC_CALL_RULES_H_

#include <stdexcept>
#include <string_view>

#include "server/auth/role.h"

namespace vantage::rpc {

struct RpcRule {
  std::string_view service;  // of vantage.v1
  std::string_view method;
  auth::Role needs;
  bool mutates;  // leaves a line in the audit
  bool stream = false;
};

inline constexpr RpcRule kRpcRules[] = {
    {"SessionService", "CreateSession", auth::Role::kSubmit, true},
    {"SessionService", "GetSession", auth::Role::kRead, false},
    {"SessionService", "ListSessions", auth::Role::kRead, false},
    {"SessionService", "UpdateSession", auth::Role::kPlan, true},
    {"SessionService", "DeleteSession", auth::Role::kAdminister, true},
    {"SessionService", "ImportSession", auth::Role::kAdminister, true},
    {"SessionService", "WatchSession", auth::Role::kRead, false, true},
    {"ScanService", "CreateUpload", auth::Role::kSubmit, true},
    {"ScanService", "GetUpload", auth::Role::kSubmit, false},
    {"ScanService", "ListUploads", auth::Role::kSubmit, false},
    {"ScanService", "AbortUpload", auth::Role::kSubmit, true},
    {"ScanService", "UploadScan", auth::Role::kSubmit, true, true},
    {"ScanService", "UploadPiece", auth::Role::kSubmit, true},
    {"ScanService", "GetScan", auth::Role::kRead, false},
    {"ScanService", "ListScans", auth::Role::kRead, false},
    {"ScanService", "AcceptScan", auth::Role::kSubmit, true},
    {"ScanService", "CompareScanPoses", auth::Role::kRead, false},
    {"ScanService", "SetScanPose", auth::Role::kSubmit, true},
    {"ScanService", "WithdrawScan", auth::Role::kSubmit, true},
    {"PlanService", "CreatePlan", auth::Role::kPlan, true},
    {"PlanService", "WatchPlan", auth::Role::kRead, false, true},
    {"PlanService", "CancelPlan", auth::Role::kPlan, true},
    {"PlanService", "DeletePlan", auth::Role::kPlan, true},
    {"PlanService", "GetPlan", auth::Role::kRead, false},
    {"PlanService", "ListPlans", auth::Role::kRead, false},
    {"PlanService", "EvaluateView", auth::Role::kPlan, false},
    {"PlanService", "CreateTour", auth::Role::kPlan, false, true},
    {"PlanService", "RejectView", auth::Role::kPlan, true},
    {"PlanService", "ListRejections", auth::Role::kRead, false},
    {"PlanService", "DeleteRejection", auth::Role::kPlan, true},
    {"FleetService", "CreateScanner", auth::Role::kPlan, true},
    {"FleetService", "GetScanner", auth::Role::kRead, false},
    {"FleetService", "ListScanners", auth::Role::kRead, false},
    {"FleetService", "UpdateScanner", auth::Role::kPlan, true},
    {"FleetService", "DeleteScanner", auth::Role::kPlan, true},
    {"FleetService", "ClaimView", auth::Role::kPlan, true},
    {"FleetService", "RenewClaim", auth::Role::kPlan, true},
    {"FleetService", "ReleaseClaim", auth::Role::kPlan, true},
    {"FleetService", "GetClaim", auth::Role::kRead, false},
    {"FleetService", "ListClaims", auth::Role::kRead, false},
    {"FleetService", "CreateStation", auth::Role::kSubmit, true},
    {"FleetService", "GetStation", auth::Role::kRead, false},
    {"FleetService", "ListStations", auth::Role::kRead, false},
    {"FleetService", "DeleteStation", auth::Role::kSubmit, true},
    {"ModelService", "GetCoverage", auth::Role::kRead, false},
    {"ModelService", "GetPoseGraph", auth::Role::kRead, false},
    {"ModelService", "SetSitePrior", auth::Role::kPlan, true},
    {"ModelService", "GetSitePrior", auth::Role::kRead, false},
    {"ModelService", "ClearSitePrior", auth::Role::kPlan, true},
    {"ModelService", "ExportModel", auth::Role::kRead, false, true},
    {"ModelService", "ExportReport", auth::Role::kRead, false, true},
};

// A method without a rule does not compile.
consteval const RpcRule& RuleOf(std::string_view method) {
  for (const RpcRule& rule : kRpcRules) {
    if (rule.method == method) return rule;
  }
  throw std::logic_error("add the method to kRpcRules");
}

}  // namespace vantage::rpc

#endif  // VANTAGE_SERVER_RPC_CALL_RULES_H_

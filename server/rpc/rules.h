// What each RPC needs of its caller. One table, and every RPC of the contract is in it.
#ifndef VANTAGE_SERVER_RPC_RULES_H_
#define VANTAGE_SERVER_RPC_RULES_H_

#include <stdexcept>
#include <string_view>

#include "server/guard/role.h"

namespace vantage {

struct RpcRule {
  std::string_view service;  // of vantage.v1
  std::string_view method;
  Role needs;
  bool mutates;  // leaves a line in the audit
  bool stream = false;
};

inline constexpr RpcRule kRpcRules[] = {
    {"SessionService", "CreateSession", Role::kSubmit, true},
    {"SessionService", "GetSession", Role::kRead, false},
    {"SessionService", "ListSessions", Role::kRead, false},
    {"SessionService", "UpdateSession", Role::kPlan, true},
    {"SessionService", "DeleteSession", Role::kAdminister, true},
    {"SessionService", "WatchSession", Role::kRead, false, true},
    {"ScanService", "CreateUpload", Role::kSubmit, true},
    {"ScanService", "GetUpload", Role::kSubmit, false},
    {"ScanService", "UploadScan", Role::kSubmit, true, true},
    {"ScanService", "UploadPiece", Role::kSubmit, true},
    {"ScanService", "GetScan", Role::kRead, false},
    {"ScanService", "ListScans", Role::kRead, false},
    {"ScanService", "AcceptScan", Role::kSubmit, true},
    {"ScanService", "SetScanPose", Role::kSubmit, true},
    {"ScanService", "WithdrawScan", Role::kSubmit, true},
    {"PlanService", "CreatePlan", Role::kPlan, true},
    {"PlanService", "WatchPlan", Role::kRead, false, true},
    {"PlanService", "CancelPlan", Role::kPlan, true},
    {"PlanService", "GetPlan", Role::kRead, false},
    {"PlanService", "ListPlans", Role::kRead, false},
    {"PlanService", "EvaluateView", Role::kPlan, false},
    {"PlanService", "RejectView", Role::kPlan, true},
    {"FleetService", "AddScanner", Role::kPlan, true},
    {"FleetService", "ListScanners", Role::kRead, false},
    {"FleetService", "ClaimView", Role::kPlan, true},
    {"FleetService", "RenewClaim", Role::kPlan, true},
    {"FleetService", "ReleaseClaim", Role::kPlan, true},
    {"FleetService", "ListClaims", Role::kRead, false},
    {"ModelService", "GetCoverage", Role::kRead, false},
    {"ModelService", "ExportModel", Role::kRead, false, true},
};

// A method without a rule does not compile.
consteval const RpcRule& RuleOf(std::string_view method) {
  for (const RpcRule& rule : kRpcRules) {
    if (rule.method == method) return rule;
  }
  throw std::logic_error("add the method to kRpcRules");
}

}  // namespace vantage

#endif  // VANTAGE_SERVER_RPC_RULES_H_

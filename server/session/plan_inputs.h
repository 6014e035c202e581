// The inputs of a plan, a what-if or a claim.
#ifndef VANTAGE_SERVER_SESSION_PLAN_INPUTS_H_
#define VANTAGE_SERVER_SESSION_PLAN_INPUTS_H_

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/fleet/joint_plan.h"
#include "core/parallel/budget.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/setting_choice.h"
#include "core/sensor/scanner_model.h"
#include "server/session/algorithms.h"
#include "server/session/memory_account.h"
#include "server/session/model_memory.h"
#include "server/session/session_context.h"
#include "server/session/site_prior_use.h"
#include "vantage/v1/plan_service.pb.h"

namespace vantage::session {

struct PlanInputs {
  ModelSnapshot model;
  std::string last_scan;       // id of the scan that was made at the last station
  v1::PlanningConfig written;  // the complete configuration
  planning::PlanningConfig config;
  std::string read_from;                   // all that `config` was read from, but its seed
  std::optional<SitePriorQuestion> prior;  // of the site; nothing where the session has none
  sensor::ScannerModel scanner;
  std::string scanner_id;
  std::string preset;   // of the scanner; empty: none
  std::string setting;  // of the preset
  parallel::Budget budget;
  double seconds = 0;  // time budget, 0: none
  // Set for named scanners, for plans around claims, and for ranking by score per minute.
  bool joint = false;
  fleet::FleetRequest fleet;
  size_t scanner_models = 1;          // distinct ones, of fleet.scanners
  std::vector<std::string> scanners;  // names of fleet.scanners; empty: no scanner is named
  std::vector<std::string> claims;    // names of the claims in fleet.pledged
  std::vector<std::string> stations;  // names of the stations that follow there
  std::vector<planning::SettingOption> settings;       // to choose from; empty: no choice
  std::vector<Eigen::Vector3d> tour_stations;          // of a tour that is followed, m, model frame
  std::shared_ptr<MemoryAccount::Reservation> memory;  // given back with the last copy
  int64_t memory_of_prior = 0;  // bytes of that for what the site's prior adds
  // Bytes of both that it needs for certain: what a prior adds is guessed before its first use.
  int64_t certain_memory = 0;
  SitePriorUse::Wanted wanted = SitePriorUse::Wanted::kAsked;
};

// With the newest model and the session's configuration, `overrides` over it. Empty id: the
// session's first scanner. INVALID_ARGUMENT, fields named behind `prefix`; as
// ModelMemory::WhyNone() where there is no model.
absl::StatusOr<PlanInputs> ReadPlanInputs(SessionContext& context, ModelMemory& model,
                                          const std::string& scanner_model_id,
                                          const v1::PlanningConfig& overrides,
                                          const std::string& prefix);

// The same of a plan that is asked for: with its scanners, claims, setting, seed and budget.
// RESOURCE_EXHAUSTED (PLAN_TOO_LARGE), as the plan itself would be refused.
absl::StatusOr<PlanInputs> ReadInputsOfPlan(SessionContext& context, ModelMemory& model,
                                            const v1::CreatePlanRequest& request);

// Heeds the preset and the setting that a plan names, or that it asks to choose one; after
// AddFleet(). INVALID_ARGUMENT: there is no such preset, or it has no such setting, or the plan
// asks for something else that does not go with it.
absl::Status UseSetting(const v1::Plan& plan, PlanInputs& inputs);

// Adds the scanners that a plan names, the claims that are held and the stations whose scans have
// not come. INVALID_ARGUMENT: a scanner is
// unknown or impossible.
absl::Status AddFleet(const SessionContext& context, const v1::CreatePlanRequest& request,
                      PlanInputs& inputs);

// Heeds the tour that a plan follows; after AddFleet() and UseSetting(). INVALID_ARGUMENT: the plan
// asks for something else that does not go with it.
absl::Status UseTour(const v1::Plan& plan, const Eigen::Vector3d& origin, PlanInputs& inputs);

// RESOURCE_EXHAUSTED (PLAN_TOO_LARGE), as the plan itself would be refused.
absl::Status CheckSize(const PlanInputs& inputs);

// Of a plan for one scanner, or of a what-if.
ProblemQuestion QuestionOf(const PlanInputs& inputs);

// What the session's prior shows of the site, and the memory of a plan with it. The site is null
// where there is no prior, or it is not used, of which GetSitePrior tells. Errors as of
// SitePriorUse::Of(), and RESOURCE_EXHAUSTED: MEMORY_SHORT, since without the prior it would be
// another plan; PLAN_TOO_LARGE: with the prior it takes more than the server ever has for it.
struct SiteOfPlan {
  std::shared_ptr<const planning::ExpectedSite> site;
  std::shared_ptr<MemoryAccount::Reservation> memory;
};
absl::StatusOr<SiteOfPlan> SiteOf(ModelMemory& model, const PlanInputs& inputs,
                                  const parallel::Cancellation& cancelled);

// The problem of a plan for one scanner, or of a what-if: prepared already, or made when it is
// asked for. Keeps the references.
PlanningTask TaskOf(ModelMemory& model, const PlanInputs& inputs);

// RESOURCE_EXHAUSTED (PLAN_TOO_LARGE) where `bytes` beside the session's model are more than the
// server ever has. `what` takes them, `cure` is what the caller may do.
absl::Status CheckEverFits(const ModelMemory& model, int64_t bytes, absl::string_view what,
                           absl::string_view cure);

// Reserves the memory that the plan will need. RESOURCE_EXHAUSTED (MEMORY_SHORT; PLAN_TOO_LARGE: it
// takes more than the server ever has for it).
absl::Status ReserveMemory(const ModelMemory& model, PlanInputs& inputs);
// The same of memory that nobody else is likely to miss, of which then all that the plan uses is;
// false when there is too little.
bool ReserveSpareMemory(const ModelMemory& model, PlanInputs& inputs);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_PLAN_INPUTS_H_

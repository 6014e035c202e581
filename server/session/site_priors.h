// A session's prior of the site: set, told, and taken out. What it is is in the log, its triangles
// in a blob.
#ifndef VANTAGE_SERVER_SESSION_SITE_PRIORS_H_
#define VANTAGE_SERVER_SESSION_SITE_PRIORS_H_

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/site_prior/site_prior.h"
#include "server/session/journal.h"
#include "server/session/memory_account.h"
#include "server/session/model_memory.h"
#include "server/session/preparation.h"
#include "server/session/session_context.h"
#include "vantage/v1/site_prior.pb.h"

namespace vantage::session {

// The model that a prior is; without a view where it comes as a file.
struct PriorSource {
  std::shared_ptr<const model::PlanningView> view;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // m, of its frame in its session's world
};

// Thread safe.
class SitePriors {
 public:
  SitePriors(SessionContext& context, ModelMemory& model, Preparation& preparation);

  // The request was checked. Reads the file in a process of its own, when it is the tenant's turn
  // (FileReadings), and makes the prior on the planning pool; `done` is called exactly once. Errors
  // are those of the contract.
  void Set(const v1::SetSitePriorRequest& request, PriorSource source,
           std::function<void(absl::StatusOr<v1::SetSitePriorResponse>)> done);
  // Compares it with the newest model on the planning pool, until nobody waits for that any more.
  // NOT_FOUND; RESOURCE_EXHAUSTED (TOO_MANY_EVALUATIONS, MEMORY_SHORT).
  void Describe(const v1::GetSitePriorRequest& request,
                std::function<void(absl::StatusOr<v1::GetSitePriorResponse>)> done,
                const std::stop_token& gone = {});
  // NOT_FOUND.
  absl::Status Clear(const v1::ClearSitePriorRequest& request);
  // The blob that is held, if any.
  std::vector<std::string> Blobs() const;
  // Ends what is being made or compared; nothing is begun any more.
  void Stop() { stop_.request_stop(); }

 private:
  class Setting;
  // Reads the file into `setting`.
  absl::Status Read(Setting& setting, const std::function<bool()>& given_up);
  absl::StatusOr<v1::SetSitePriorResponse> SetNow(Setting& setting);
  // RESOURCE_EXHAUSTED: the server never has the memory to compare it with the model as it is.
  absl::Status CheckComparable(const site_prior::SitePrior& prior) const;
  // Of a model without scans.
  std::shared_ptr<const model::PlanningView> EmptyView() const;
  // What a request made that was executed before. ALREADY_EXISTS (REQUEST_ID_REUSED); ABORTED
  // (SITE_PRIOR_REPLACED): it is not the prior any more.
  absl::StatusOr<v1::SetSitePriorResponse> Again(const RequestKey& key) const;
  // Memory for `bytes` beside those that are held already. RESOURCE_EXHAUSTED: FILE_TOO_LARGE, as
  // `too_large` says it, where the server never has so many; MEMORY_SHORT.
  absl::StatusOr<MemoryAccount::Reservation> Take(
      int64_t bytes, int64_t beside, const std::string& field,
      absl::FunctionRef<absl::Status(int64_t bytes, int64_t most)> too_large) const;

  SessionContext& context_;
  ModelMemory& model_;
  Preparation& preparation_;
  std::stop_source stop_;
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_SITE_PRIORS_H_

// A session's prior of the site: set, told, and taken out. What it is is in the log, its triangles
// in a blob.
#ifndef VANTAGE_SERVER_SESSION_SITE_PRIORS_H_
#define VANTAGE_SERVER_SESSION_SITE_PRIORS_H_

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "server/session/model_memory.h"
#include "server/session/preparation.h"
#include "server/session/session_context.h"
#include "vantage/v1/site_prior.pb.h"

namespace vantage::session {

// The most of a file: as it comes, and unfolded, bytes.
inline constexpr size_t kMostPriorSent = size_t{3} << 20;
inline constexpr size_t kMostPriorUnfolded = size_t{64} << 20;

// Thread safe: it has no state of its own.
class SitePriors {
 public:
  SitePriors(SessionContext& context, ModelMemory& model, Preparation& preparation);

  // The request was checked. `source`: the model that the prior is, or null. Reads the file on the
  // planning pool, in a process of its own; `done` is called exactly once. Errors are those of the
  // contract.
  void Set(const v1::SetSitePriorRequest& request,
           std::shared_ptr<const model::PlanningView> source,
           std::function<void(absl::StatusOr<v1::SetSitePriorResponse>)> done);
  // Compares it with the newest model on the planning pool. NOT_FOUND.
  void Describe(std::function<void(absl::StatusOr<v1::GetSitePriorResponse>)> done);
  // NOT_FOUND.
  absl::Status Clear(const v1::ClearSitePriorRequest& request);
  // The blob that is held, if any.
  std::vector<std::string> Blobs() const;

 private:
  absl::StatusOr<v1::SetSitePriorResponse> SetNow(const v1::SetSitePriorRequest& request,
                                                  const model::PlanningView* source);

  SessionContext& context_;
  ModelMemory& model_;
  Preparation& preparation_;
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_SITE_PRIORS_H_

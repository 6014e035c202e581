// What a session's prior of the site says of a model: made once for each version, as plans need it.
#ifndef VANTAGE_SERVER_SESSION_SITE_PRIOR_USE_H_
#define VANTAGE_SERVER_SESSION_SITE_PRIOR_USE_H_

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/planning/expectation/expected_site.h"
#include "core/site_prior/prior_mesh.h"
#include "core/site_prior/site_prior.h"
#include "server/session/session_state.h"
#include "server/store/store.h"
#include "vantage/v1/site_prior.pb.h"

namespace vantage::session {

// The prior of a session as its log has it.
struct SitePriorQuestion {
  v1::SitePrior prior;
  std::string blob;
  uint64_t set = 0;                                  // the entry that set it: tells priors apart
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // m, of the model frame in the world
  store::Store* store = nullptr;
};

// Nothing where the session has none.
std::optional<SitePriorQuestion> SitePriorOf(const SessionState& state,
                                             const Eigen::Vector3d& origin, store::Store& store);

// Where the two points put it. INVALID_ARGUMENT naming `site_prior.points` or `site_prior.scale`.
// `unit`: m for 1 of the file's coordinates.
absl::StatusOr<site_prior::PriorPose> ReadPlacement(const v1::SitePrior& prior, double unit,
                                                    const Eigen::Vector3d& origin);

// As it is stored.
std::string WritePriorBlob(const site_prior::PriorMesh& mesh);
// DATA_LOSS: it is not what that writes.
absl::StatusOr<site_prior::PriorMesh> ReadPriorBlob(const std::string& bytes);

// Thread safe.
class SitePriorUse {
 public:
  struct Use {
    site_prior::PriorStanding standing;                  // without its space
    std::shared_ptr<const planning::ExpectedSite> site;  // null where it is not used
  };
  // The last answer, if it is of the same, or a new one. Of two at a time both are made. Errors as
  // of site_prior::Judge() and store::Store::GetBlob().
  absl::StatusOr<std::shared_ptr<const Use>> Of(
      const SitePriorQuestion& question, const std::shared_ptr<const model::PlanningView>& view,
      const parallel::Cancellation& cancelled);

  // The last answer of that prior, of whatever model; null where there is none.
  std::shared_ptr<const Use> Last(const SitePriorQuestion& question) const;

 private:
  absl::StatusOr<std::shared_ptr<const site_prior::SitePrior>> Load(
      const SitePriorQuestion& question);

  mutable std::mutex mutex_;
  uint64_t loaded_ ABSL_GUARDED_BY(mutex_) = 0;  // SitePriorQuestion::set of the following
  std::shared_ptr<const site_prior::SitePrior> prior_ ABSL_GUARDED_BY(mutex_);
  uint64_t used_ ABSL_GUARDED_BY(mutex_) = 0;  // the same, of the following
  std::shared_ptr<const model::PlanningView> view_ ABSL_GUARDED_BY(mutex_);
  std::shared_ptr<const Use> use_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_SITE_PRIOR_USE_H_

// What a session's prior of the site says of a model: made once for each version, as plans need it,
// within the server's memory account.
#ifndef VANTAGE_SERVER_SESSION_SITE_PRIOR_USE_H_
#define VANTAGE_SERVER_SESSION_SITE_PRIOR_USE_H_

#include <Eigen/Core>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/planning/expectation/expected_site.h"
#include "core/site_prior/prior_mesh.h"
#include "core/site_prior/site_prior.h"
#include "core/site_prior/wall_lines.h"
#include "server/session/memory_account.h"
#include "server/session/session_state.h"
#include "server/session/tenant_memory.h"
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

// Where the prior's frame lies in the world by a standing: of another session's model the frame is
// that session's world.
Eigen::Isometry3d WorldPoseOf(const v1::SitePrior& prior, const site_prior::PriorPose& pose);

// The most of a stored prior, bytes, in archives too.
inline constexpr int64_t kMostPriorBlob = static_cast<int64_t>(site_prior::kMostPriorBytes) +
                                          (int64_t{1} << 20);  // what does not compress grows
// As it is stored.
std::string WritePriorBlob(const site_prior::PriorMesh& mesh);
// Bytes that ReadPriorBlob() takes at most: what was encoded, and the mesh.
int64_t UnfoldingBytes(const std::string& bytes);
// What a mesh holds, bytes.
int64_t BytesOf(const site_prior::PriorMesh& mesh);
// DATA_LOSS: it is not what that writes.
absl::StatusOr<site_prior::PriorMesh> ReadPriorBlob(const std::string& bytes);

// RESOURCE_EXHAUSTED without a retry: the server never has so many bytes for a prior, `most` being
// all that it has. Says the cure.
absl::Status PriorTooLarge(int64_t bytes, int64_t most);

// Thread safe.
class SitePriorUse {
 public:
  // Whether somebody asked for what it is used for. What nobody asked for yet gets memory only that
  // nobody is likely to miss.
  enum class Wanted : uint8_t { kAsked, kAhead };
  struct Asker {
    Wanted wanted = Wanted::kAsked;
    int64_t held = 0;  // bytes that it has reserved for itself, and keeps meanwhile
  };

  // `beside`: what the session has in memory whenever its prior is used, bytes.
  SitePriorUse(const TenantMemory& memory, std::function<int64_t()> beside)
      : memory_(memory), beside_(std::move(beside)) {}

  struct Use {
    site_prior::PriorStanding standing;  // without its space
    // Of the mesh as the standing's pose takes it; null where there is none to be had.
    std::shared_ptr<const std::vector<site_prior::WallLine>> walls;
    // Null where it is not used. Its memory is given back with the last who plans with it.
    std::shared_ptr<const planning::ExpectedSite> site;
  };
  // The last answer, if it is of the same, or a new one: one at a time is made, for which others
  // wait. What lasts is a verdict (kUnusable): its data are lost, it cannot be had, or it takes
  // more memory than the server ever has for it. Errors are those that pass: of
  // store::Store::GetBlob(), RESOURCE_EXHAUSTED (MEMORY_SHORT), and CANCELLED when that was
  // requested on the way; and RESOURCE_EXHAUSTED (PLAN_TOO_LARGE): there is never room for it
  // beside what the asker holds.
  absl::StatusOr<std::shared_ptr<const Use>> Of(
      const SitePriorQuestion& question, const std::shared_ptr<const model::PlanningView>& view,
      const Asker& asker, const parallel::Cancellation& cancelled);

  // The last answer of that prior, of whatever model; null where there is none.
  std::shared_ptr<const Use> Last(const SitePriorQuestion& question) const;

  // Lets go of it, and of what is being made. Returns the bytes that this gives back.
  int64_t Forget();

 private:
  // What a placed prior is a function of.
  struct Key {
    uint64_t set = 0;  // as SitePriorQuestion::set
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();
    bool operator==(const Key& other) const { return set == other.set && origin == other.origin; }
  };
  struct Loaded {
    Key key;
    std::shared_ptr<const site_prior::SitePrior> prior;
    std::shared_ptr<const std::vector<site_prior::WallLine>> walls;
    MemoryAccount::Reservation memory;
  };
  struct Used {
    Key key;
    std::weak_ptr<const model::PlanningView> view;  // which goes when nobody else has it
    bool nothing_scanned = false;                   // so that all such views are alike
    std::shared_ptr<const Use> use;
    int64_t bytes = 0;  // of use->site
  };

  // A use that is being made.
  struct Making {
    const Key& key;
    const SitePriorQuestion& question;
    const std::shared_ptr<const model::PlanningView>& view;
    const Asker& asker;
    const uint64_t forgotten;
    const parallel::Cancellation& cancelled;
    absl::Status lasting;  // why none can be had the next time either
  };
  absl::StatusOr<Used> Make(Making& making);
  absl::StatusOr<std::shared_ptr<const Loaded>> Load(Making& making);
  // `beside`: what it holds already besides the session's model, bytes.
  absl::StatusOr<MemoryAccount::Reservation> Take(Making& making, int64_t bytes,
                                                  int64_t beside) const;

  const TenantMemory memory_;
  const std::function<int64_t()> beside_;
  mutable std::mutex mutex_;
  std::condition_variable ended_;                   // what was being made
  bool making_ ABSL_GUARDED_BY(mutex_) = false;     // somebody is
  uint64_t forgotten_ ABSL_GUARDED_BY(mutex_) = 0;  // how often
  std::shared_ptr<const Loaded> loaded_ ABSL_GUARDED_BY(mutex_);
  std::optional<Used> used_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_SITE_PRIOR_USE_H_

// A prior of the site and how it stands: what of it may be expected, by what was scanned so far
// (algorithm.md section 13). It is never measured surface, and nothing is registered to it.
#ifndef VANTAGE_CORE_SITE_PRIOR_SITE_PRIOR_H_
#define VANTAGE_CORE_SITE_PRIOR_SITE_PRIOR_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/site_prior/alignment.h"
#include "core/site_prior/prior_mesh.h"
#include "core/site_prior/prior_pose.h"

namespace vantage::site_prior {

inline constexpr double kDefaultAccuracy = 0.1;  // m
// What is farther off is no map: work grows with its third power.
inline constexpr double kMostAccuracy = 0.3;  // m

// Never changes. Thread safe.
class SitePrior {
 public:
  // `placement`: by a person. `accuracy`: m that its surface is off where it is right, in (0,
  // kMostAccuracy]. INVALID_ARGUMENT and RESOURCE_EXHAUSTED: CheckPrior() and SpaceOf(). CANCELLED
  // when that was requested on the way.
  static absl::StatusOr<std::shared_ptr<const SitePrior>> Create(
      PriorMesh mesh, const PriorPose& placement, double accuracy = kDefaultAccuracy,
      const parallel::Cancellation& cancelled = {});

  // With the stated scale, so that lengths in its frame are those of the site but for what the
  // scans find.
  const PriorMesh& mesh() const { return mesh_; }
  // SpaceOf() it in its own frame, in voxels of its own.
  const model::PlanningView& space() const { return space_; }
  // Of mesh(), whose scale is that of the placement already.
  const PriorPose& placement() const { return placement_; }
  // The scale that the placement stated.
  double stated_scale() const { return stated_scale_; }
  double accuracy() const { return accuracy_; }
  // What it holds, bytes.
  uint64_t Bytes() const;

 private:
  SitePrior(PriorMesh mesh, model::PlanningView space, const PriorPose& placement,
            double stated_scale, double accuracy)
      : mesh_(std::move(mesh)),
        space_(std::move(space)),
        placement_(placement),
        stated_scale_(stated_scale),
        accuracy_(accuracy) {}

  const PriorMesh mesh_;
  const model::PlanningView space_;
  const PriorPose placement_;
  const double stated_scale_;
  const double accuracy_;
};

enum class PriorState {
  kPlaced,         // nothing was scanned: it is expected where it was placed
  kNotEnoughSeen,  // it is not used yet
  kAligned,        // it is expected where it was aligned, but for what is refuted
  kNotAligned,     // not used
  kRefuted,        // aligned, but too much of it is not there: not used
  kUnusable,       // it cannot be had in the model's voxels: not used
};

struct PriorStanding {
  PriorState state = PriorState::kPlaced;
  // Its pose is the placement where nothing was scanned, and of the mesh as it was given: with the
  // stated scale.
  Alignment alignment;
  double agreeing_area = 0;  // m2, as of Refutation
  double gone_area = 0;
  double new_area = 0;
  double refuted_share = 0;
  std::string message;  // for people
  // What may be expected; nothing where the prior is not used.
  std::optional<model::PlanningView> space;

  bool used() const { return space.has_value(); }
};

// What Create() and CheckUsable() take at most while they are at work, bytes. `mesh`: as Create()
// gets it; `voxel`: the model's, m.
uint64_t EstimateMemory(const PriorMesh& mesh, const PriorPose& placement, double voxel);
// The same of Judge().
uint64_t EstimateJudgeMemory(const model::PlanningView& model, const SitePrior& prior);

// Whether SpaceOf() it can be had in voxels of `voxel` (m) at its placement, also when scans find
// it larger. INVALID_ARGUMENT and RESOURCE_EXHAUSTED as SpaceOf(). CANCELLED when that was
// requested on the way.
absl::Status CheckUsable(const SitePrior& prior, double voxel,
                         const parallel::Cancellation& cancelled = {});

// A function of both alone. `model`: may be empty. What SpaceOf() refuses is a verdict. CANCELLED
// when that was requested on the way.
absl::StatusOr<PriorStanding> Judge(const model::PlanningView& model, const SitePrior& prior,
                                    const parallel::Cancellation& cancelled = {});

}  // namespace vantage::site_prior

#endif  // VANTAGE_CORE_SITE_PRIOR_SITE_PRIOR_H_

#include "core/site_prior/site_prior.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/site_prior/prior_space.h"
#include "core/site_prior/refutation.h"
#include "core/site_prior/walls.h"

namespace vantage::site_prior {

namespace {

constexpr double kOwnVoxel = 0.05;  // m: of the prior in its own frame

// What cannot be had is not had the next time either.
absl::StatusOr<PriorStanding> Unusable(const absl::Status& why, PriorStanding standing) {
  if (absl::IsCancelled(why)) return why;
  standing.state = PriorState::kUnusable;
  standing.message = absl::StrCat("the prior is not used: ", why.message());
  return standing;
}

}  // namespace

absl::StatusOr<std::shared_ptr<const SitePrior>> SitePrior::Create(
    PriorMesh mesh, const PriorPose& placement, double accuracy,
    const parallel::Cancellation& cancelled) {
  if (absl::Status fine = CheckPrior(mesh); !fine.ok()) return fine;
  if (!(accuracy > 0 && accuracy <= kMostAccuracy)) {
    return absl::InvalidArgumentError(absl::StrCat("accuracy_m: in (0, ", kMostAccuracy, "]"));
  }
  PriorPose placed = placement;
  placed.scale = 1;
  for (Eigen::Vector3f& vertex : mesh.vertices) vertex *= static_cast<float>(placement.scale);
  if (absl::Status fine = CheckPrior(mesh); !fine.ok()) return fine;
  auto space = SpaceOf(mesh, {}, kOwnVoxel, cancelled);
  if (!space.ok()) return space.status();
  return std::shared_ptr<const SitePrior>(
      new SitePrior(std::move(mesh), *std::move(space), placed, placement.scale, accuracy));
}

uint64_t SitePrior::Bytes() const {
  return mesh_.vertices.size() * sizeof(mesh_.vertices[0]) +
         mesh_.triangles.size() * sizeof(mesh_.triangles[0]) + BytesOf(space_);
}

uint64_t EstimateMemory(const PriorMesh& mesh, const PriorPose& placement, double voxel) {
  const uint64_t own = EstimateSpaceMemory(mesh, placement.scale, kOwnVoxel);
  // Its own space stays while the model's is made.
  return own + EstimateSpaceMemory(mesh, placement.scale * (1 + kSearchScale), voxel);
}

uint64_t EstimateJudgeMemory(const model::PlanningView& model, const SitePrior& prior) {
  constexpr double kAround = 2 * (kSearchRadius + 1);
  const uint64_t space = EstimateSpaceMemory(prior.mesh(), 1 + kSearchScale, model.voxel_size());
  if (model.stations().empty()) return space;
  const Eigen::Vector3d size =
      (model.bounds().max - model.bounds().min).cast<double>() * model.voxel_size();
  // What is refuted is left out of another.
  return 2 * space + WallField::Estimate(size + Eigen::Vector3d::Constant(kAround));
}

absl::Status CheckUsable(const SitePrior& prior, double voxel,
                         const parallel::Cancellation& cancelled) {
  PriorPose pose = prior.placement();
  pose.scale *= 1 + kSearchScale;
  return SpaceOf(prior.mesh(), pose, voxel, cancelled).status();
}

namespace {

// In the prior's own frame, with the stated scale.
absl::StatusOr<PriorStanding> JudgeScaled(const model::PlanningView& model, const SitePrior& prior,
                                          const parallel::Cancellation& cancelled) {
  PriorStanding standing;
  standing.alignment.pose = prior.placement();
  if (model.stations().empty()) {
    auto space = SpaceOf(prior.mesh(), prior.placement(), model.voxel_size(), cancelled);
    if (!space.ok()) return Unusable(space.status(), std::move(standing));
    standing.space.emplace(*std::move(space));
    standing.message = "nothing was scanned yet: the prior is taken to lie where it was placed";
    return standing;
  }
  auto alignment = Align(model, prior.space(), prior.placement(), prior.accuracy(), cancelled);
  if (!alignment.ok()) return alignment.status();
  standing.alignment = *std::move(alignment);
  standing.message = standing.alignment.message;
  if (standing.alignment.verdict != AlignmentVerdict::kAligned) {
    standing.state = standing.alignment.verdict == AlignmentVerdict::kNotAligned
                         ? PriorState::kNotAligned
                         : PriorState::kNotEnoughSeen;
    return standing;
  }
  auto space = SpaceOf(prior.mesh(), standing.alignment.pose, model.voxel_size(), cancelled);
  if (!space.ok()) return Unusable(space.status(), std::move(standing));
  auto refutation = Refute(model, *space, prior.accuracy(), cancelled);
  if (!refutation.ok()) return refutation.status();
  size_t in_walls = 0;
  for (const model::Station& station : model.stations()) {
    in_walls += space->Empty(space->At(station.position)) ? 0 : 1;
  }
  standing.agreeing_area = refutation->agreeing_area;
  standing.gone_area = refutation->gone_area;
  standing.new_area = refutation->new_area;
  standing.refuted_share = refutation->share();
  if (refutation->share() > kMostRefuted) {
    standing.state = PriorState::kRefuted;
    standing.message = absl::StrFormat(
        "the prior is not used: of %.1f m2 of its walls that were looked at %.0f %% are not there, "
        "more than %.0f %%; give one of the site as it is",
        refutation->agreeing_area + refutation->gone_area, 100 * refutation->share(),
        100 * kMostRefuted);
    return standing;
  }
  standing.state = PriorState::kAligned;
  if (refutation->gone_area + refutation->new_area >= 0.1) {
    absl::StrAppend(&standing.message,
                    absl::StrFormat("; %.1f m2 of its walls are gone and %.1f m2 are new, where it "
                                    "is not used",
                                    refutation->gone_area, refutation->new_area));
  }
  if (in_walls > 0) {
    absl::StrAppend(&standing.message,
                    absl::StrFormat("; %d of %d scans were made where it has no room: compare its "
                                    "two points with the site",
                                    in_walls, model.stations().size()));
  }
  standing.space.emplace(std::move(refutation->left));
  return standing;
}

}  // namespace

absl::StatusOr<PriorStanding> Judge(const model::PlanningView& model, const SitePrior& prior,
                                    const parallel::Cancellation& cancelled) {
  absl::StatusOr<PriorStanding> standing = JudgeScaled(model, prior, cancelled);
  if (standing.ok()) standing->alignment.pose.scale *= prior.stated_scale();
  return standing;
}

}  // namespace vantage::site_prior

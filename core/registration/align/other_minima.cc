#include "core/registration/align/other_minima.h"

#include <algorithm>
#include <cmath>

#include "core/registration/align/align_stages.h"
#include "core/registration/align/space_agreement.h"

namespace vantage::registration {
namespace {

// What a rival has to have (bound/rivals.cc), with a margin for poses that are a voxel or two off
// still: of the best one's score, of what holds the scan there, and of what fits there, in
// contradiction. Twins have 0.7, 0.55 and 0.004; of what is looked at beside them in flats and
// offices hardly any passes.
constexpr double kMayFit = 0.3;
constexpr double kMayFitNear = 0.7;
constexpr double kMayHold = 0.4;
constexpr double kMayContradict = 0.09;
// m, rms over the scan's surface: nearer than this the first stage ends here or there by chance;
// and nearer than that a rival has to fit nearly as well.
constexpr double kBesideMinimum = 0.3;
constexpr double kNearMinimum = 0.6;
// m, of a sample along its normal, that a move from one pose to the other is noticed by, though
// both are two voxels off.
constexpr double kMoveNoticed = 0.25;

class BestMinimum {
 public:
  BestMinimum(const model::PlanningView& model, const VoxelSearch& search,
              std::span<const SurfaceSample> samples, const Eigen::Isometry3d& pose,
              parallel::Parallel& parallel)
      : model_(model),
        search_(search),
        samples_(samples),
        pose_(pose),
        agreements_(CompareSamples(model, search, samples, pose, parallel)) {}

  bool MayHaveRivalAt(const Eigen::Isometry3d& there) const {
    size_t held_here = 0;
    size_t held_there = 0;
    for (size_t i = 0; i < samples_.size(); ++i) {
      const Eigen::Vector3d own = samples_[i].point.cast<double>();
      const Eigen::Vector3d point = there * own;
      const Eigen::Vector3d normal = pose_.linear() * samples_[i].normal.cast<double>();
      if (std::abs(normal.dot(point - pose_ * own)) < kMoveNoticed) continue;
      held_here += agreements_[i] == SampleAgreement::kFits ? 1 : 0;
      held_there +=
          search_.FindsAny(point, there.linear() * samples_[i].normal.cast<double>(), kWidestReach)
              ? 1
              : 0;
    }
    if (static_cast<double>(held_there) < kMayHold * static_cast<double>(held_here)) return false;
    parallel::Serial serial;
    const std::vector<SampleAgreement> agreements =
        CompareSamples(model_, search_, samples_, there, serial);
    double fits = 0;
    double against = 0;
    for (size_t i = 0; i < samples_.size(); ++i) {
      const bool fits_here = agreements_[i] == SampleAgreement::kFits;
      fits += fits_here ? 1 : 0;
      if (fits_here && agreements[i] == SampleAgreement::kContradicts) against += 1;
      if (agreements[i] == SampleAgreement::kFits &&
          agreements_[i] == SampleAgreement::kContradicts) {
        against -= 1;
      }
    }
    return against < kMayContradict * fits;
  }

 private:
  const model::PlanningView& model_;
  const VoxelSearch& search_;
  std::span<const SurfaceSample> samples_;
  Eigen::Isometry3d pose_;
  std::vector<SampleAgreement> agreements_;
};

}  // namespace

OtherMinima FindOtherMinima(const model::PlanningView& model, const VoxelSearch& search,
                            std::span<const SurfaceSample> samples,
                            std::span<const Minimum> refined, std::span<const Minimum> others,
                            double best_score, size_t most, parallel::Parallel& parallel) {
  OtherMinima found;
  if (refined.empty()) return found;
  const Eigen::Isometry3d& best = refined.front().T_world_scan;
  const std::span<const SurfaceSample> few =
      samples.first(std::min<size_t>(samples.size(), 100));  // tell distances to a tenth
  const auto beside = [&](const Minimum& a, const Minimum& b) {
    return SurfaceDistance(a.T_world_scan, b.T_world_scan, few) < kBesideMinimum;
  };
  std::vector<const Minimum*> asked;
  for (const Minimum& other : others) {
    if (other.score < kMayFit * best_score) break;
    if (other.score < kMayFitNear * best_score &&
        SurfaceDistance(other.T_world_scan, best, few) < kNearMinimum) {
      continue;
    }
    const bool known = std::any_of(refined.begin(), refined.end(),
                                   [&](const Minimum& one) { return beside(one, other); });
    if (!known) asked.push_back(&other);
  }
  if (asked.empty()) return found;
  const BestMinimum compared(model, search, samples, best, parallel);
  std::vector<char> may(asked.size());
  parallel.For(asked.size(),
               [&](size_t i) { may[i] = compared.MayHaveRivalAt(asked[i]->T_world_scan) ? 1 : 0; });
  for (size_t i = 0; i < asked.size(); ++i) {
    if (may[i] == 0) continue;
    const auto known = [&](const std::vector<Minimum>& kept) {
      return std::any_of(kept.begin(), kept.end(),
                         [&](const Minimum& one) { return beside(one, *asked[i]); });
    };
    if (known(found.worth) || known(found.left_out)) continue;
    (found.worth.size() < most ? found.worth : found.left_out).push_back(*asked[i]);
  }
  return found;
}

}  // namespace vantage::registration

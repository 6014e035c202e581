#include "core/registration/bound/rivals.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/registration/align/align_stages.h"
#include "core/registration/align/pose_step.h"
#include "core/registration/align/voxel_search.h"

namespace vantage::registration {
namespace {

// Samples that tell how far poses are apart, to 4 %.
constexpr size_t kDistanceSamples = 500;
// A rival minimum this near to the best one (m, rms over the scan's surface) makes the scan
// doubtful when it explains this share of what the best one explains. By chance two scores, of 4000
// samples each, differ by 1 %; the rest allows for what the scan sees differently from either
// place, and is a choice. So near, a sample does not get into space that is known to be empty for
// two voxels all around it, and nothing would seem to speak against a pose.
constexpr double kNearRival = 0.6;
constexpr double kRivalShare = 0.85;
// One farther off does so by explaining much less, where what holds the scan holds it there, too,
// and nothing speaks against it: where a site repeats itself and the model ends, the right pose
// explains less than one that lies a bay nearer to what was scanned, and unknown space refutes
// nothing. Of the samples that notice the move and hold the scan where it fits best, twins hold 55
// % and more; a scan that slides into the unknown along floor and a wall, 0 to 30 %, which happens
// in doorways.
constexpr double kLeastHeld = 0.5;
// What speaks against a pose are the samples that fit at the best one and not here, where space is
// known, less those that do the reverse: people who walked by fit nowhere. Of those that fit at the
// best one, these shares contradict, or are missed or contradict: at twins at most 0.4 % and 5 %;
// at other poses that hold the scan so, 8 % and 10 % and more (corridors with pillars, parking
// decks, flats and offices, steps of half a degree; verdict_bench). What is not deeper than two
// voxels, such as a shallow pilaster, is missed and never contradicts. Between them, a choice on
// the side of doubt: what moved by just a bay between the scans speaks for the wrong pose.
constexpr double kContradictsRival = 0.03;
constexpr double kRefutesRival = 0.10;

// m, rms: two refinements by all samples that end in one minimum end nearer than this.
constexpr double kEndsThere = 0.01;

// What the samples say of a pose beside the best one.
class RivalEvidence {
 public:
  RivalEvidence(std::span<const SurfaceSample> samples, const Eigen::Isometry3d& best,
                std::span<const SampleAgreement> at_best, const Eigen::Isometry3d& rival,
                std::span<const SampleAgreement> at_rival) {
    for (size_t i = 0; i < samples.size(); ++i) {
      const bool fits_best = at_best[i] == SampleAgreement::kFits;
      const bool fits_rival = at_rival[i] == SampleAgreement::kFits;
      fit_ += fits_best ? 1 : 0;
      if (fits_best) Count(at_rival[i], 1);
      if (fits_rival) Count(at_best[i], -1);
      const Eigen::Vector3d point = samples[i].point.cast<double>();
      const Eigen::Vector3d move = rival * point - best * point;
      const Eigen::Vector3d normal = best.linear() * samples[i].normal.cast<double>();
      if (std::abs(normal.dot(move)) < kApart) continue;
      held_best_ += fits_best ? 1 : 0;
      held_rival_ += fits_rival ? 1 : 0;
    }
  }

  // What holds a scan against the move from one to the other holds it at the rival, too: not floor
  // and a wall alone, along which it slides into space that nobody knows.
  bool Holds() const { return held_rival_ >= kLeastHeld * held_best_; }
  bool Refuted() const {
    return contradicts_ >= kContradictsRival * fit_ || against_ >= kRefutesRival * fit_;
  }

 private:
  void Count(SampleAgreement there, double sign) {
    if (there == SampleAgreement::kContradicts) contradicts_ += sign;
    if (there == SampleAgreement::kContradicts || there == SampleAgreement::kMissed) {
      against_ += sign;
    }
  }

  double fit_ = 0;  // samples, at the best pose
  // Samples: that fit at the best pose, and contradict, or contradict or are missed, at the rival,
  // less those that do the reverse.
  double contradicts_ = 0;
  double against_ = 0;
  // That fit, among those that notice the move.
  double held_best_ = 0;
  double held_rival_ = 0;
};

}  // namespace

RivalPose RivalOf(const Eigen::Isometry3d& pose, double fit_share, const Eigen::Isometry3d& best,
                  std::span<const SurfaceSample> samples) {
  RivalPose rival{pose, fit_share, (pose.translation() - best.translation()).norm(), 0};
  rival.farthest = rival.distance;
  for (const SurfaceSample& s : samples) {
    const Eigen::Vector3d point = s.point.cast<double>();
    rival.farthest = std::max(rival.farthest, (pose * point - best * point).norm());
  }
  return rival;
}

void LeaveOutWhatEndsAtTheBest(const model::PlanningView& model, const ScanSurface& surface,
                               const RegistrationConfig& config, parallel::Parallel& parallel,
                               Alignment& alignment) {
  const std::span<const SurfaceSample> few(surface.samples.data(),
                                           std::min(kDistanceSamples, surface.samples.size()));
  const Eigen::Isometry3d& best = alignment.T_world_scan;
  std::erase_if(alignment.rivals, [&](const Minimum& rival) {
    if (rival.score <= kRivalShare * alignment.score ||
        SurfaceDistance(rival.T_world_scan, best, few) >= kNearRival) {
      return false;
    }
    Alignment there;
    there.T_world_scan = rival.T_world_scan;
    sensor::PosePrior free;
    free.T_world_scan = rival.T_world_scan;
    there = Refine(model, surface, std::move(there), PriorTerm(free, {}), config, parallel);
    return SurfaceDistance(there.T_world_scan, best, few) < kEndsThere;
  });
}

std::vector<RivalPose> OpenRivals(const model::PlanningView& model, const ScanSurface& surface,
                                  const Alignment& alignment, const SamplesAtBest& at_best,
                                  parallel::Parallel& parallel) {
  // Where nothing speaks for the best pose, others are compared with nothing.
  if (!(alignment.score > 0)) return {};
  const Eigen::Isometry3d& best = alignment.T_world_scan;
  const std::span<const SurfaceSample> few(surface.samples.data(),
                                           std::min(kDistanceSamples, surface.samples.size()));
  const auto open = [&](const Minimum& rival) {
    const double explained = rival.score / alignment.score;
    if (SurfaceDistance(rival.T_world_scan, best, few) < kNearRival) return explained > kRivalShare;
    if (explained < kLeastRivalShare) return false;
    const VoxelSearch there(model, BoxOf(surface, rival.T_world_scan));
    const RivalEvidence evidence(
        at_best.samples, best, at_best.agreements, rival.T_world_scan,
        CompareSamples(model, there, at_best.samples, rival.T_world_scan, parallel));
    return evidence.Holds() && !evidence.Refuted();
  };
  std::vector<RivalPose> rivals;
  for (const Minimum& rival : alignment.rivals) {
    if (!open(rival)) continue;
    rivals.push_back(RivalOf(rival.T_world_scan, rival.score / alignment.score, best, few));
  }
  return rivals;
}

}  // namespace vantage::registration

#include "core/registration/pose_comparison.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "core/registration/align/align.h"
#include "core/registration/align/scan_surface.h"
#include "core/registration/align/space_agreement.h"
#include "core/registration/align/voxel_search.h"
#include "core/registration/align/without_reflections.h"
#include "core/registration/bound/qualify.h"
#include "core/registration/mirrors_told.h"
#include "core/registration/registration_input.h"
#include "core/sensor/scanner_model.h"

namespace vantage::registration {
namespace {

constexpr size_t kMostDisagreements = 6;

sensor::PosePrior PriorAt(const Eigen::Isometry3d& T_world_scan) {
  sensor::PosePrior prior;
  prior.T_world_scan = T_world_scan;
  return prior;
}

// The scan's samples, and the surface that each stands for.
struct SampledScan {
  std::span<const SurfaceSample> samples;
  std::vector<double> areas;  // m2
  double spacing = 0;         // m, about: between neighbours
};

// Which samples are alike: they lie in the same cube and face the same way (both in the scanner's
// frame).
using Stratum = std::array<int, 4>;
Stratum StratumOf(const SurfaceSample& s) {
  constexpr float kEdge = 1;  // m: as large as what is told apart, with dozens of samples
  const Eigen::Vector3i cube = (s.point / kEdge).array().floor().cast<int>();
  int axis = 0;
  s.normal.cwiseAbs().maxCoeff(&axis);
  return {cube.x(), cube.y(), cube.z(), 2 * axis + (s.normal[axis] < 0 ? 1 : 0)};
}

SampledScan Sampled(const sensor::RangeImage& image, const ScanSurface& surface, size_t most) {
  SampledScan sampled;
  sampled.samples = {surface.samples.data(), std::min(most, surface.samples.size())};
  const auto step = [](const std::vector<double>& axis) {
    return axis.size() < 2 ? 0.0
                           : (axis.back() - axis.front()) / static_cast<double>(axis.size() - 1);
  };
  const double cell = step(image.azimuth) * step(image.elevation);  // sr, at the horizon
  const auto area_of = [&](const SurfaceSample& s) {
    const Eigen::Vector3d point = s.point.cast<double>();
    const double range = point.norm();
    const double level = point.head<2>().norm() / range;  // cosine of the elevation
    constexpr double kFlattest = 0.1;  // cosine of the incidence; none is used that is flatter
    const double cosine = std::max(kFlattest, -s.normal.cast<double>().dot(point) / range);
    return s.cells * cell * level * range * range / cosine;
  };
  // Which samples come first is balanced over the ways that surface faces (SpreadSamples()), so
  // that each stands for those that are alike.
  struct Areas {
    double of_all = 0;
    double of_some = 0;
  };
  std::map<Stratum, Areas> strata;
  for (size_t i = 0; i < surface.samples.size(); ++i) {
    const double area = area_of(surface.samples[i]);
    Areas& areas = strata[StratumOf(surface.samples[i])];
    areas.of_all += area;
    if (i < sampled.samples.size()) areas.of_some += area;
  }
  double total = 0;
  for (const SurfaceSample& s : sampled.samples) {
    const Areas& areas = strata.at(StratumOf(s));
    sampled.areas.push_back(area_of(s) * areas.of_all / areas.of_some);
    total += sampled.areas.back();
  }
  if (!sampled.samples.empty()) {
    sampled.spacing = std::sqrt(total / static_cast<double>(sampled.samples.size()));
  }
  return sampled;
}

ComparedPose CompareAt(const model::PlanningView& model, const sensor::Scan& scan,
                       const ScanSurface& surface, const SampledScan& sampled,
                       const KnownSurface& known, const Eigen::Isometry3d& T_world_scan,
                       const RegistrationConfig& config, parallel::Parallel& parallel) {
  ComparedPose pose;
  pose.T_world_scan = T_world_scan;
  Alignment here;
  here.T_world_scan = T_world_scan;
  here.converged = true;
  const RegistrationResult result =
      Qualify(model, surface, here, PriorAt(T_world_scan), config, parallel).result;
  pose.overlap_share = result.verdict.overlap_share;
  pose.rms_residual = result.rms_residual;

  const VoxelSearch search(model, BoxOf(surface, T_world_scan));
  const std::vector<SampleAgreement> agreements =
      CompareSamples(model, search, sampled.samples, T_world_scan, parallel);
  const size_t count = sampled.samples.size();
  pose.states.resize(count);
  pose.residuals.assign(count, 0.0f);
  std::vector<Eigen::Vector3f> through(count, Eigen::Vector3f::Zero());
  const auto tell = [&](size_t i) {
    const SurfaceSample& s = sampled.samples[i];
    const Eigen::Vector3d point = T_world_scan * s.point.cast<double>();
    switch (agreements[i]) {
      case SampleAgreement::kNothingKnown:
        return SampleState::kNothingKnown;
      case SampleAgreement::kMissed:
        return SampleState::kFitsNothing;
      case SampleAgreement::kFits: {
        const Match match = search.Find(point, T_world_scan.linear() * s.normal.cast<double>());
        pose.residuals[i] =
            static_cast<float>((point - match.voxel->centroid.cast<double>()).dot(match.normal));
        return SampleState::kFits;
      }
      case SampleAgreement::kContradicts:
        break;
    }
    const auto passed = SurfacePassed(model, T_world_scan.translation(), point);
    if (!passed.has_value()) return SampleState::kInEmptySpace;
    through[i] = *passed;
    return SampleState::kBehindSurface;
  };
  constexpr size_t kChunk = 1024;
  parallel.For((count + kChunk - 1) / kChunk, [&](size_t chunk) {
    const size_t end = std::min(count, (chunk + 1) * kChunk);
    for (size_t i = chunk * kChunk; i < end; ++i) pose.states[i] = tell(i);
  });
  pose.sights = SightsOf(model, known.pieces, scan, T_world_scan, parallel);

  double all = 0;
  double fitting = 0;
  double contradicting = 0;
  std::vector<DisagreeingPiece> pieces;
  std::vector<UnknownPiece> unknown;
  for (size_t i = 0; i < count; ++i) {
    const double cells = sampled.samples[i].cells;
    all += cells;
    if (pose.states[i] == SampleState::kFits) fitting += cells;
    if (pose.states[i] == SampleState::kFitsNothing) pose.fits_nothing_share += cells;
    if (pose.states[i] == SampleState::kNothingKnown) {
      pose.nothing_known_share += cells;
      unknown.push_back({T_world_scan * sampled.samples[i].point.cast<double>(), sampled.areas[i]});
    }
    const bool behind = pose.states[i] == SampleState::kBehindSurface;
    if (!behind && pose.states[i] != SampleState::kInEmptySpace) continue;
    contradicting += cells;
    pieces.push_back({behind ? DisagreementKind::kBehindSurface : DisagreementKind::kInEmptySpace,
                      T_world_scan * sampled.samples[i].point.cast<double>(), through[i],
                      sampled.areas[i]});
  }
  if (all > 0) {
    pose.fits_nothing_share /= all;
    pose.nothing_known_share /= all;
  }
  if (fitting + contradicting > 0) {
    pose.contradiction_share = contradicting / (fitting + contradicting);
  }
  for (size_t i = 0; i < known.pieces.size(); ++i) {
    const SurfacePiece& piece = known.pieces[i];
    if (pose.sights[i] == SurfaceSight::kOutOfSight) continue;
    pose.surface_in_sight += piece.area;
    if (pose.sights[i] != SurfaceSight::kSeenThrough) continue;
    pose.surface_seen_through += piece.area;
    pieces.push_back(
        {DisagreementKind::kSeenThrough, piece.centroid.cast<double>(), piece.normal, piece.area});
  }
  // Neighbours in a plane are a spacing apart; twice that bridges one that is missing.
  constexpr double kBridge = 2;
  pose.disagreements = GroupDisagreements(
      pieces, unknown, kBridge * std::max(sampled.spacing, known.spacing), kMostDisagreements);
  return pose;
}

PoseComparison CompareAll(const model::PlanningView& model, const sensor::Scan& scan,
                          std::span<const Eigen::Isometry3d> poses,
                          const RegistrationConfig& config, const ComparisonSize& size,
                          parallel::Parallel& parallel) {
  const ScanSurface surface = SampleSurface(scan, config.sample_spacing, parallel);
  const SampledScan sampled = Sampled(scan.image, surface, size.samples);
  PoseComparison comparison;
  comparison.reach = kFineReach * model.voxel_size();
  for (const SurfaceSample& s : sampled.samples) {
    comparison.points.push_back(s.point);
    comparison.normals.push_back(s.normal);
  }
  // Poses may lie far outside of what is known.
  const double h = model.voxel_size();
  const Eigen::AlignedBox3d known(model.bounds().min.cast<double>() * h,
                                  model.bounds().max.cast<double>() * h);
  Eigen::AlignedBox3d box;
  for (const Eigen::Isometry3d& pose : poses) {
    const Eigen::AlignedBox3d here = BoxOf(surface, pose).intersection(known);
    if (!here.isEmpty()) box.extend(here);
  }
  if (!box.isEmpty()) comparison.surface = SurfaceIn(model, box, size.surface);
  for (const Eigen::Isometry3d& pose : poses) {
    comparison.poses.push_back(
        CompareAt(model, scan, surface, sampled, comparison.surface, pose, config, parallel));
  }
  return comparison;
}

}  // namespace

absl::StatusOr<PoseComparison> ComparePoses(const model::PlanningView& model,
                                            const sensor::Scan& scan,
                                            std::span<const Eigen::Isometry3d> poses,
                                            const RegistrationConfig& config,
                                            const ComparisonSize& size,
                                            parallel::Parallel& parallel) {
  for (const Eigen::Isometry3d& pose : poses) {
    const absl::Status valid = ValidateRegistration(model, scan, PriorAt(pose), config);
    if (!valid.ok()) return valid;
  }
  PoseComparison comparison = CompareAll(model, scan, poses, config, size, parallel);
  if (comparison.poses.front().contradiction_share <= kLittleContradiction) return comparison;
  const std::optional<sensor::Scan> direct = WithoutReflections(scan, parallel);
  return direct ? CompareAll(model, *direct, poses, config, size, parallel) : comparison;
}

}  // namespace vantage::registration

#include "core/registration/align/align.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "absl/functional/function_ref.h"
#include "absl/strings/str_format.h"
#include "core/registration/align/align_stages.h"
#include "core/registration/align/correspondence_field.h"
#include "core/registration/align/narrow_fit.h"
#include "core/registration/align/other_minima.h"
#include "core/registration/align/prior_search.h"
#include "core/registration/align/space_agreement.h"
#include "core/registration/align/voxel_search.h"
#include "core/sensor/scanner_model.h"

namespace vantage::registration {
namespace {

// Numbers of samples, each a twentieth of a metre from the next whatever the scanner, so that they
// need not grow with its resolution. A share that is counted on n of them is off by half of
// 1 / sqrt(n) at most, one sigma; the cost grows with n.
constexpr size_t kCoarseSamples = 700;   // for the many starts: 2 %
constexpr size_t kSpaceSamples = 2000;   // for contradictions of a minimum: 1 %
constexpr size_t kScoreSamples = 4000;   // for comparing minima: 0.8 %, of 15 % that make a doubt
constexpr size_t kFineSamples = 24'000;  // for the last stage: a noise of 1 cm leaves 0.1 mm
constexpr size_t kApartSamples = 500;    // for telling minima apart, to 4 % of their distance
constexpr int kFineMinima = 5;           // that are refined and compared; each costs as much again
// m, rms over the scan's surface: starts that are so near each other, half way, end together.
constexpr double kMet = 0.02;
// Beside these, of those that may be rivals: where a site repeats itself within a prior's reach.
constexpr size_t kOtherMinima = 24;
// Steps at most; both end earlier once a step is too small to matter (AlignFine). A minimum is
// compared by its score, which its last digits do not change. The result is to have converged, also
// where a weak direction takes many steps; it says whether it has.
constexpr int kCompareSteps = 12;
constexpr int kFineSteps = 100;

std::span<const SurfaceSample> First(const ScanSurface& surface, size_t count) {
  return {surface.samples.data(), std::min(count, surface.samples.size())};
}

void SortAndKeepDistinct(std::span<const SurfaceSample> samples, double apart,
                         std::vector<Minimum>& minima) {
  std::stable_sort(minima.begin(), minima.end(),
                   [](const Minimum& a, const Minimum& b) { return a.score > b.score; });
  std::vector<Minimum> distinct;
  for (const Minimum& m : minima) {
    const bool same = std::any_of(distinct.begin(), distinct.end(), [&](const Minimum& other) {
      return SurfaceDistance(m.T_world_scan, other.T_world_scan, samples) < apart;
    });
    if (!same) distinct.push_back(m);
  }
  minima = std::move(distinct);
}

// A pose that known space would make doubtful gives way to the best one that it would not, if there
// is one that fits nearly as well: a scan from the next room that sees little of what is known lies
// on a known room of the same width better than in its own place, but for what then stands in the
// middle of that room.
// Returns the one that gave way.
std::optional<Minimum> PutUndoubtedFirst(std::vector<Minimum>& minima) {
  // By score, in which what contradicts counts already. Where less is left, what was moved is the
  // better explanation.
  constexpr double kNearlyAsWell = 0.5;
  if (minima.empty() || minima.front().contradiction_share <= kContradictionDoubtful) return {};
  const auto other = std::find_if(minima.begin(), minima.end(), [&](const Minimum& m) {
    return m.contradiction_share <= kContradictionDoubtful && m.score > 0 &&
           m.score >= kNearlyAsWell * minima.front().score;
  });
  if (other == minima.end()) return {};
  std::rotate(minima.begin(), other, other + 1);
  return minima[1];
}

// The results of `add(sample, result)` over runs of samples, in order. The runs do not depend on
// the number of threads.
template <typename Result, typename Add>
std::vector<Result> InChunks(std::span<const SurfaceSample> samples, parallel::Parallel& parallel,
                             const Add& add) {
  constexpr size_t kChunk = 1024;
  std::vector<Result> results((samples.size() + kChunk - 1) / kChunk);
  parallel.For(results.size(), [&](size_t chunk) {
    const size_t from = chunk * kChunk;
    for (const SurfaceSample& s : samples.subspan(from, std::min(kChunk, samples.size() - from))) {
      add(s, results[chunk]);
    }
  });
  return results;
}

// Whether all of the model lies within `radius` (m) of a place, across the floor.
bool IsWithin(const model::PlanningView& model, const Eigen::Vector3d& place, double radius) {
  const Eigen::Vector3d low = model.bounds().min.cast<double>() * model.voxel_size();
  const Eigen::Vector3d high = model.bounds().max.cast<double>() * model.voxel_size();
  const Eigen::Vector3d far = (low - place).cwiseAbs().cwiseMax((high - place).cwiseAbs());
  return far.head<2>().norm() <= radius;
}

std::vector<Correspondence> CorrespondencesOf(const VoxelSearch& search,
                                              std::span<const SurfaceSample> samples,
                                              double roughness, const Eigen::Isometry3d& pose,
                                              const RegistrationConfig& config,
                                              parallel::Parallel& parallel) {
  const auto found = InChunks<std::vector<Correspondence>>(
      samples, parallel, [&](const SurfaceSample& s, std::vector<Correspondence>& of) {
        const Eigen::Vector3d point = pose * s.point.cast<double>();
        const Eigen::Vector3d normal = pose.linear() * s.normal.cast<double>();
        const Match match = search.Find(point, normal);
        if (match.voxel == nullptr) return;
        const Eigen::Vector3d gap = point - match.voxel->centroid.cast<double>();
        Correspondence c;
        c.point = point;
        c.normal = match.normal;
        c.residual = gap.dot(match.normal);
        c.variance =
            ResidualVariance(s, *match.voxel, gap, c.residual, roughness, config.normal_sigma);
        c.normal_angle =
            std::acos(std::clamp(normal.dot(match.voxel->normal.cast<double>()), -1.0, 1.0));
        c.cells = s.cells;
        of.push_back(c);
      });
  std::vector<Correspondence> all;
  for (const std::vector<Correspondence>& chunk : found) {
    all.insert(all.end(), chunk.begin(), chunk.end());
  }
  return all;
}

// What the starts end in, with scores. Most starts lie beside others that lead to the same minimum:
// those that have met when the radius is half of what it was at first go on as one, in the order of
// the starts.
std::vector<Minimum> FirstStage(const CorrespondenceField& field, const VoxelSearch& search,
                                std::span<const SurfaceSample> samples,
                                std::span<const SurfaceSample> few,
                                std::span<const Eigen::Isometry3d> starts, double reach,
                                double voxel,
                                absl::FunctionRef<PriorTerm(const Eigen::Isometry3d&)> term_of,
                                parallel::Parallel& parallel) {
  struct Way {
    Eigen::Isometry3d pose;
    PriorTerm term;
    double radius = 0;  // m, that is next; 0: it has ended
  };
  std::vector<Way> ways;
  ways.reserve(starts.size());
  for (const Eigen::Isometry3d& start : starts) ways.push_back({start, term_of(start), reach});
  parallel.For(ways.size(), [&](size_t i) {
    ways[i].radius = NarrowCoarse(field, samples, ways[i].term, reach, 0.5 * reach, ways[i].pose);
  });
  std::vector<size_t> going;
  for (size_t i = 0; i < ways.size(); ++i) {
    const bool met = std::any_of(going.begin(), going.end(), [&](size_t other) {
      return SurfaceDistance(ways[i].pose, ways[other].pose, few) < kMet;
    });
    if (!met) going.push_back(i);
  }
  std::vector<Minimum> minima(going.size());
  parallel.For(going.size(), [&](size_t k) {
    Way& way = ways[going[k]];
    if (way.radius > 0) {
      NarrowCoarse(field, samples, way.term, way.radius, LastRadius(voxel), way.pose);
    }
    minima[k] = {way.pose, ScorePose(search, samples, way.pose)};
  });
  return minima;
}

// The last stage: all samples, and once more where more of them would lie within the noise a little
// away from where it ended.
FineResult Finish(const VoxelSearch& search, const ScanSurface& surface,
                  const Eigen::Isometry3d& pose, const PriorTerm& prior,
                  const RegistrationConfig& config, parallel::Parallel& parallel, int wide_steps) {
  FineResult fine = AlignFine(search, surface, kFineSamples, pose, prior, config, parallel,
                              kFineSteps, WideScale(search.voxel_size()), wide_steps);
  if (!fine.converged) return fine;
  const NarrowFit narrow =
      FindNarrowFit(CorrespondencesOf(search, First(surface, kScoreSamples), surface.roughness,
                                      fine.pose, config, parallel),
                    fine.scale);
  if (!narrow.better) return fine;
  return AlignFine(search, surface, kFineSamples, MovedPose(fine.pose, narrow.change, narrow.about),
                   prior, config, parallel, kFineSteps, fine.scale);
}

}  // namespace

std::vector<Eigen::Isometry3d> StartsAroundPrior(const sensor::PosePrior& prior) {
  // The first stage corrects half a metre (max_correspondence), and 12 degrees, which move the
  // walls of a room by about as much. A scanner set up by eye is within both.
  double shift = 0.40;                // m
  double turn = sensor::Radians(12);  // rad
  if (prior.covariance.has_value()) {
    shift = std::min(shift, 2 * std::sqrt(prior.covariance->diagonal().tail<3>().maxCoeff()));
    turn = std::min(turn, 2 * std::sqrt((*prior.covariance)(2, 2)));
  }
  std::vector<Eigen::Isometry3d> starts{prior.T_world_scan};
  for (const double heading : {0.0, -1.0, 1.0}) {
    for (const double x : {0.0, -1.0, 1.0}) {
      for (const double y : {0.0, -1.0, 1.0}) {
        if (heading == 0 && x == 0 && y == 0) continue;
        sensor::Vector6d change = sensor::Vector6d::Zero();
        change[2] = heading * turn;
        change[3] = x * shift;
        change[4] = y * shift;
        starts.push_back(MovedPose(prior.T_world_scan, change, prior.T_world_scan.translation()));
      }
    }
  }
  return starts;
}

Alignment Align(const model::PlanningView& model, const ScanSurface& surface,
                const sensor::PosePrior& prior, const RegistrationConfig& config,
                parallel::Parallel& parallel, std::span<const TargetTie> targets) {
  Eigen::AlignedBox3d box = BoxOf(surface, prior.T_world_scan);
  // The starts and the stages after them move a scan by at most this: 0.4 m, and 0.6 m by a turn of
  // 12 degrees three metres off, or as far as the prior may be wrong. Surface that leaves the field
  // finds no match.
  constexpr double kStartsReach = 1.0;  // m
  const PriorReach reach = ReachOf(prior);
  const double margin = std::max(kStartsReach, 0.6 + reach.shift) + config.max_correspondence;
  box.extend(Eigen::Vector3d(box.min() - Eigen::Vector3d::Constant(margin)));
  box.extend(Eigen::Vector3d(box.max() + Eigen::Vector3d::Constant(margin)));
  const CorrespondenceField field(model, box, config.max_correspondence, parallel);
  // For any rotation.
  double radius = margin;
  for (const SurfaceSample& s : surface.samples) {
    radius = std::max(radius, margin + static_cast<double>(s.point.norm()));
  }
  const Eigen::Vector3d at = prior.T_world_scan.translation();
  const VoxelSearch search(
      model, {at - Eigen::Vector3d::Constant(radius), at + Eigen::Vector3d::Constant(radius)});
  std::vector<Eigen::Isometry3d> starts = StartsAroundPrior(prior);
  const PriorSearch around =
      SearchAroundPrior(model, field, surface, config.sample_spacing, prior, parallel);
  starts.insert(starts.end(), around.places.begin(), around.places.end());
  Alignment result = AlignFrom(model, field, search, surface, prior, StartKind::kAroundPrior,
                               starts, config, parallel, targets);
  if (around.more_places) {
    result.open_within = around.radius + (result.T_world_scan.translation() - at).norm();
    result.open_turn = 2 * reach.turn;
  }
  if (!around.whole && !IsWithin(model, at, around.radius)) {
    result.left_out = absl::StrFormat(
        "its prior allows places farther than %.0f m away, which is as far as the "
        "search goes",
        around.radius);
  }
  return result;
}

Alignment AlignFrom(const model::PlanningView& model, const CorrespondenceField& field,
                    const VoxelSearch& search, const ScanSurface& surface,
                    const sensor::PosePrior& prior, StartKind kind,
                    std::span<const Eigen::Isometry3d> starts, const RegistrationConfig& config,
                    parallel::Parallel& parallel, std::span<const TargetTie> targets) {
  const std::span<const SurfaceSample> coarse = First(surface, kCoarseSamples);
  const std::span<const SurfaceSample> few = First(surface, kApartSamples);
  const auto term_of = [&](const Eigen::Isometry3d& start) {
    sensor::PosePrior own = prior;
    if (kind == StartKind::kPlaces) own.T_world_scan = start;
    return PriorTerm(own, targets);
  };
  std::vector<Minimum> minima =
      FirstStage(field, search, coarse, few, starts, config.max_correspondence, model.voxel_size(),
                 term_of, parallel);
  SortAndKeepDistinct(few, 0.5 * kApart, minima);
  const double best_of_first_stage = minima.front().score;
  std::vector<Minimum> others;
  if (minima.size() > kFineMinima) {
    others.assign(minima.begin() + kFineMinima, minima.end());
    minima.resize(kFineMinima);
  }
  const auto compare = [&](Minimum& m) {
    parallel::Serial serial;
    m.T_world_scan =
        AlignFine(search, surface, kScoreSamples, m.T_world_scan, term_of(m.T_world_scan), config,
                  serial, kCompareSteps, WideScale(model.voxel_size()))
            .pose;
    m.score = ScorePose(search, First(surface, kScoreSamples), m.T_world_scan);
    const std::span<const SurfaceSample> in_space = First(surface, kSpaceSamples);
    const SpaceAgreement space =
        AgreementOf(in_space, CompareSamples(model, search, in_space, m.T_world_scan, serial));
    m.score *= space.Left();
    m.contradiction_share = space.ContradictionShare();
  };
  parallel.For(minima.size(), [&](size_t i) { compare(minima[i]); });
  SortAndKeepDistinct(few, kApart, minima);
  OtherMinima other = FindOtherMinima(model, search, coarse, minima, others, best_of_first_stage,
                                      kOtherMinima, parallel);
  if (!other.worth.empty()) {
    parallel.For(other.worth.size(), [&](size_t i) { compare(other.worth[i]); });
    minima.insert(minima.end(), other.worth.begin(), other.worth.end());
    SortAndKeepDistinct(few, kApart, minima);
  }

  Alignment result;
  result.not_compared = std::move(other.left_out);
  result.displaced = PutUndoubtedFirst(minima);
  const Eigen::Isometry3d best = minima.front().T_world_scan;
  const FineResult fine = Finish(search, surface, best, term_of(best), config, parallel, 0);
  result.T_world_scan = fine.pose;
  result.converged = fine.converged;
  result.iterations = fine.iterations;
  result.score = minima.front().score;
  result.rivals.assign(minima.begin() + 1, minima.end());
  return result;
}

Alignment Refine(const model::PlanningView& model, const ScanSurface& surface, Alignment alignment,
                 const PriorTerm& prior, const RegistrationConfig& config,
                 parallel::Parallel& parallel) {
  Eigen::AlignedBox3d box = BoxOf(surface, alignment.T_world_scan);
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(config.max_correspondence);
  box.extend(Eigen::Vector3d(box.min() - margin));
  box.extend(Eigen::Vector3d(box.max() + margin));
  const FineResult fine = Finish(VoxelSearch(model, box), surface, alignment.T_world_scan, prior,
                                 config, parallel, kWideSteps);
  alignment.T_world_scan = fine.pose;
  alignment.converged = fine.converged;
  alignment.iterations = fine.iterations;
  return alignment;
}

std::vector<Correspondence> FindCorrespondences(const VoxelSearch& search,
                                                const ScanSurface& surface,
                                                const Eigen::Isometry3d& pose,
                                                const RegistrationConfig& config,
                                                parallel::Parallel& parallel) {
  return CorrespondencesOf(search, surface.samples, surface.roughness, pose, config, parallel);
}

}  // namespace vantage::registration

#include "core/registration/graph/link.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <span>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_format.h"
#include "core/registration/align/align_stages.h"
#include "core/registration/align/correlation_block.h"
#include "core/registration/align/pose_step.h"
#include "core/registration/bound/error_bound.h"
#include "core/registration/graph/adjust.h"
#include "core/registration/graph/lone_holds.h"

namespace vantage::registration {
namespace {

// Patches of b that are looked for on a's surface: at first, to find the way, and at last.
constexpr size_t kFewPatches = 1200;
constexpr size_t kManyPatches = 6000;
// A link, and each direction that it holds, rests on as many at least: a square metre and a half.
constexpr size_t kFewestPatches = 40;
// m, along a surface: how far a patch's centroid may lie from that of the one it is matched to.
// Patches of one surface have centroids within one side of each other.
constexpr double kAcross = kPatchSide;
// Cosines between normals, 37 and 20 degrees: while poses are off by what they may be, and at last,
// when only noise is left (3 degrees) and what is round.
constexpr double kNearlyAlike = 0.8;
constexpr double kAlike = 0.94;
// Gates, m, of residuals along the normal: they shrink by a factor from the reach to the least, and
// then follow the residuals.
constexpr double kGateFactor = 0.6;
constexpr double kLeastGate = 0.02;
constexpr int kStepsOfGate = 2;
constexpr int kLinkSteps = 12;
// m, that the median residual counts as at least: planes of twenty centimetres average noise out.
constexpr double kLeastMedian = 3e-4;
constexpr double kInlierSigmas = 4;
// m and rad: a last step this small has converged.
constexpr double kSmallShift = 5e-5;
constexpr double kSmallTurn = 1e-5;
// m: by how much a patch has to lie before what the other scan saw through, besides a share of its
// range: half a cell of the depths on a floor at a grazing angle is within it.
constexpr double kInEmptySpace = 0.15;
constexpr double kInEmptyShare = 0.02;
// Shares that contradict: things that were moved explain the one, nothing the other.
constexpr double kContradictsDoubtful = 0.15;
constexpr double kContradictsWrong = 0.40;
// Residuals beyond that many times what noise explains, and beyond m, are no noise.
constexpr double kNoiseTimes = 3;
constexpr double kApartRms = 0.02;
// m: twice the range of any scanner that is known.
constexpr double kFarApart = 2000;
// rad, one sigma, of turns that an overlap leaves open.
constexpr double kOpenTurn = 0.05;

// Patches by the cube that they lie in.
class PatchGrid {
 public:
  PatchGrid(std::span<const SurfaceSample> patches, double cube)
      : patches_(patches), inverse_(static_cast<float>(1 / cube)) {
    std::vector<std::pair<uint64_t, uint32_t>> order(patches.size());
    for (uint32_t i = 0; i < patches.size(); ++i) {
      const Eigen::Array3f at = (patches[i].point.array() * inverse_).floor();
      order[i] = {Key(at.cast<int>()), i};
    }
    std::sort(order.begin(), order.end());
    index_.resize(order.size());
    cubes_.reserve(order.size());
    for (uint32_t k = 0; k < order.size(); ++k) {
      index_[k] = order[k].second;
      ++cubes_.try_emplace(order[k].first, Run{k, k}).first->second.end;
    }
  }

  // The nearest patch within `gate` along its normal and kAcross (or `gate`) along its surface
  // whose normal makes an angle of at most acos(`alike`); null when there is none. Cubes are at
  // least twice as large as either.
  const SurfaceSample* Nearest(const Eigen::Vector3f& point, const Eigen::Vector3f& normal,
                               float gate, float alike) const {
    const Eigen::Array3i first = (point.array() * inverse_ - 0.5F).floor().cast<int>();
    const float across = std::max(gate, static_cast<float>(kAcross));
    const float most = across * across + gate * gate;
    const SurfaceSample* nearest = nullptr;
    float least = most;
    for (int corner = 0; corner < 8; ++corner) {
      const auto it = cubes_.find(
          Key(first + Eigen::Array3i(corner & 1, (corner >> 1) & 1, (corner >> 2) & 1)));
      if (it == cubes_.end()) continue;
      for (uint32_t k = it->second.begin; k < it->second.end; ++k) {
        const SurfaceSample& patch = patches_[index_[k]];
        const Eigen::Vector3f gap = point - patch.point;
        const float squared = gap.squaredNorm();
        if (squared >= least || patch.normal.dot(normal) < alike) continue;
        const float along = gap.dot(patch.normal);
        if (std::abs(along) > gate || squared - along * along > across * across) continue;
        least = squared;
        nearest = &patch;
      }
    }
    return nearest;
  }

 private:
  struct Run {
    uint32_t begin = 0;
    uint32_t end = 0;
  };
  static uint64_t Key(const Eigen::Array3i& cube) {
    const auto part = [](int v) { return static_cast<uint64_t>(v + (1 << 20)) & 0x1fffff; };
    return (part(cube.x()) << 42) | (part(cube.y()) << 21) | part(cube.z());
  }

  std::span<const SurfaceSample> patches_;
  float inverse_;
  std::vector<uint32_t> index_;
  absl::flat_hash_map<uint64_t, Run> cubes_;
};

// A patch of b and the one of a that it lies on, in a's frame.
struct PatchMatch {
  Eigen::Vector3d point;   // m, of b's patch
  Eigen::Vector3d normal;  // unit, mean of both
  double residual = 0;     // m
  double variance = 0;     // m^2
  double angle = 0;        // rad, between the normals
};

std::vector<PatchMatch> MatchPatches(const PatchGrid& grid, std::span<const SurfaceSample> patches,
                                     const Eigen::Isometry3d& T_a_b, double gate, double alike,
                                     double normal_sigma) {
  const Eigen::Matrix3f turn = T_a_b.linear().cast<float>();
  const Eigen::Vector3f shift = T_a_b.translation().cast<float>();
  std::vector<PatchMatch> matches;
  matches.reserve(patches.size());
  for (const SurfaceSample& patch : patches) {
    const Eigen::Vector3f point = turn * patch.point + shift;
    const Eigen::Vector3f normal = turn * patch.normal;
    const SurfaceSample* on =
        grid.Nearest(point, normal, static_cast<float>(gate), static_cast<float>(alike));
    if (on == nullptr) continue;
    PatchMatch match;
    match.point = T_a_b * patch.point.cast<double>();
    const Eigen::Vector3d other = T_a_b.linear() * patch.normal.cast<double>();
    const Eigen::Vector3d own = on->normal.cast<double>();
    match.normal = (own + other).normalized();
    const Eigen::Vector3d gap = match.point - on->point.cast<double>();
    match.residual = gap.dot(match.normal);
    const double across = std::max(0.0, gap.squaredNorm() - match.residual * match.residual);
    match.variance = static_cast<double>(patch.sigma) * patch.sigma +
                     static_cast<double>(on->sigma) * on->sigma +
                     0.5 * normal_sigma * normal_sigma * across;
    match.angle = std::acos(std::clamp(own.dot(other), -1.0, 1.0));
    matches.push_back(match);
  }
  return matches;
}

double MedianOf(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double MedianResidual(const std::vector<PatchMatch>& matches) {
  std::vector<double> magnitudes;
  magnitudes.reserve(matches.size());
  for (const PatchMatch& match : matches) magnitudes.push_back(std::abs(match.residual));
  return std::max(kLeastMedian, MedianOf(std::move(magnitudes)));
}

struct PatchAlignment {
  Eigen::Isometry3d T_a_b = Eigen::Isometry3d::Identity();
  bool converged = false;
  std::vector<PatchMatch> matches;  // where it ended
};

// Aligns b's patches to a's. Directions that nothing holds stay as the start has them.
class PatchAligner {
 public:
  PatchAligner(const LinkSurface& a, const LinkSurface& b, const RegistrationConfig& config)
      : a_(a.samples), b_(b.samples), normal_sigma_(config.normal_sigma) {}

  Eigen::Isometry3d Approach(Eigen::Isometry3d T_a_b, double reach, const PriorTerm& held) const {
    const std::span<const SurfaceSample> few(b_.data(), std::min(kFewPatches, b_.size()));
    for (double gate = reach; gate > kLeastGate; gate *= kGateFactor) {
      const PatchGrid grid(a_, std::max(2 * kAcross, 2 * gate));
      for (int step = 0; step < kStepsOfGate; ++step) {
        const std::vector<PatchMatch> matches =
            MatchPatches(grid, few, T_a_b, gate, kNearlyAlike, normal_sigma_);
        if (matches.size() < kFewestPatches / 2) return T_a_b;
        Step(matches, gate, 1 / (gate * gate), held, T_a_b);
      }
    }
    return T_a_b;
  }

  PatchAlignment Finish(const Eigen::Isometry3d& from, const PriorTerm& held) const {
    const std::span<const SurfaceSample> many(b_.data(), std::min(kManyPatches, b_.size()));
    const PatchGrid grid(a_, 2 * kAcross);
    PatchAlignment alignment;
    alignment.T_a_b = from;
    double gate = 2 * kLeastGate;
    for (int step = 0; step < kLinkSteps; ++step) {
      alignment.matches = MatchPatches(grid, many, alignment.T_a_b, gate, kAlike, normal_sigma_);
      if (alignment.matches.size() < kFewestPatches) return alignment;
      // No wider than the residuals ask for: of the planes that lie side by side within centimetres
      // the wrong ones would pull.
      gate = std::min(gate, kTukeySigmas * kMedianToSigma * MedianResidual(alignment.matches));
      if (alignment.converged) return alignment;
      const sensor::Vector6d change = Step(alignment.matches, gate, 0, held, alignment.T_a_b);
      alignment.converged = step >= 2 && change.tail<3>().norm() < kSmallShift &&
                            change.head<3>().norm() < kSmallTurn;
    }
    return alignment;
  }

 private:
  // One Gauss-Newton step. `weight`: of each match, 1/m^2; 0: by its variance.
  static sensor::Vector6d Step(const std::vector<PatchMatch>& matches, double gate, double weight,
                               const PriorTerm& held, Eigen::Isometry3d& T_a_b) {
    NormalEquations normals;
    const Eigen::Vector3d about = T_a_b.translation();
    for (const PatchMatch& match : matches) {
      const double w = Tukey(match.residual, gate);
      if (w <= 0) continue;
      normals.Add(match.point - about, match.normal, match.residual,
                  w * (weight > 0 ? weight : 1 / match.variance));
    }
    held.AddTo(normals, T_a_b, about);
    sensor::Vector6d change = SolveStep(normals);
    T_a_b = MovedPose(T_a_b, change, about);
    return change;
  }

  std::span<const SurfaceSample> a_;
  std::span<const SurfaceSample> b_;
  double normal_sigma_;
};

struct Weighed {
  std::vector<Constraint> constraints;
  double rms = 0;           // m
  double expected = 0;      // m
  double normal_sigma = 0;  // rad
};

// Of what matches at the aligned pose, what is no outlier, with variances as residuals show them.
Weighed WeighMatches(const std::vector<PatchMatch>& matches, const RegistrationConfig& config) {
  Weighed weighed;
  const double gate = kInlierSigmas * kMedianToSigma * MedianResidual(matches);
  double squared = 0;
  double variance = 0;
  double ratio = 0;
  std::vector<double> angles;
  for (const PatchMatch& match : matches) {
    if (std::abs(match.residual) > gate) continue;
    weighed.constraints.push_back({match.point, match.normal, match.variance, 1.0, match.residual});
    squared += match.residual * match.residual;
    variance += match.variance;
    ratio += match.residual * match.residual / match.variance;
    angles.push_back(match.angle);
  }
  const auto count = static_cast<double>(std::max<size_t>(1, weighed.constraints.size()));
  weighed.rms = std::sqrt(squared / count);
  weighed.expected = std::sqrt(variance / count);
  // As Qualify(): the angle between two noisy normals is Rayleigh distributed, their mean has half
  // its sigma; a patch's normal rests on four samples' at least.
  constexpr double kRayleighMedian = 1.1774;
  weighed.normal_sigma = std::max(0.5 * config.normal_sigma / std::sqrt(2.0),
                                  0.5 * MedianOf(std::move(angles)) / kRayleighMedian);
  for (Constraint& c : weighed.constraints) c.variance *= std::max(1.0, ratio / count);
  ReleaseLoneHolds(weighed.constraints, kFewestPatches);
  return weighed;
}

// How one scan's patches lie in what the other saw.
struct Sight {
  double within = 0;       // patches that face the other scanner and that nothing hides from it
  double contradicts = 0;  // of these, in empty space

  double Share() const { return within > 0 ? contradicts / within : 0; }
};
Sight SightOf(const LinkSurface& seen, const LinkSurface& by, const Eigen::Isometry3d& T_by_seen) {
  Sight sight;
  for (size_t i = 0; i < std::min(kManyPatches, seen.samples.size()); ++i) {
    const SurfaceSample& patch = seen.samples[i];
    const Eigen::Vector3d point = T_by_seen * patch.point.cast<double>();
    const Eigen::Vector3d normal = T_by_seen.linear() * patch.normal.cast<double>();
    if (normal.dot(point) >= 0) continue;
    const double free = by.FreeRangeTowards(point);
    const double range = point.norm();
    const double margin = kInEmptySpace + kInEmptyShare * range;
    if (free == 0 || range > free + margin) continue;
    ++sight.within;
    if (range < free - margin) ++sight.contradicts;
  }
  return sight;
}

double MovedBy(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to,
               const std::vector<PatchMatch>& matches) {
  const Eigen::Isometry3d back = from * to.inverse(Eigen::Isometry);
  double sum = 0;
  for (const PatchMatch& match : matches) sum += (back * match.point - match.point).squaredNorm();
  return std::sqrt(sum / static_cast<double>(std::max<size_t>(1, matches.size())));
}

// A covariance about the centroid of the overlap, as the information of a link.
sensor::Matrix6d LinkInformation(const sensor::Matrix6d& about_centroid,
                                 const Eigen::Vector3d& centroid, const Eigen::Vector3d& scanner) {
  const Eigen::Vector3d arm = scanner - centroid;
  sensor::Matrix6d move = sensor::Matrix6d::Identity();
  move.bottomLeftCorner<3, 3>() << 0, arm.z(), -arm.y(), -arm.z(), 0, arm.x(), arm.y(), -arm.x(), 0;
  const sensor::Matrix6d covariance = move * about_centroid * move.transpose();
  // Scaled, so that radians and metres do not meet in one pivot.
  const sensor::Vector6d scale = covariance.diagonal().cwiseSqrt().cwiseInverse();
  const sensor::Matrix6d unit = scale.asDiagonal() * covariance * scale.asDiagonal();
  const sensor::Matrix6d inverse = unit.ldlt().solve(sensor::Matrix6d::Identity());
  const sensor::Matrix6d information = scale.asDiagonal() * inverse * scale.asDiagonal();
  return 0.5 * (information + information.transpose());
}

LinkOutcome LinkInOrder(const PlacedSurface& a, const PlacedSurface& b,
                        const Eigen::Isometry3d& start, const RegistrationConfig& config,
                        const LinkOptions& options) {
  LinkOutcome outcome;
  const auto none = [&](std::string reason) {
    outcome.reason = std::move(reason);
    return outcome;
  };
  // The poses hold what the surfaces do not, and hardly anything else.
  sensor::PosePrior guess;
  guess.T_world_scan = start;
  PriorTerm held(guess, {});
  const PatchAligner aligner(a.surface, b.surface, config);
  PatchAlignment alignment = aligner.Finish(aligner.Approach(start, options.reach, held), held);
  if (alignment.matches.size() < kFewestPatches) {
    outcome.correspondences = alignment.matches.size();
    return none(absl::StrFormat("they share too little surface: %d patches of 20 cm",
                                alignment.matches.size()));
  }
  Weighed weighed = WeighMatches(alignment.matches, config);
  OverlapGeometry geometry(weighed.constraints, weighed.normal_sigma, config);
  if (geometry.constrained_directions() < 6) {
    // Along open directions noise of normals would decide; there the poses do, as for
    // registration's own prior.
    NormalEquations back;
    back.h = geometry.information();
    held.AddTo(back, alignment.T_a_b, geometry.centroid());
    const sensor::Vector6d change = SolveStep(back);
    const Eigen::Isometry3d there = MovedPose(alignment.T_a_b, change, geometry.centroid());
    held.Constrain({there, geometry.centroid(), geometry.Open()});
    alignment = aligner.Finish(there, held);
    if (alignment.matches.size() < kFewestPatches) {
      return none("they share too little surface where the poses have them");
    }
    weighed = WeighMatches(alignment.matches, config);
    geometry = OverlapGeometry(weighed.constraints, weighed.normal_sigma, config);
  }
  const Sight of_b = SightOf(b.surface, a.surface, alignment.T_a_b);
  const Sight of_a = SightOf(a.surface, b.surface, alignment.T_a_b.inverse(Eigen::Isometry));
  outcome.correspondences = weighed.constraints.size();
  outcome.contradiction_share = std::max(of_a.Share(), of_b.Share());
  outcome.overlap_share =
      of_b.within > 0 ? std::min(1.0, static_cast<double>(weighed.constraints.size()) / of_b.within)
                      : 0;
  outcome.rms_residual = weighed.rms;
  outcome.expected_residual = weighed.expected;
  outcome.constrained_directions = geometry.constrained_directions();
  outcome.moved = MovedBy(start, alignment.T_a_b, alignment.matches);
  if (weighed.constraints.size() < kFewestPatches) {
    return none("they share too little surface");
  }
  if (!alignment.converged) return none("the alignment did not converge");
  if (outcome.constrained_directions < 3) {
    return none(absl::StrFormat("what they share holds %d of six directions",
                                outcome.constrained_directions));
  }
  if (outcome.moved > options.reach) {
    return none(
        absl::StrFormat("the surfaces fit %.2f m from where the poses have them, more than "
                        "the %.2f m that these may be off",
                        outcome.moved, options.reach));
  }
  if (outcome.contradiction_share > kContradictsWrong) {
    return none(absl::StrFormat("%.0f %% of one lies where the other saw through",
                                100 * outcome.contradiction_share));
  }
  ScanLink link;
  link.a = std::string(a.id);
  link.b = std::string(b.id);
  link.T_a_b = CanonicalPose(alignment.T_a_b);
  sensor::Matrix6d vague = sensor::Matrix6d::Zero();
  vague.diagonal() << Eigen::Vector3d::Constant(kOpenTurn * kOpenTurn),
      Eigen::Vector3d::Constant(options.open_sigma * options.open_sigma);
  const Eigen::Vector3d scanner = alignment.T_a_b.translation();
  const sensor::Matrix6d known = geometry.FromPoseCovariance(vague, scanner);
  link.information =
      LinkInformation(geometry.Bound(known).covariance, geometry.centroid(), scanner);
  if (outcome.contradiction_share > kContradictsDoubtful) {
    link.in_doubt = true;
    outcome.reason = absl::StrFormat("%.0f %% of one lies where the other saw through",
                                     100 * outcome.contradiction_share);
  } else if (weighed.rms > std::max(kApartRms, kNoiseTimes * weighed.expected)) {
    link.in_doubt = true;
    outcome.reason = absl::StrFormat("the surfaces lie %.0f mm apart (rms)", 1000 * weighed.rms);
  }
  outcome.link = std::move(link);
  return outcome;
}

}  // namespace

LinkOutcome LinkScans(const PlacedSurface& a, const PlacedSurface& b,
                      const RegistrationConfig& config, const LinkOptions& options) {
  const bool in_order = a.id < b.id;
  const PlacedSurface& first = in_order ? a : b;
  const PlacedSurface& second = in_order ? b : a;
  Eigen::Isometry3d start = first.T_world_scan.inverse(Eigen::Isometry) * second.T_world_scan;
  if (options.T_a_b.has_value()) {
    start = in_order ? *options.T_a_b : options.T_a_b->inverse(Eigen::Isometry);
  }
  // So also what is not finite.
  if (!(start.translation().norm() < kFarApart) || !start.matrix().allFinite()) {
    LinkOutcome outcome;
    outcome.reason = "they are too far apart, or a pose is not finite";
    return outcome;
  }
  return LinkInOrder(first, second, start, config, options);
}

bool MayOverlap(const PlacedSurface& a, const PlacedSurface& b) {
  // Coarse cubes that either shows from the side that the other may see.
  constexpr double kCube = 1.0;  // m
  constexpr size_t kFewestShared = 2;
  constexpr size_t kSamples = 2000;
  const auto cubes = [&](const PlacedSurface& of) {
    std::vector<uint64_t> keys;
    for (size_t i = 0; i < std::min(kSamples, of.surface.samples.size()); ++i) {
      const SurfaceSample& patch = of.surface.samples[i];
      const Eigen::Vector3d point = of.T_world_scan * patch.point.cast<double>();
      keys.push_back(
          CorrelationBlock(point, of.T_world_scan.linear() * patch.normal.cast<double>(), kCube));
    }
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
    return keys;
  };
  const std::vector<uint64_t> of_a = cubes(a);
  const std::vector<uint64_t> of_b = cubes(b);
  std::vector<uint64_t> shared;
  std::set_intersection(of_a.begin(), of_a.end(), of_b.begin(), of_b.end(),
                        std::back_inserter(shared));
  return shared.size() >= kFewestShared;
}

}  // namespace vantage::registration

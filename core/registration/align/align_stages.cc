#include "core/registration/align/align_stages.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace vantage::registration {
namespace {

// Cosine between normals, 41 degrees: more than starts are wrong by (12) and normals noisy (10),
// less than half a right angle.
constexpr double kCoarseCompatible = 0.75;
// That hold a pose's six directions, three each; with fewer it is by chance.
constexpr size_t kFewestSamples = 20;
// Of the robust weights' scale, a step at most, on its way from a voxel and a half to what the
// noise leaves (graduated non-convexity). A pose that is a centimetre off can hold itself where
// weights are a centimetre wide: floor and ceiling, which a turn does not move, make most residuals
// small, and what a mirror that hangs askew shows lies near some wall.
constexpr double kNarrowing = 0.6;

}  // namespace

double NarrowCoarse(const CorrespondenceField& field, std::span<const SurfaceSample> samples,
                    const PriorTerm& prior, double radius, double until, Eigen::Isometry3d& pose) {
  for (; radius > until; radius *= 0.75) {
    for (int step = 0; step < 3; ++step) {
      const Eigen::Matrix3f turn = pose.linear().cast<float>();
      const Eigen::Vector3f shift = pose.translation().cast<float>();
      const Eigen::Vector3d about = pose.translation();
      NormalEquations normals;
      // One sigma of the residuals at this stage, a third of the radius: they are still mostly
      // misalignment. Matches count up to one and a half times the radius, since the field holds
      // what is nearest to the centre of a cell, and cells are two voxels wide.
      const double weight = 9 / (radius * radius);
      const auto far = static_cast<float>(2.25 * radius * radius);
      for (const SurfaceSample& s : samples) {
        const Eigen::Vector3f point = turn * s.point + shift;
        const Eigen::Vector3f normal = turn * s.normal;
        const SurfaceElement* element = field.Nearest(point, normal);
        if (element == nullptr) continue;
        const Eigen::Vector3f gap = point - element->centroid;
        if (gap.squaredNorm() > far || normal.dot(element->normal) < kCoarseCompatible) continue;
        const double residual = gap.dot(element->normal);
        const double w = Tukey(residual, radius);
        if (w <= 0) continue;
        normals.Add(point.cast<double>() - about, element->normal.cast<double>(), residual,
                    w * weight);
      }
      if (normals.count < kFewestSamples) return 0;
      prior.AddTo(normals, pose, about);
      const sensor::Vector6d change = SolveStep(normals);
      pose = MovedPose(pose, change, about);
      // The next radius is a quarter smaller: a fiftieth of it, m, and at ten metres as much of a
      // turn, rad, change nothing that it finds.
      if (change.tail<3>().norm() < 0.02 * radius && change.head<3>().norm() < 0.002) break;
    }
  }
  return radius;
}

Eigen::Isometry3d AlignCoarse(const CorrespondenceField& field,
                              std::span<const SurfaceSample> samples, Eigen::Isometry3d pose,
                              const PriorTerm& prior, double reach, double voxel) {
  NarrowCoarse(field, samples, prior, reach, LastRadius(voxel), pose);
  return pose;
}

FineResult AlignFine(const VoxelSearch& search, const ScanSurface& surface, size_t count,
                     const Eigen::Isometry3d& pose, const PriorTerm& prior,
                     const RegistrationConfig& config, parallel::Parallel& parallel,
                     int max_iterations, double first_scale, int wide_steps) {
  const std::span<const SurfaceSample> samples(surface.samples.data(),
                                               std::min(count, surface.samples.size()));
  constexpr size_t kChunk = 1024;
  const size_t chunks = (samples.size() + kChunk - 1) / kChunk;
  std::vector<Match> matches(samples.size());
  std::vector<Eigen::Vector3d> looked_up_at(samples.size(),
                                            Eigen::Vector3d::Constant(std::nan("")));
  std::vector<NormalEquations> partial(chunks);
  std::vector<std::vector<double>> magnitudes(chunks);
  const double h = search.voxel_size();
  const double still = 0.02 * h;  // a sample that moved less keeps its voxel
  FineResult result;
  result.pose = pose;
  double& scale = result.scale;  // of the robust weights
  scale = first_scale;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    // Wider at first: the coarse pose may be a voxel off.
    const double reach = iteration < wide_steps ? kWidestReach : kFineReach;
    const Eigen::Vector3d about = result.pose.translation();
    parallel.For(chunks, [&](size_t chunk) {
      NormalEquations sum;
      magnitudes[chunk].clear();
      const size_t end = std::min(samples.size(), (chunk + 1) * kChunk);
      for (size_t i = chunk * kChunk; i < end; ++i) {
        const SurfaceSample& s = samples[i];
        const Eigen::Vector3d point = result.pose * s.point.cast<double>();
        const Eigen::Vector3d normal = result.pose.linear() * s.normal.cast<double>();
        if (iteration < 3 || !((point - looked_up_at[i]).squaredNorm() < still * still)) {
          matches[i] = search.Find(point, normal, reach);
          looked_up_at[i] = point;
        }
        const Match& match = matches[i];
        if (match.voxel == nullptr) continue;
        const Eigen::Vector3d gap = point - match.voxel->centroid.cast<double>();
        const double residual = gap.dot(match.normal);
        magnitudes[chunk].push_back(std::abs(residual));
        const double variance = ResidualVariance(s, *match.voxel, gap, residual, surface.roughness,
                                                 config.normal_sigma);
        // What is known to be vague, such as a side that a scan has blurred, counts farther out.
        const double w = Tukey(residual, std::max(scale, kTukeySigmas * std::sqrt(variance)));
        if (w <= 0) continue;
        sum.Add(point - about, match.normal, residual, w / variance);
      }
      partial[chunk] = sum;
    });
    NormalEquations normals;
    std::vector<double> all;
    for (size_t chunk = 0; chunk < chunks; ++chunk) {
      normals += partial[chunk];
      all.insert(all.end(), magnitudes[chunk].begin(), magnitudes[chunk].end());
    }
    if (normals.count < kFewestSamples) return result;
    const auto middle = all.begin() + static_cast<ptrdiff_t>(all.size() / 2);
    std::nth_element(all.begin(), middle, all.end());
    const double least = kTukeySigmas * kMedianToSigma * std::max(*middle, kLeastMedianResidual);
    const bool narrow = scale <= 1.01 * least;
    scale = std::min(scale, std::max(least, kNarrowing * scale));
    prior.AddTo(normals, result.pose, about);
    const sensor::Vector6d change = SolveStep(normals);
    result.pose = MovedPose(result.pose, change, about);
    result.iterations = iteration + 1;
    if (narrow && iteration >= 3 && change.tail<3>().norm() < 5e-5 &&
        change.head<3>().norm() < 2e-5) {
      result.converged = true;
      break;
    }
  }
  return result;
}

double SurfaceDistance(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b,
                       std::span<const SurfaceSample> samples) {
  double sum = 0;
  for (const SurfaceSample& s : samples) {
    const Eigen::Vector3d p = s.point.cast<double>();
    sum += (a * p - b * p).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(std::max<size_t>(1, samples.size())));
}

double ScorePose(const VoxelSearch& search, std::span<const SurfaceSample> samples,
                 const Eigen::Isometry3d& pose) {
  const double scale = search.voxel_size();
  double fit = 0;
  for (const SurfaceSample& s : samples) {
    const Eigen::Vector3d point = pose * s.point.cast<double>();
    const Eigen::Vector3d normal = pose.linear() * s.normal.cast<double>();
    const Match match = search.Find(point, normal);
    if (match.voxel == nullptr) continue;
    fit += Tukey((point - match.voxel->centroid.cast<double>()).dot(match.normal), scale);
  }
  return fit / static_cast<double>(std::max<size_t>(1, samples.size()));
}

}  // namespace vantage::registration

#include "core/registration/graph/link_surface.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "absl/container/flat_hash_map.h"

namespace vantage::registration {
namespace {

constexpr int kDepthColumns = 360;
constexpr int kDepthRows = 180;
// m, rms across and along: a patch whose samples spread so far has a plane of its own, else the
// mean of its samples' normals is better.
constexpr double kPlaneWidth = 0.03;
constexpr double kPlaneSamples = 6;
// Cosine, 30 degrees: samples whose normals differ by more are of two surfaces, or of an edge.
constexpr double kOneSurface = 0.87;

// What the samples of one patch add up to.
struct PatchSum {
  double count = 0;
  double cells = 0;
  double variance = 0;  // m^2, of all
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  Eigen::Matrix3d square = Eigen::Matrix3d::Zero();

  void Add(const SurfaceSample& sample) {
    const Eigen::Vector3d p = sample.point.cast<double>();
    ++count;
    cells += sample.cells;
    variance += static_cast<double>(sample.sigma) * sample.sigma;
    point += p;
    normal += sample.normal.cast<double>();
    square += p * p.transpose();
  }
};

uint64_t PatchKey(const SurfaceSample& sample) {
  int axis = 0;
  sample.normal.cwiseAbs().maxCoeff(&axis);
  const auto side = static_cast<uint64_t>(2 * axis + (sample.normal[axis] < 0 ? 1 : 0));
  const Eigen::Array3i cell =
      (sample.point.array() / static_cast<float>(kPatchSide)).floor().cast<int>() + (1 << 18);
  return (side << 60) | (static_cast<uint64_t>(cell.x()) << 40) |
         (static_cast<uint64_t>(cell.y()) << 20) | static_cast<uint64_t>(cell.z());
}

// Nothing where the samples are no one surface.
bool PatchOf(const PatchSum& sum, SurfaceSample& patch) {
  const Eigen::Vector3d mean = sum.point / sum.count;
  Eigen::Vector3d normal = sum.normal / sum.count;
  if (normal.norm() < kOneSurface) return false;
  normal.normalize();
  const Eigen::Matrix3d spread = sum.square / sum.count - mean * mean.transpose();
  double off = normal.dot(spread * normal);  // m^2, of samples from the plane
  if (sum.count >= kPlaneSamples) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
    if (solver.eigenvalues()[1] > kPlaneWidth * kPlaneWidth) {
      Eigen::Vector3d plane = solver.eigenvectors().col(0);
      if (plane.dot(normal) < 0) plane = -plane;
      if (plane.dot(normal) > kOneSurface) {
        normal = plane;
        off = solver.eigenvalues()[0];
      }
    }
  }
  const double noise = sum.variance / sum.count;
  // Relief that noise does not explain is not averaged away: another scan has other samples of it.
  const double relief = std::max(0.0, off - noise);
  patch.point = mean.cast<float>();
  patch.normal = normal.cast<float>();
  patch.sigma = static_cast<float>(std::sqrt(noise / sum.count + relief));
  patch.cells = static_cast<float>(sum.cells);
  return true;
}

std::vector<SurfaceSample> Patches(const std::vector<SurfaceSample>& samples) {
  absl::flat_hash_map<uint64_t, uint32_t> at;
  std::vector<PatchSum> sums;
  for (const SurfaceSample& sample : samples) {
    const auto [it, fresh] = at.try_emplace(PatchKey(sample), static_cast<uint32_t>(sums.size()));
    if (fresh) sums.emplace_back();
    sums[it->second].Add(sample);
  }
  std::vector<SurfaceSample> patches;
  for (const PatchSum& sum : sums) {
    SurfaceSample patch;
    if (PatchOf(sum, patch)) patches.push_back(patch);
  }
  SpreadSamples(patches);
  if (patches.size() > kMostPatches) patches.resize(kMostPatches);
  patches.shrink_to_fit();
  return patches;
}

int DepthRow(double elevation) {
  return std::clamp(static_cast<int>((elevation + 0.5 * sensor::kPi) / kDepthStep), 0,
                    kDepthRows - 1);
}
int DepthColumn(double azimuth) {
  const int column = static_cast<int>(std::floor((azimuth + sensor::kPi) / kDepthStep));
  return ((column % kDepthColumns) + kDepthColumns) % kDepthColumns;
}
size_t DepthCell(int column, int row) {
  return static_cast<size_t>(column) * kDepthRows + static_cast<size_t>(row);
}

std::vector<float> FreeRanges(const sensor::RangeImage& image) {
  std::vector<float> nearest(static_cast<size_t>(kDepthColumns) * kDepthRows, 0);
  for (int c = 0; c < image.columns(); ++c) {
    const int column = DepthColumn(image.azimuth[static_cast<size_t>(c)]);
    for (int r = 0; r < image.rows(); ++r) {
      const float range = image.at(c, r);
      if (!sensor::RangeImage::IsRange(range)) continue;
      float& cell = nearest[DepthCell(column, DepthRow(image.elevation[static_cast<size_t>(r)]))];
      if (cell == 0 || range < cell) cell = range;
    }
  }
  // An edge may lie anywhere in a cell, so those beside it count.
  std::vector<float> free(nearest.size(), 0);
  for (int c = 0; c < kDepthColumns; ++c) {
    for (int r = 0; r < kDepthRows; ++r) {
      float least = nearest[DepthCell(c, r)];
      if (least == 0) continue;
      for (int dc = -1; dc <= 1; ++dc) {
        for (int dr = -1; dr <= 1; ++dr) {
          if (r + dr < 0 || r + dr >= kDepthRows) continue;
          const float beside = nearest[DepthCell((c + dc + kDepthColumns) % kDepthColumns, r + dr)];
          if (beside > 0) least = std::min(least, beside);
        }
      }
      free[DepthCell(c, r)] = least;
    }
  }
  return free;
}

}  // namespace

size_t LinkSurface::MemoryBytes() const {
  return sizeof(LinkSurface) + samples.capacity() * sizeof(SurfaceSample) +
         free_range.capacity() * sizeof(float);
}

double LinkSurface::FreeRangeTowards(const Eigen::Vector3d& point) const {
  if (free_range.empty()) return 0;
  const double across = std::hypot(point.x(), point.y());
  return free_range[DepthCell(DepthColumn(std::atan2(point.y(), point.x())),
                              DepthRow(std::atan2(point.z(), across)))];
}

LinkSurface MakeLinkSurface(const ScanSurface& surface, const sensor::Scan& scan) {
  LinkSurface linked;
  linked.samples = Patches(surface.samples);
  linked.free_range = FreeRanges(scan.image);
  linked.image_samples = surface.image_samples;
  return linked;
}

LinkSurface MakeLinkSurface(const sensor::Scan& scan, const RegistrationConfig& config,
                            parallel::Parallel& parallel) {
  return MakeLinkSurface(SampleSurface(scan, config.sample_spacing, parallel), scan);
}

}  // namespace vantage::registration

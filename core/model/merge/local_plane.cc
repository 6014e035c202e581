#include "core/model/merge/local_plane.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/model/merge/halo_mask.h"

namespace vantage::model {

namespace {

// The sums of several voxels about one voxel's lowest corner.
class Moments {
 public:
  // `dx, dy, dz`: the voxel that the sums belong to, relative to the middle one.
  void Add(const SurfaceSums& sums, int dx, int dy, int dz) {
    const int64_t x = int64_t{dx} * SurfaceSums::kUnits;
    const int64_t y = int64_t{dy} * SurfaceSums::kUnits;
    const int64_t z = int64_t{dz} * SurfaceSums::kUnits;
    const int64_t n = sums.points;
    const auto sx = static_cast<int64_t>(sums.point_sum[0]);
    const auto sy = static_cast<int64_t>(sums.point_sum[1]);
    const auto sz = static_cast<int64_t>(sums.point_sum[2]);
    const auto product = [&sums](size_t k) { return static_cast<int64_t>(sums.product_sum[k]); };
    product_[0] += product(0) + x * (2 * sx + n * x);
    product_[1] += product(1) + y * sx + x * (sy + n * y);
    product_[2] += product(2) + z * sx + x * (sz + n * z);
    product_[3] += product(3) + y * (2 * sy + n * y);
    product_[4] += product(4) + z * sy + y * (sz + n * z);
    product_[5] += product(5) + z * (2 * sz + n * z);
    sum_[0] += sx + n * x;
    sum_[1] += sy + n * y;
    sum_[2] += sz + n * z;
    points_ += n;
  }

  // Covariance, in squared units.
  Eigen::Matrix3d Covariance() const {
    const double n = static_cast<double>(points_);
    Eigen::Matrix3d c;
    size_t k = 0;
    for (int i = 0; i < 3; ++i) {
      for (int j = i; j < 3; ++j) {
        const double mean_product = static_cast<double>(product_[k++]) / n;
        c(i, j) = c(j, i) =
            mean_product - static_cast<double>(sum_[static_cast<size_t>(i)]) / n *
                               (static_cast<double>(sum_[static_cast<size_t>(j)]) / n);
      }
    }
    return c;
  }

 private:
  int64_t points_ = 0;
  std::array<int64_t, 3> sum_{};
  std::array<int64_t, 6> product_{};
};

Eigen::Vector3d Centroid(const VoxelIndex& voxel, const SurfaceSums& sums, double voxel_size) {
  const bool measured = sums.samples > 0;
  const auto& sum = measured ? sums.sample_sum : sums.point_sum;
  const double n = (measured ? sums.samples : sums.points) * double{SurfaceSums::kUnits};
  Eigen::Vector3d centroid;
  for (int i = 0; i < 3; ++i) {
    // Offsets were cut to whole units: half a unit puts them back in the mean.
    const double mean = static_cast<double>(sum[static_cast<size_t>(i)]) / n;
    centroid[i] = (voxel[i] + mean + 0.5 / SurfaceSums::kUnits) * voxel_size;
  }
  return centroid;
}

}  // namespace

std::vector<LocalPlane> FitPlanes(const VoxelIndex& brick,
                                  const BrickNeighbourhood<UnitedBrick>& united,
                                  std::span<const LayerBrick* const> in_layers,
                                  std::span<const ScanLayer* const> layers, double voxel_size) {
  const UnitedBrick& own = *united.middle();
  std::vector<std::pair<const ScanLayer*, const LayerBrick*>> witnesses;
  for (size_t i = 0; i < layers.size(); ++i) {
    if (in_layers[i] != nullptr) witnesses.emplace_back(layers[i], in_layers[i]);
  }
  const HaloMask surface(united, [](const UnitedBrick& b) { return &b.surface; });
  std::vector<LocalPlane> planes;
  planes.reserve(own.sums.size());
  for (int local = 0; local < Brick::kVoxels; ++local) {
    if (!own.surface.Has(local)) continue;
    const SurfaceSums& sums = own.sums[planes.size()];
    const int x = local & 7, y = local >> 3 & 7, z = local >> 6;
    Moments moments;
    surface.ForEachAround(x, y, z, 1, [&](int dx, int dy, int dz) {
      const auto [there, at] = united.At(x + dx, y + dy, z + dz);
      moments.Add(there->sums[there->Rank(at)], dx, dy, dz);
    });
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    solver.computeDirect(moments.Covariance());
    Eigen::Vector3d normal = solver.eigenvectors().col(0).normalized();
    if (!normal.allFinite()) normal = Eigen::Vector3d::UnitZ();

    const Eigen::Vector3d centroid = Centroid(PlanningView::Global(brick, local), sums, voxel_size);
    int64_t votes = 0;
    for (const auto& [layer, found] : witnesses) {
      if (!found->surface.Has(local)) continue;
      const int64_t points = found->sums[static_cast<size_t>(found->surface.Rank(local))].points;
      votes += normal.dot(layer->T_model_scan.translation() - centroid) >= 0 ? points : -points;
    }
    if (votes < 0) normal = -normal;

    LocalPlane plane;
    plane.centroid = centroid.cast<float>();
    plane.normal = normal.cast<float>();
    plane.flatness = static_cast<float>(std::sqrt(std::max(0.0, solver.eigenvalues()[0])) /
                                        SurfaceSums::kUnits * voxel_size);
    constexpr uint32_t kMeasured = 1u << 31;
    plane.weight = sums.samples > 0 ? (kMeasured | sums.samples) : sums.points;
    planes.push_back(plane);
  }
  return planes;
}

std::vector<LocalPlane> SnapToFlatNeighbours(const BrickNeighbourhood<MergedBrick>& fitted,
                                             double voxel_size) {
  // Voxels, rms, that the points around a voxel lie off their plane: around a right angle they do
  // by 0.2 to 0.4. Noise does by its sigma, and stays below up to 6 mm at 5 cm; with more no
  // neighbour is flat, and a voxel keeps its own fit. (Up to 1 cm, and 3 mm at 2 cm, nine of ten
  // voxels at edges face as one of the surfaces all the same.)
  constexpr double kFlat = 0.12;
  // Voxels, from a voxel's centroid to the plane that it takes: noise up to a fifth of a voxel.
  constexpr double kOnPlane = 0.2;
  const float flat = static_cast<float>(kFlat * voxel_size);
  const MergedBrick& own = *fitted.middle();
  const HaloMask surface(
      fitted, [](const MergedBrick& b) { return b.united ? &b.united->surface : nullptr; });
  std::vector<LocalPlane> planes = own.fitted;
  size_t rank = 0;
  for (int local = 0; local < Brick::kVoxels; ++local) {
    if (!own.united->surface.Has(local)) continue;
    LocalPlane& plane = planes[rank++];
    if (plane.flatness <= flat) continue;
    const int x = local & 7, y = local >> 3 & 7, z = local >> 6;
    float best = static_cast<float>(kOnPlane * voxel_size);
    const LocalPlane* chosen = nullptr;
    surface.ForEachAround(x, y, z, 2, [&](int dx, int dy, int dz) {
      const auto [there, at] = fitted.At(x + dx, y + dy, z + dz);
      const LocalPlane& other = there->fitted[there->united->Rank(at)];
      if (other.flatness > flat) return;
      const float off = std::abs(other.normal.dot(plane.centroid - other.centroid));
      if (off < best) {
        best = off;
        chosen = &other;
      }
    });
    if (chosen != nullptr) {
      plane.normal = chosen->normal;
      plane.flatness = chosen->flatness;
    }
  }
  return planes;
}

}  // namespace vantage::model

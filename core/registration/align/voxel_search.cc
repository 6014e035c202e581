#include "core/registration/align/voxel_search.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace vantage::registration {
namespace {

// Cosine between normals, 37 degrees: less than half a right angle, and five sigma of two normals
// whose noise is 0.09 rad. Normals of single scans are better than that up to a noise of 1 cm.
constexpr double kFineCompatible = 0.80;
constexpr int kSpan = 8;  // voxels along an axis within the widest reach, at most: 2 * 2.5 + 2

// How far a point lies outside of each voxel from `low` to `high` along an axis, squared.
struct Axis {
  int low = 0;
  int high = 0;
  std::array<double, kSpan> outside{};  // m^2

  Axis(double at, double reach, double voxel)
      : low(static_cast<int>(std::floor((at - reach) / voxel))),
        high(std::min(static_cast<int>(std::floor((at + reach) / voxel)), low + kSpan - 1)) {
    for (int v = low; v <= high; ++v) {
      const double corner = v * voxel;
      const double far = std::max({corner - at, at - corner - voxel, 0.0});
      outside[static_cast<size_t>(v - low)] = far * far;
    }
  }
  double Outside(int v) const { return outside[static_cast<size_t>(v - low)]; }
};

// Bits of a brick's row from voxel `low` to `high`, as far as they lie in the brick.
uint64_t RowBits(int low, int high, int brick) {
  const int from = std::max(low - brick * model::Brick::kSide, 0);
  const int to = std::min(high - brick * model::Brick::kSide, model::Brick::kSide - 1);
  return (uint64_t{0xff} >> (model::Brick::kSide - 1 - to)) & (uint64_t{0xff} << from);
}

}  // namespace

VoxelSearch::VoxelSearch(const model::PlanningView& model, const Eigen::AlignedBox3d& box)
    : voxel_(model.voxel_size()) {
  if (box.isEmpty()) return;
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(kWidestReach * voxel_);
  const model::VoxelIndex low = model.At(box.min() - margin).cwiseMax(model.bounds().min);
  const model::VoxelIndex high =
      model.At(box.max() + margin).cwiseMin(model.bounds().max - model::VoxelIndex::Ones());
  if ((low.array() > high.array()).any()) return;
  const model::VoxelIndex first = model::Brick::Of(low);
  const model::VoxelIndex last = model::Brick::Of(high);
  first_page_ = model::BrickPage::Of(first);
  size_ = model::BrickPage::Of(last) - first_page_ + model::VoxelIndex::Ones();
  table_.assign(static_cast<size_t>(size_.x()) * static_cast<size_t>(size_.y()) *
                    static_cast<size_t>(size_.z()),
                -1);
  // Page by page: of a large site most lies outside of what a scan reaches, and is not looked at.
  model::VoxelIndex at;
  for (at.z() = 0; at.z() < size_.z(); ++at.z()) {
    for (at.y() = 0; at.y() < size_.y(); ++at.y()) {
      for (at.x() = 0; at.x() < size_.x(); ++at.x()) {
        const model::BrickPage* page = model.Page(first_page_ + at);
        if (page != nullptr && page->surface_count() > 0) Add(*page, first, last);
      }
    }
  }
}

void VoxelSearch::Add(const model::BrickPage& page, const model::VoxelIndex& first,
                      const model::VoxelIndex& last) {
  const model::VoxelIndex corner = page.coordinates() * model::BrickPage::kSide;
  int32_t& held = table_[PlaceOf(page.coordinates())];
  page.with_opaque().ForEach([&](int local) {
    const model::Brick* const brick = page.Contents(local).get();
    const model::VoxelIndex at = corner + model::VoxelIndex(local & 7, local >> 3 & 7, local >> 6);
    if (brick == nullptr || brick->surface.empty() || (at.array() < first.array()).any() ||
        (at.array() > last.array()).any()) {
      return;
    }
    TrueSurface kept;
    kept.brick = brick;
    uint64_t any = 0;
    int rank = 0;
    for (size_t layer = 0; layer < model::Brick::kSide; ++layer) {
      const model::VoxelState* states = &brick->state[layer * 64];
      uint64_t mask = 0;
      for (uint64_t bits = brick->surface_mask[layer]; bits != 0; bits &= bits - 1) {
        if (states[std::countr_zero(bits)] == model::VoxelState::kTrueSurface) mask |= bits & -bits;
      }
      kept.mask[layer] = mask;
      kept.ranks[layer] = static_cast<uint16_t>(rank);
      rank += std::popcount(brick->surface_mask[layer]);
      any |= mask;
    }
    if (any == 0) return;
    if (held < 0) {
      held = static_cast<int32_t>(pages_.size());
      pages_.emplace_back().fill(-1);
    }
    pages_[static_cast<size_t>(held)][static_cast<size_t>(local)] =
        static_cast<int32_t>(bricks_.size());
    bricks_.push_back(kept);
  });
}

template <bool any>
const model::SurfaceVoxel* VoxelSearch::Look(const Eigen::Vector3d& point,
                                             const Eigen::Vector3d& normal, double reach) const {
  const model::SurfaceVoxel* best = nullptr;
  if (bricks_.empty()) return best;
  const double far = std::min(reach, kWidestReach) * voxel_;
  const Axis x(point.x(), far, voxel_);
  const Axis y(point.y(), far, voxel_);
  const Axis z(point.z(), far, voxel_);
  double nearest = far * far;
  for (int bz = z.low >> 3; bz <= z.high >> 3; ++bz) {
    for (int by = y.low >> 3; by <= y.high >> 3; ++by) {
      for (int bx = x.low >> 3; bx <= x.high >> 3; ++bx) {
        const TrueSurface* surface = At({bx, by, bz});
        if (surface == nullptr) continue;
        // One bit a row, of the first voxel in it.
        uint64_t rows = 0;
        const int y_from = std::max(y.low, by * model::Brick::kSide);
        const int y_to = std::min(y.high, by * model::Brick::kSide + model::Brick::kSide - 1);
        for (int v = y_from; v <= y_to; ++v) rows |= uint64_t{1} << (8 * (v & 7));
        const uint64_t wanted = rows * RowBits(x.low, x.high, bx);
        const int z_from = std::max(z.low, bz * model::Brick::kSide);
        const int z_to = std::min(z.high, bz * model::Brick::kSide + model::Brick::kSide - 1);
        for (int layer = z_from; layer <= z_to; ++layer) {
          const double above = z.Outside(layer);
          if (above >= nearest) continue;
          const auto word = static_cast<size_t>(layer & 7);
          for (uint64_t bits = surface->mask[word] & wanted; bits != 0; bits &= bits - 1) {
            const int local = std::countr_zero(bits);
            const double outside = x.Outside(bx * model::Brick::kSide + (local & 7)) +
                                   y.Outside(by * model::Brick::kSide + (local >> 3)) + above;
            if (outside >= nearest) continue;
            const uint64_t before = (bits & -bits) - 1;
            const size_t rank =
                surface->ranks[word] +
                static_cast<size_t>(std::popcount(surface->brick->surface_mask[word] & before));
            const model::SurfaceVoxel& voxel = surface->brick->surface.Stored(rank);
            if (voxel.normal.cast<double>().dot(normal) < kFineCompatible) continue;
            const double distance = (point - voxel.centroid.cast<double>()).squaredNorm();
            if (distance >= nearest) continue;
            if (any) return &voxel;
            nearest = distance;
            best = &voxel;
          }
        }
      }
    }
  }
  return best;
}

Match VoxelSearch::Find(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                        double reach) const {
  Match best;
  best.voxel = Look<false>(point, normal, reach);
  if (best.voxel != nullptr) {
    best.normal = (best.voxel->normal.cast<double>() + normal).normalized();
  }
  return best;
}

bool VoxelSearch::FindsAny(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                           double reach) const {
  return Look<true>(point, normal, reach) != nullptr;
}

Eigen::AlignedBox3d BoxOf(const ScanSurface& surface, const Eigen::Isometry3d& T_world_scan) {
  Eigen::AlignedBox3d box;
  for (const SurfaceSample& s : surface.samples) box.extend(T_world_scan * s.point.cast<double>());
  return box;
}

double ResidualVariance(const SurfaceSample& sample, const model::SurfaceVoxel& voxel,
                        const Eigen::Vector3d& gap, double along, double roughness,
                        double normal_sigma) {
  const double noise = std::max<double>(sample.sigma, roughness);
  const double model = noise * noise / std::max<double>(1.0, voxel.samples);
  const double interpolated = voxel.samples == 0 ? noise * noise : 0.0;
  const double across = gap.squaredNorm() - along * along;  // m^2, off the centroid in its plane
  return noise * noise + model + interpolated +
         0.5 * normal_sigma * normal_sigma * std::max(0.0, across);
}

}  // namespace vantage::registration

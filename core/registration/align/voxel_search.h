// Finds the voxel of true surface that a sample lies on.
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_VOXEL_SEARCH_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_VOXEL_SEARCH_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/registration/align/scan_surface.h"

namespace vantage::registration {

// The largest distance from a sample to the centroid of its voxel, in voxels. It is somewhat less
// than the diagonal of a cube (1.73), so that a sample finds its own voxel and those beside it, but
// not the other side of a board two voxels thick. For a noise of up to a third of a voxel.
inline constexpr double kFineReach = 1.6;
// The largest such distance that can be asked for, in voxels; the coarse stage ends within two
// voxels.
inline constexpr double kWidestReach = 2.5;

struct Match {
  const model::SurfaceVoxel* voxel = nullptr;
  Eigen::Vector3d normal;  // mean of the sample's and the voxel's
};

// The true surface of one model, which outlives this: by brick, one bit a voxel.
class VoxelSearch {
 public:
  // Only surface in `box` (m, world) and a little around it is found.
  VoxelSearch(const model::PlanningView& model, const Eigen::AlignedBox3d& box);

  double voxel_size() const { return voxel_; }

  // The nearest compatible true-surface voxel by its centroid, at most `reach` voxels away.
  Match Find(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
             double reach = kFineReach) const;
  // Whether Find() finds any.
  bool FindsAny(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                double reach = kFineReach) const;

 private:
  struct TrueSurface {
    const model::Brick* brick = nullptr;
    std::array<uint64_t, model::Brick::kSide> mask{};  // of true surface, as Brick::surface_mask
    std::array<uint16_t, model::Brick::kSide>
        ranks{};  // in Brick::surface, of the first in each layer
  };
  // Eight bricks along each side; -1: no true surface.
  using Page = std::array<int32_t, model::Brick::kVoxels>;

  // The true surface of a page, of its bricks first <= brick <= last.
  void Add(const model::BrickPage& page, const model::VoxelIndex& first,
           const model::VoxelIndex& last);
  // The first that is found rather than the nearest, where `any` is enough.
  template <bool any>
  const model::SurfaceVoxel* Look(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                                  double reach) const;
  size_t PlaceOf(const model::VoxelIndex& page) const {
    const model::VoxelIndex at = page - first_page_;
    return static_cast<size_t>(at.x()) +
           static_cast<size_t>(size_.x()) *
               (static_cast<size_t>(at.y()) +
                static_cast<size_t>(size_.y()) * static_cast<size_t>(at.z()));
  }
  const TrueSurface* At(const model::VoxelIndex& brick) const {
    const model::VoxelIndex page = model::BrickPage::Of(brick);
    if (((page - first_page_).array() < 0).any() ||
        ((page - first_page_).array() >= size_.array()).any()) {
      return nullptr;
    }
    const int32_t held = table_[PlaceOf(page)];
    if (held < 0) return nullptr;
    const int32_t i =
        pages_[static_cast<size_t>(held)][static_cast<size_t>(model::Brick::LocalOf(brick))];
    return i < 0 ? nullptr : &bricks_[static_cast<size_t>(i)];
  }

  double voxel_;
  model::VoxelIndex first_page_ = model::VoxelIndex::Zero();
  model::VoxelIndex size_ = model::VoxelIndex::Zero();  // of the table, in pages
  std::vector<int32_t> table_;                          // dense over the box; -1: no true surface
  std::vector<Page> pages_;
  std::vector<TrueSurface> bricks_;
};

// The box of a scan's samples at a pose, m, world.
Eigen::AlignedBox3d BoxOf(const ScanSurface& surface, const Eigen::Isometry3d& T_world_scan);

// The variance of a residual that noise alone explains, m^2. `gap`: from the voxel's centroid to
// the sample, `along` of it along the normal.
double ResidualVariance(const SurfaceSample& sample, const model::SurfaceVoxel& voxel,
                        const Eigen::Vector3d& gap, double along, double roughness,
                        double normal_sigma);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_VOXEL_SEARCH_H_

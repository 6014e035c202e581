#include "core/registration/align/correspondence_field.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vantage::registration {
namespace {

// An element serves every direction within 60 degrees of its normal: one to three of the six.
constexpr float kServes = 0.5f;

}  // namespace

CorrespondenceField::CorrespondenceField(const model::PlanningView& model,
                                         const Eigen::AlignedBox3d& box, double reach,
                                         parallel::Parallel& parallel, double most_cells) {
  const double h = model.voxel_size();
  Eigen::AlignedBox3d covered(model.bounds().min.cast<double>() * h,
                              model.bounds().max.cast<double>() * h);
  covered = covered.intersection(box);
  if (covered.isEmpty()) return;
  const double volume = covered.sizes().cwiseMax(h).prod();
  cell_ = static_cast<float>(std::max(2 * h, std::cbrt(volume / most_cells)));
  inverse_cell_ = 1.0f / cell_;
  origin_ = covered.min().cast<float>();
  size_ = ((covered.sizes() / cell_).array().floor().cast<int>() + 1).max(1);

  const Eigen::AlignedBox3f inside(covered.min().cast<float>(), covered.max().cast<float>());
  model.ForEachSurface(
      [&](const model::VoxelIndex&, model::VoxelState state, const model::SurfaceVoxel& voxel) {
        if (state != model::VoxelState::kTrueSurface || !inside.contains(voxel.centroid)) return;
        elements_.push_back({voxel.centroid, voxel.normal, static_cast<float>(voxel.samples)});
      });
  parallel.For(kDirections, [&](size_t direction) { Grow(static_cast<int>(direction), reach); });
}

void CorrespondenceField::Grow(int direction, double reach) {
  std::vector<int32_t>& nearest = nearest_[static_cast<size_t>(direction)];
  nearest.assign(static_cast<size_t>(size_.prod()), -1);
  const int axis = direction / 2;
  const float sign = direction % 2 == 0 ? 1.0f : -1.0f;
  const auto centre = [this](const Eigen::Array3i& cell) -> Eigen::Vector3f {
    return origin_ + ((cell.cast<float>() + 0.5f) * cell_).matrix();
  };
  const auto closer = [&](int32_t candidate, int32_t current, const Eigen::Vector3f& to) {
    return current < 0 || (elements_[static_cast<size_t>(candidate)].centroid - to).squaredNorm() <
                              (elements_[static_cast<size_t>(current)].centroid - to).squaredNorm();
  };
  // Cells that hold an element, then ring by ring outwards, each cell asking its six neighbours'
  // element whether it is nearer.
  std::vector<Eigen::Array3i> front;
  for (size_t i = 0; i < elements_.size(); ++i) {
    const SurfaceElement& e = elements_[i];
    if (sign * e.normal[axis] < kServes) continue;
    const Eigen::Array3i cell =
        (((e.centroid - origin_).array() * inverse_cell_).floor().cast<int>())
            .max(0)
            .min(size_ - 1);
    int32_t& slot = nearest[Flat(cell)];
    if (slot < 0) front.push_back(cell);
    if (closer(static_cast<int32_t>(i), slot, centre(cell))) slot = static_cast<int32_t>(i);
  }
  const auto limit = static_cast<float>((reach + cell_) * (reach + cell_));
  // A straight line over faces is at most sqrt(3) times as long as the way; half as much again is
  // what corners of the reach's sphere that nobody is in leave.
  const int rings = static_cast<int>(std::ceil(reach / cell_ * 1.5)) + 1;
  std::vector<Eigen::Array3i> next;
  for (int ring = 0; ring < rings && !front.empty(); ++ring) {
    next.clear();
    for (const Eigen::Array3i& cell : front) {
      const int32_t element = nearest[Flat(cell)];
      for (int side = 0; side < 6; ++side) {
        Eigen::Array3i neighbour = cell;
        neighbour[side / 2] += side % 2 == 0 ? 1 : -1;
        if ((neighbour < 0).any() || (neighbour >= size_).any()) continue;
        int32_t& slot = nearest[Flat(neighbour)];
        if (slot == element) continue;
        const Eigen::Vector3f c = centre(neighbour);
        if ((elements_[static_cast<size_t>(element)].centroid - c).squaredNorm() > limit) continue;
        if (!closer(element, slot, c)) continue;
        slot = element;
        next.push_back(neighbour);
      }
    }
    std::swap(front, next);
  }
}

}  // namespace vantage::registration

#include "core/registration/align/correspondence_field.h"

#include <algorithm>
#include <bit>
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
  for (std::vector<int32_t>& nearest : nearest_) {
    nearest.assign(static_cast<size_t>(size_.prod()), -1);
  }
  // A centroid lies in its voxel, but for rounding: a voxel beside the box is enough.
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(h);
  const model::VoxelIndex first = model::Brick::Of(model.At(covered.min() - margin));
  const model::VoxelIndex last = model::Brick::Of(model.At(covered.max() + margin));
  std::array<Cells, kDirections> fronts;
  for (const model::BrickAt& at : model.surface_bricks()) {
    if (at.contents->surface.empty() || (at.brick.array() < first.array()).any() ||
        (at.brick.array() > last.array()).any()) {
      continue;
    }
    size_t rank = 0;
    for (size_t word = 0; word < model::Brick::kSide; ++word) {
      for (uint64_t bits = at.contents->surface_mask[word]; bits != 0; bits &= bits - 1, ++rank) {
        const size_t local = word * 64 + static_cast<size_t>(std::countr_zero(bits));
        if (at.contents->state[local] != model::VoxelState::kTrueSurface) continue;
        const model::SurfaceVoxel& voxel = at.contents->surface.Stored(rank);
        if (!inside.contains(voxel.centroid)) continue;
        ++count_;
        Keep({voxel.centroid, voxel.normal, static_cast<float>(voxel.samples)}, fronts);
      }
    }
  }
  parallel.For(kDirections, [&](size_t direction) {
    Grow(static_cast<int>(direction), reach, std::move(fronts[direction]));
  });
}

void CorrespondenceField::Keep(const SurfaceElement& element,
                               std::array<Cells, kDirections>& fronts) {
  const Eigen::Array3i cell =
      (((element.centroid - origin_).array() * inverse_cell_).floor().cast<int>())
          .max(0)
          .min(size_ - 1);
  const size_t flat = Flat(cell);
  const Eigen::Vector3f centre = CentreOf(cell);
  for (size_t direction = 0; direction < kDirections; ++direction) {
    const float along = element.normal[static_cast<Eigen::Index>(direction / 2)];
    if ((direction % 2 == 0 ? along : -along) < kServes) continue;
    int32_t& slot = nearest_[direction][flat];
    if (slot < 0) {
      slot = static_cast<int32_t>(elements_.size());
      elements_.push_back(element);
      fronts[direction].push_back(cell);
      continue;
    }
    SurfaceElement& kept = elements_[static_cast<size_t>(slot)];
    if ((element.centroid - centre).squaredNorm() < (kept.centroid - centre).squaredNorm()) {
      kept = element;
    }
  }
}

void CorrespondenceField::Grow(int direction, double reach, Cells front) {
  std::vector<int32_t>& nearest = nearest_[static_cast<size_t>(direction)];
  const auto closer = [&](int32_t candidate, int32_t current, const Eigen::Vector3f& to) {
    return current < 0 || (elements_[static_cast<size_t>(candidate)].centroid - to).squaredNorm() <
                              (elements_[static_cast<size_t>(current)].centroid - to).squaredNorm();
  };
  const auto limit = static_cast<float>((reach + cell_) * (reach + cell_));
  // A straight line over faces is at most sqrt(3) times as long as the way; half as much again is
  // what corners of the reach's sphere that nobody is in leave.
  const int rings = static_cast<int>(std::ceil(reach / cell_ * 1.5)) + 1;
  // Ring by ring, each cell asking its six neighbours' element whether it is nearer. A cell is in
  // the next ring once, with the element that it has by then.
  const std::array<ptrdiff_t, 3> along = {1, size_.x(),
                                          static_cast<ptrdiff_t>(size_.x()) * size_.y()};
  std::vector<uint16_t> in_ring(nearest.size(), 0);
  Cells next;
  for (int ring = 1; ring <= rings && !front.empty(); ++ring) {
    next.clear();
    for (const Eigen::Array3i& cell : front) {
      const auto flat = static_cast<ptrdiff_t>(Flat(cell));
      const int32_t element = nearest[static_cast<size_t>(flat)];
      for (int side = 0; side < 6; ++side) {
        const int axis = side / 2;
        const int step = side % 2 == 0 ? 1 : -1;
        Eigen::Array3i neighbour = cell;
        neighbour[axis] += step;
        if (neighbour[axis] < 0 || neighbour[axis] >= size_[axis]) continue;
        const auto there = static_cast<size_t>(flat + step * along[static_cast<size_t>(axis)]);
        int32_t& slot = nearest[there];
        if (slot == element) continue;
        const Eigen::Vector3f c = CentreOf(neighbour);
        if ((elements_[static_cast<size_t>(element)].centroid - c).squaredNorm() > limit) continue;
        if (!closer(element, slot, c)) continue;
        slot = element;
        if (in_ring[there] == ring) continue;
        in_ring[there] = static_cast<uint16_t>(ring);
        next.push_back(neighbour);
      }
    }
    std::swap(front, next);
  }
}

}  // namespace vantage::registration

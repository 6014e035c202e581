#include "core/site_prior/walls.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace vantage::site_prior {
namespace {

constexpr double kBelowFloor = 0.3;  // m that a floor may be taken too high by
constexpr double kMostFieldCells = 6e6;
constexpr double kBytesOfFieldCell = 24;
constexpr double kSameWay = 0.5;  // cosine

}  // namespace

Floors::Floors(const model::PlanningView& model) {
  for (const model::Station& station : model.stations()) heights_.push_back(station.floor_height);
  std::sort(heights_.begin(), heights_.end());
  heights_.erase(std::unique(heights_.begin(), heights_.end()), heights_.end());
}

std::optional<double> Floors::Under(double z) const {
  const auto above = std::upper_bound(heights_.begin(), heights_.end(), z + kBelowFloor);
  if (above == heights_.begin()) return std::nullopt;
  return *std::prev(above);
}

std::vector<WallPoint> MeasuredWalls(const model::PlanningView& model, size_t most) {
  std::vector<WallPoint> walls;
  const Floors floors(model);
  model.ForEachSurface(
      [&](const model::VoxelIndex&, model::VoxelState state, const model::SurfaceVoxel& surface) {
        if (state != model::VoxelState::kTrueSurface || !IsUpright(surface.normal)) return;
        const Eigen::Vector3d at = surface.centroid.cast<double>();
        const std::optional<double> floor = floors.Under(at.z());
        if (!floor.has_value() || at.z() < *floor + kWallsFrom || at.z() > *floor + kWallsTo)
          return;
        walls.push_back({at, surface.normal.head<2>().cast<double>().normalized(),
                         static_cast<double>(surface.area)});
      });
  const size_t stride = walls.size() / std::max<size_t>(1, most) + 1;
  if (stride == 1) return walls;
  // Their order is that of bricks, so that every n-th is spread evenly over them.
  std::vector<WallPoint> thinned;
  for (size_t i = stride / 2; i < walls.size(); i += stride) {
    thinned.push_back(walls[i]);
    thinned.back().area *= static_cast<double>(stride);
  }
  return thinned;
}

uint64_t WallField::Estimate(const Eigen::Vector3d& sizes) {
  constexpr double kCell = 0.1 * 0.1 * 0.4;  // m3, of the finest
  return static_cast<uint64_t>(kBytesOfFieldCell * std::min(sizes.prod() / kCell, kMostFieldCells));
}

WallField::WallField(const model::PlanningView& space, const Eigen::AlignedBox3d& box) {
  origin_ = box.min();
  const Eigen::Vector3d sizes = box.sizes();
  while (sizes.x() / cell_ * sizes.y() / cell_ * (sizes.z() / layer_ + 1) > kMostFieldCells) {
    cell_ *= 1.3;
  }
  size_ = {static_cast<int>(sizes.x() / cell_) + 1, static_cast<int>(sizes.y() / cell_) + 1,
           static_cast<int>(sizes.z() / layer_) + 1};
  const size_t cells = static_cast<size_t>(size_.x()) * static_cast<size_t>(size_.y()) *
                       static_cast<size_t>(size_.z());
  constexpr auto kNone = std::numeric_limits<uint32_t>::max();
  away_.assign(4 * cells, static_cast<uint8_t>(kReach * 100));
  nearest_.assign(4 * cells, kNone);
  std::vector<uint8_t> has(4 * cells, 0);
  space.ForEachSurface(
      [&](const model::VoxelIndex&, model::VoxelState, const model::SurfaceVoxel& surface) {
        if (!IsUpright(surface.normal)) return;
        const Eigen::Vector3d p = surface.centroid.cast<double>();
        const std::optional<size_t> cell = CellOf(p);
        if (!cell.has_value()) return;
        const Eigen::Vector2d normal = surface.normal.head<2>().cast<double>().normalized();
        uint8_t& own = has[4 * *cell + WayOf(normal)];
        if (own != 0) return;
        own = 1;
        points_.push_back({p, normal, cell_ * layer_});
        if (surface.ambiguous) points_.push_back({p, -normal, 0});
      });
  const int reach = static_cast<int>(std::ceil(kReach / cell_));
  for (uint32_t i = 0; i < points_.size(); ++i) {
    const Eigen::Vector3d& p = points_[i].at;
    const Eigen::Vector3i at =
        ((p - origin_).array() / Eigen::Array3d(cell_, cell_, layer_)).floor().cast<int>();
    for (int dy = -reach; dy <= reach; ++dy) {
      for (int dx = -reach; dx <= reach; ++dx) {
        const int x = at.x() + dx;
        const int y = at.y() + dy;
        if (x < 0 || y < 0 || x >= size_.x() || y >= size_.y()) continue;
        const double off = std::hypot(origin_.x() + (x + 0.5) * cell_ - p.x(),
                                      origin_.y() + (y + 0.5) * cell_ - p.y());
        if (off >= kReach) continue;
        const size_t cell = (static_cast<size_t>(at.z()) * static_cast<size_t>(size_.y()) +
                             static_cast<size_t>(y)) *
                                static_cast<size_t>(size_.x()) +
                            static_cast<size_t>(x);
        const auto cm = static_cast<uint8_t>(off * 100);
        for (size_t way = 0; way < 4; ++way) {
          const double towards = points_[i].normal[way / 2] * (way % 2 == 0 ? 1 : -1);
          if (towards < kSameWay) continue;
          const size_t to = 4 * cell + way;
          if (cm >= away_[to] && nearest_[to] != kNone) continue;
          away_[to] = cm;
          nearest_[to] = i;
        }
      }
    }
  }
}

std::optional<size_t> WallField::CellOf(const Eigen::Vector3d& p) const {
  const Eigen::Vector3i at =
      ((p - origin_).array() / Eigen::Array3d(cell_, cell_, layer_)).floor().cast<int>();
  if ((at.array() < 0).any() || (at.array() >= size_.array()).any()) return std::nullopt;
  return (static_cast<size_t>(at.z()) * static_cast<size_t>(size_.y()) +
          static_cast<size_t>(at.y())) *
             static_cast<size_t>(size_.x()) +
         static_cast<size_t>(at.x());
}

std::optional<WallField::Nearest> WallField::At(const Eigen::Vector3d& p,
                                                const Eigen::Vector2d& normal) const {
  const std::optional<size_t> cell = CellOf(p);
  if (!cell.has_value()) return std::nullopt;
  const uint32_t nearest = nearest_[4 * *cell + WayOf(normal)];
  if (nearest >= points_.size()) return std::nullopt;
  const WallPoint& wall = points_[nearest];
  const Eigen::Vector2d off = (p - wall.at).head<2>();
  return Nearest{off.dot(wall.normal), off.norm(), wall.normal};
}

}  // namespace vantage::site_prior

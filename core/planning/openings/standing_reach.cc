#include "core/planning/openings/standing_reach.h"

#include <algorithm>
#include <cmath>

#include "core/model/view/brick_key.h"

namespace vantage::planning {
namespace {

constexpr double kCell = 1.0;  // m, of the grid of places
constexpr double kSameFloor =
    0.25;  // m: heights in a cell that are one; less than a step of stairs
// Normals are told apart by a grid of so many steps from 0 to 1 on each axis: within 12 degrees.
constexpr int kNormalSteps = 4;
const double kNormalSlack = sensor::Radians(12);

int DirectionOf(const Eigen::Vector3f& normal) {
  const Eigen::Vector3i steps = (normal.array() * kNormalSteps).round().cast<int>();
  constexpr int kSide = 2 * kNormalSteps + 1;
  return (steps.x() + kNormalSteps) +
         kSide * ((steps.y() + kNormalSteps) + kSide * (steps.z() + kNormalSteps));
}

}  // namespace

std::optional<StandingReach> StandingReach::Of(const model::PlanningView& model,
                                               const FloorMap& floor,
                                               std::span<const sensor::ScannerModel> scanners,
                                               const PlanningConfig& config,
                                               const parallel::Cancellation& cancelled) {
  StandingReach reach(scanners, config);
  reach.voxel_size_ = model.voxel_size();
  const FloorColumns& columns = floor.columns();
  if (scanners.empty() || !floor.found() || columns.columns() == 0) return reach;
  const double h = model.voxel_size();
  const auto cell_of = [&](int voxel) {
    return static_cast<int>(std::floor((voxel + 0.5) * h / kCell));
  };
  const Eigen::Vector2i low = columns.Voxel(0);
  const Eigen::Vector2i high = low + columns.size() - Eigen::Vector2i::Ones();
  reach.first_ = {cell_of(low.x()), cell_of(low.y())};
  reach.size_ = Eigen::Vector2i(cell_of(high.x()), cell_of(high.y())) - reach.first_ +
                Eigen::Vector2i::Ones();
  reach.floors_.resize(static_cast<size_t>(reach.size_.x()) * static_cast<size_t>(reach.size_.y()));
  for (uint32_t column = 0; column < columns.columns(); ++column) {
    if (column % 4096 == 0 && cancelled.Requested()) return std::nullopt;
    const std::span<const Floor> here = columns.In(column);
    if (here.empty()) continue;
    const Eigen::Vector2i voxel = columns.Voxel(column);
    const Eigen::Vector2i cell =
        Eigen::Vector2i(cell_of(voxel.x()), cell_of(voxel.y())) - reach.first_;
    Heights& heights = reach.floors_[reach.Index(cell)];
    for (const Floor& one : here) {
      const bool known = std::any_of(heights.begin(), heights.end(), [&](float height) {
        return std::abs(height - one.height) < kSameFloor;
      });
      if (!known) heights.push_back(one.height);
    }
  }
  return reach;
}

// Half a cell's diagonal and half a brick's: how far a place within the cell, and a voxel within
// the brick, may be from where they are taken to be.
double StandingReach::Slack() const {
  return std::sqrt(0.5) * kCell + std::sqrt(0.75) * model::Brick::kSide * voxel_size_;
}

bool StandingReach::MeasuredFrom(const Eigen::Vector3d& place, const sensor::ScannerModel& scanner,
                                 const Eigen::Vector3d& centre, const Eigen::Vector3d& normal,
                                 double density) const {
  const Eigen::Vector3d to_place = place - centre;
  const double slack = Slack();
  const double distance = to_place.norm();
  if (distance <= 2 * slack) return true;
  const double nearest = distance - slack;
  if (nearest > scanner.range_max) return false;
  const double sine = std::min(1.0, (std::abs(to_place.z()) + slack) / nearest);
  if (scanner.SamplingDensityAtSine(sine, 1, nearest) < density) return false;
  const double incidence = std::acos(std::clamp(normal.dot(to_place) / distance, -1.0, 1.0)) -
                           std::asin(slack / distance) - kNormalSlack;
  if (incidence > scanner.max_incidence) return false;
  return scanner.SamplingDensityAtSine(sine, std::cos(std::max(incidence, 0.0)), nearest) >=
         density;
}

bool StandingReach::Search(const sensor::ScannerModel& scanner, const Eigen::Vector3d& centre,
                           const Eigen::Vector3d& normal, double density) const {
  // A scanner samples most densely overhead, but no denser over any distance in plan than over the
  // same distance at its own height.
  const double farthest = std::min(
      scanner.range_max, std::sqrt(scanner.SamplesPerSteradian(0) / std::max(density, 1e-9)));
  const int cells = static_cast<int>(std::ceil((farthest + Slack()) / kCell));
  const Eigen::Vector2i middle = Eigen::Vector2i(static_cast<int>(std::floor(centre.x() / kCell)),
                                                 static_cast<int>(std::floor(centre.y() / kCell))) -
                                 first_;
  const Eigen::Vector2i low = (middle.array() - cells).max(0).matrix();
  const Eigen::Vector2i high = (middle.array() + cells + 1).min(size_.array()).matrix();
  for (int y = low.y(); y < high.y(); ++y) {
    for (int x = low.x(); x < high.x(); ++x) {
      for (const float floor : At({x, y})) {
        for (const double height : {lowest_view_, highest_view_}) {
          const Eigen::Vector3d place((first_.x() + x + 0.5) * kCell,
                                      (first_.y() + y + 0.5) * kCell,
                                      static_cast<double>(floor) + height);
          if (MeasuredFrom(place, scanner, centre, normal, density)) return true;
        }
      }
    }
  }
  return false;
}

bool StandingReach::Has(const model::VoxelIndex& voxel, const model::SurfaceVoxel& surface,
                        double density) {
  if (floors_.empty()) return true;
  const model::VoxelIndex brick = model::Brick::Of(voxel);
  const auto [it, fresh] =
      known_.try_emplace({model::KeyOf(brick), DirectionOf(surface.normal), density}, false);
  if (fresh) {
    const Eigen::Vector3d centre =
        (brick.cast<double>().array() + 0.5) * (model::Brick::kSide * voxel_size_);
    const Eigen::Vector3d normal = surface.normal.cast<double>();
    it->second = std::any_of(scanners_.begin(), scanners_.end(), [&](const auto& scanner) {
      return Search(scanner, centre, normal, density);
    });
  }
  return it->second;
}

}  // namespace vantage::planning

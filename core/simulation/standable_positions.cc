#include "core/simulation/standable_positions.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>

namespace vantage::simulation {
namespace {

constexpr double kFloorRelief = 0.05;   // m: thresholds and rugs are walked over
constexpr double kSearchStep = 0.1;     // m
constexpr double kPassageRadius = 0.3;  // m

// A lattice over the floor.
struct FloorLattice {
  Eigen::Vector2d origin;
  double step;
  int columns, rows;

  Eigen::Vector2d At(int column, int row) const {
    return origin + step * Eigen::Vector2d(column, row);
  }
  size_t Index(int column, int row) const {
    return static_cast<size_t>(row) * static_cast<size_t>(columns) + static_cast<size_t>(column);
  }
};

FloorLattice LatticeOver(const Eigen::AlignedBox3d& bounds, double step) {
  const Eigen::Vector3d size = bounds.sizes();
  return {bounds.min().head<2>(), step, static_cast<int>(size.x() / step) + 1,
          static_cast<int>(size.y() / step) + 1};
}

}  // namespace

std::vector<Eigen::Vector3d> StandablePositions(const SimulatedScanner& tracer,
                                                const Eigen::AlignedBox3d& bounds,
                                                const Eigen::Vector3d& start, double floor_height,
                                                double height, double clearance, double spacing) {
  const double low = floor_height + kFloorRelief;
  const double high = floor_height + height;
  const auto free = [&](const Eigen::Vector2d& at, double radius) {
    if (!tracer.tracer().CylinderFree(at, radius, low, high)) return false;
    const TraceHit floor = tracer.tracer().Trace(
        Eigen::Vector3d(at.x(), at.y(), high).cast<float>(), -Eigen::Vector3f::UnitZ(), 0);
    return floor.hit && std::abs(floor.distance - height) <= kFloorRelief;
  };

  // Where the scanner can be carried to.
  const FloorLattice ways = LatticeOver(bounds, kSearchStep);
  const double passage = std::min(clearance, kPassageRadius);
  enum State : uint8_t { kUnasked, kBlocked, kReached };
  std::vector<uint8_t> state(static_cast<size_t>(ways.columns) * static_cast<size_t>(ways.rows),
                             kUnasked);
  std::deque<std::pair<int, int>> front;
  const auto reach = [&](int column, int row) {
    if (column < 0 || row < 0 || column >= ways.columns || row >= ways.rows) return;
    uint8_t& cell = state[ways.Index(column, row)];
    if (cell != kUnasked) return;
    cell = free(ways.At(column, row), passage) ? kReached : kBlocked;
    if (cell == kReached) front.emplace_back(column, row);
  };
  const Eigen::Vector2d from = (start.head<2>() - ways.origin) / kSearchStep;
  for (int dc = 0; dc <= 1; ++dc) {
    for (int dr = 0; dr <= 1; ++dr) {
      reach(static_cast<int>(std::floor(from.x())) + dc,
            static_cast<int>(std::floor(from.y())) + dr);
    }
  }
  while (!front.empty()) {
    const auto [column, row] = front.front();
    front.pop_front();
    reach(column - 1, row);
    reach(column + 1, row);
    reach(column, row - 1);
    reach(column, row + 1);
  }

  std::vector<Eigen::Vector3d> positions;
  const FloorLattice stations = LatticeOver(bounds, spacing);
  for (int row = 0; row < stations.rows; ++row) {
    for (int column = 0; column < stations.columns; ++column) {
      const Eigen::Vector2d at = stations.At(column, row);
      const Eigen::Vector2d way = (at - ways.origin) / kSearchStep;
      bool reached = false;
      for (int dc = 0; dc <= 1; ++dc) {
        for (int dr = 0; dr <= 1; ++dr) {
          const int c = static_cast<int>(std::floor(way.x())) + dc;
          const int r = static_cast<int>(std::floor(way.y())) + dr;
          reached = reached || (c >= 0 && r >= 0 && c < ways.columns && r < ways.rows &&
                                state[ways.Index(c, r)] == kReached);
        }
      }
      if (reached && free(at, clearance)) positions.emplace_back(at.x(), at.y(), high);
    }
  }
  return positions;
}

}  // namespace vantage::simulation

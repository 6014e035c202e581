#include "core/model/carve/floor_below.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

namespace vantage::model {

namespace {

// The lowest surface of a column of voxels.
struct Lowest {
  int z;                  // of the voxel
  double height;          // m, of the samples' centroid
  Eigen::Vector2d aside;  // m in plan, from the station
};

// On a slope a level is only where it cuts the ground, above or below the scanner's feet. A plane
// prevails over the level `floor` when so many times as many columns lie on it: in a room, however
// full, none does.
constexpr double kPrevails = 1.5;
constexpr double kSteepest = 0.58;  // m per m, 30 degrees: what floor is at most

FloorPlane OnASlope(const std::vector<Lowest>& columns, int level, double voxel_size,
                    const FloorPlane& floor) {
  constexpr int kRounds = 12;  // each takes in what lies on the plane through those before
  std::vector<const Lowest*> on;
  for (const Lowest& lowest : columns) {
    if (std::abs(lowest.z - level) <= 1) on.push_back(&lowest);
  }
  FloorPlane plane;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    Eigen::Vector3d heights = Eigen::Vector3d::Zero();
    for (const Lowest* lowest : on) {
      const Eigen::Vector3d at(1, lowest->aside.x(), lowest->aside.y());
      moments += at * at.transpose();
      heights += lowest->height * at;
    }
    const Eigen::LDLT<Eigen::Matrix3d> solver(moments);
    if (solver.info() != Eigen::Success || !(solver.rcond() > 1e-9)) return floor;
    const Eigen::Vector3d fit = solver.solve(heights);
    plane = {fit[0], fit.tail<2>(), 0};
    if (!(plane.rise.norm() <= kSteepest)) return floor;
    on.clear();
    for (const Lowest& lowest : columns) {
      // As far as what is in the same two or three layers of voxels.
      if (std::abs(lowest.height - plane.At(lowest.aside)) <= 1.5 * voxel_size) {
        on.push_back(&lowest);
      }
    }
    plane.columns = on.size();
  }
  return static_cast<double>(plane.columns) >= kPrevails * static_cast<double>(floor.columns)
             ? plane
             : floor;
}

std::vector<Lowest> ColumnsAround(double voxel_size, const ScanLayer& layer) {
  constexpr double kRadius = 3.0;  // m, around the station: a room's, the next one may be a step up
  constexpr double kLeastDrop = 0.3;  // m, below the viewpoint: no tripod is lower
  constexpr double kMostDrop = 2.2;   // m: surveyors' tripods reach 1.9 m, and the scanner 0.3 more
  const Eigen::Vector3d viewpoint = layer.T_model_scan.translation();
  std::map<std::pair<int, int>, Lowest> columns;
  for (const auto& [key, brick] : layer.bricks.own()) {
    size_t rank = 0;
    for (int local = 0; local < Brick::kVoxels; ++local) {
      if (!brick.surface.Has(local)) continue;
      const SurfaceSums sums = brick.sums[rank++];
      const VoxelIndex v = PlanningView::Global(BrickOf(key), local);
      const Eigen::Vector3d centre = (v.cast<double>().array() + 0.5) * voxel_size;
      if ((centre - viewpoint).head<2>().norm() > kRadius) continue;
      if (centre.z() > viewpoint.z() - kLeastDrop) continue;
      if (centre.z() < viewpoint.z() - kMostDrop - voxel_size) continue;
      const double mean = static_cast<double>(sums.point_sum[2]) / sums.points;
      const Lowest here{v.z(), (v.z() + mean / SurfaceSums::kUnits) * voxel_size,
                        (centre - viewpoint).head<2>()};
      const auto [it, fresh] = columns.try_emplace({v.x(), v.y()}, here);
      if (!fresh && here.z < it->second.z) it->second = here;
    }
  }
  std::vector<Lowest> all;
  all.reserve(columns.size());
  for (const auto& [column, lowest] : columns) all.push_back(lowest);
  return all;
}

// The level at which most columns have their lowest surface. Walls and legs of tables end there
// too, so clutter does not outvote it. Nothing where too few do.
std::optional<int> CommonLevel(const std::vector<Lowest>& columns, double voxel_size) {
  constexpr double kLeastFloor =
      0.05;  // m^2 of columns: more than a tripod's feet, or a stair's edge
  const auto least_columns =
      std::max<int64_t>(1, std::lround(kLeastFloor / (voxel_size * voxel_size)));
  std::map<int, int> count;
  for (const Lowest& lowest : columns) ++count[lowest.z];
  const auto mode = std::max_element(
      count.begin(), count.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  if (mode == count.end() || mode->second < least_columns) return std::nullopt;
  return mode->first;
}

constexpr int kSectors = 24;  // of 15 degrees: narrower than an aisle in which a tripod fits
using Sectors = std::array<const Lowest*, kSectors>;

// What comes first in each direction from the station; null where nothing does.
Sectors FirstInEach(const std::vector<Lowest>& columns) {
  Sectors first = {};
  for (const Lowest& lowest : columns) {
    const double turn = std::atan2(lowest.aside.y(), lowest.aside.x()) / (2 * M_PI) + 0.5;
    const Lowest*& here = first[static_cast<size_t>(turn * kSectors) % kSectors];
    if (here == nullptr || lowest.aside.squaredNorm() < here->aside.squaredNorm()) here = &lowest;
  }
  return first;
}

// The level that most directions show first; nothing without any.
std::optional<int> MostlyFirst(const Sectors& first) {
  std::optional<int> level;
  int most = 0;
  for (const Lowest* candidate : first) {
    if (candidate == nullptr) continue;
    const auto votes = static_cast<int>(
        std::count_if(first.begin(), first.end(), [candidate](const Lowest* other) {
          return other != nullptr && std::abs(other->z - candidate->z) <= 1;
        }));
    if (votes > most || (votes == most && candidate->z < *level)) {
      level = candidate->z;
      most = votes;
    }
  }
  return level;
}

// True when this level comes first all around, or but for one edge nearby.
bool FirstAllAround(const Sectors& first, int level) {
  constexpr int kLeastRun = 15;  // of sectors: people do not stand at a platform's very corner
  int run = 0;
  for (int i = 0; i < 2 * kSectors; ++i) {
    const Lowest* here = first[static_cast<size_t>(i % kSectors)];
    run = here != nullptr && std::abs(here->z - level) <= 1 ? run + 1 : 0;
    if (run == kLeastRun) return true;
  }
  return false;
}

// From a plinth, a dais or a landing most of what lies around is the floor further down, but what
// the scan shows first is what it stands on. Beds and low tables on both sides of a tripod come
// first as well, but not along the aisle.
std::optional<int> TripodsLevel(const std::vector<Lowest>& columns, double voxel_size,
                                double viewpoint) {
  constexpr double kLeastRaise = 0.1;    // m: less is the roughness of one floor
  constexpr double kLowestTripod = 1.0;  // m, on legs: the height of most tables stays above it
  const std::optional<int> common = CommonLevel(columns, voxel_size);
  if (!common.has_value()) return std::nullopt;
  const Sectors first = FirstInEach(columns);
  const int nearest = *MostlyFirst(first);
  if ((nearest - *common - 1) * voxel_size >= kLeastRaise &&
      viewpoint - (nearest + 0.5) * voxel_size >= kLowestTripod && FirstAllAround(first, nearest)) {
    return nearest;
  }
  return common;
}

}  // namespace

// What lies deeper than a tripod is high is not the floor that it stands on, but one beyond an
// edge: from a landing or the edge of a platform most of what a scanner sees is that. Its own floor
// may then lie in the blind cone altogether, and is not known.
std::optional<FloorPlane> FloorBelow(double voxel_size, const ScanLayer& layer) {
  const std::vector<Lowest> columns = ColumnsAround(voxel_size, layer);
  const std::optional<int> found =
      TripodsLevel(columns, voxel_size, layer.T_model_scan.translation().z());
  if (!found.has_value()) return std::nullopt;
  const int level = *found;
  double sum = 0;
  size_t votes = 0;
  for (const Lowest& lowest : columns) {
    // A floor on the border of two layers of voxels, and its noise, are in both.
    if (std::abs(lowest.z - level) > 1) continue;
    sum += lowest.height;
    ++votes;
  }
  const FloorPlane floor = {sum / static_cast<double>(votes), Eigen::Vector2d::Zero(), votes};
  return OnASlope(columns, level, voxel_size, floor);
}

}  // namespace vantage::model

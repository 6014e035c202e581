#include "core/registration/align/scanner_heights.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/container/flat_hash_set.h"

namespace vantage::registration {
namespace {

// m, of a bin of heights, whatever the voxels: floors are even, and centroids right, to a few
// centimetres, and a step is higher. The height comes from three bins, to a centimetre.
constexpr double kFloorBin = 0.10;
constexpr float kLevel = 0.95f;      // cosine to the vertical: 18 degrees, for noisy normals
constexpr double kLeastFloor = 2.0;  // m^2: larger than tables are
// m, less than storeys are apart, and more than a scanner stands over its floor: what is higher
// shows it no upper side.
constexpr double kStorey = 1.6;
// m over a floor: what lies lower is a step or a threshold, and a floor itself if it is large.
constexpr double kLeastFurniture = 0.25;
// m from a place to the floor that is known under it or beside it: a scanner at 1.5 m measures its
// floor to 4 m, at 70 degrees of incidence, and may stand a step beyond what is known.
constexpr double kFloorReach = 5.0;

// Level surface, m^2, by height and column.
struct LevelSurface {
  std::map<int, double> by_bin;
  std::map<int, absl::flat_hash_map<uint64_t, double>> by_column;  // of each bin

  static uint64_t Key(const Eigen::Vector2i& column) {
    return static_cast<uint64_t>(static_cast<uint32_t>(column.x())) << 32 |
           static_cast<uint32_t>(column.y());
  }
  static Eigen::Vector2i ColumnOf(uint64_t key) {
    return {static_cast<int>(static_cast<uint32_t>(key >> 32)),
            static_cast<int>(static_cast<uint32_t>(key))};
  }
  double At(int bin) const {
    const auto it = by_bin.find(bin);
    return it == by_bin.end() ? 0.0 : it->second;
  }
};

LevelSurface LevelSurfaceOf(const model::PlanningView& model) {
  LevelSurface level;
  model.ForEachSurface(
      [&](const model::VoxelIndex&, model::VoxelState state, const model::SurfaceVoxel& voxel) {
        if (state != model::VoxelState::kTrueSurface || voxel.normal.z() < kLevel) return;
        const int bin = static_cast<int>(std::floor(voxel.centroid.z() / kFloorBin));
        const auto area = static_cast<double>(voxel.area);
        level.by_bin[bin] += area;
        level.by_column[bin][LevelSurface::Key(
            ScannerHeight::ColumnOf(voxel.centroid.head<2>().cast<double>()))] += area;
      });
  return level;
}

struct Floor {
  double area = 0;  // m^2
  double height = 0;
  int bin = 0;
  absl::flat_hash_set<uint64_t> columns;

  bool HasBeside(const Eigen::Vector2i& column) const {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        if (columns.contains(LevelSurface::Key(column + Eigen::Vector2i(x, y)))) return true;
      }
    }
    return false;
  }
};

// Whether that column of a level at `height` is what stands on one of the floors.
bool Stands(const std::vector<Floor>& on, double height, const Eigen::Vector2i& column) {
  return std::any_of(on.begin(), on.end(), [&](const Floor& floor) {
    const double over = height - floor.height;
    return over > kLeastFurniture && over < kStorey && floor.HasBeside(column);
  });
}

// The largest first.
std::vector<Floor> Floors(const model::PlanningView& model) {
  const LevelSurface level = LevelSurfaceOf(model);
  std::vector<Floor> levels;
  for (const auto& [bin, own] : level.by_bin) {
    const double below = level.At(bin - 1);
    const double above = level.At(bin + 1);
    if (below > own || above >= own) continue;
    const double sum = below + own + above;
    if (sum < kLeastFloor) continue;
    Floor floor;
    floor.area = sum;
    floor.height = ((above - below) / sum + bin + 0.5) * kFloorBin;
    floor.bin = bin;
    levels.push_back(std::move(floor));
  }
  std::sort(levels.begin(), levels.end(), [](const Floor& a, const Floor& b) {
    return a.area != b.area ? a.area > b.area : a.bin > b.bin;
  });
  std::vector<Floor> floors;
  for (Floor& floor : levels) {
    // By column, summed in an order of its own.
    std::map<uint64_t, double> area;
    for (int bin = floor.bin - 1; bin <= floor.bin + 1; ++bin) {
      const auto it = level.by_column.find(bin);
      if (it == level.by_column.end()) continue;
      for (const auto& [column, part] : it->second) area[column] += part;
    }
    double free = 0;  // m^2 that stand on nothing
    for (const auto& [column, part] : area) {
      if (Stands(floors, floor.height, LevelSurface::ColumnOf(column))) continue;
      free += part;
      floor.columns.insert(column);
    }
    if (free >= kLeastFloor) floors.push_back(std::move(floor));
  }
  return floors;
}

}  // namespace

ScannerHeight::ScannerHeight(double z, const std::vector<Eigen::Vector2i>& columns) : z_(z) {
  if (columns.empty()) return;
  const int reach = static_cast<int>(std::ceil(kFloorReach / kColumn));
  Eigen::Array2i low = columns.front();
  Eigen::Array2i high = columns.front();
  for (const Eigen::Vector2i& column : columns) {
    low = low.min(column.array());
    high = high.max(column.array());
  }
  corner_ = low - reach;
  size_ = high - low + 1 + 2 * reach;
  near_.assign(static_cast<size_t>(size_.x()) * static_cast<size_t>(size_.y()), 0);
  const auto at = [&](int x, int y) -> char& {
    return near_[static_cast<size_t>(x) + static_cast<size_t>(size_.x()) * static_cast<size_t>(y)];
  };
  // A square around each: along x first, then along y. How far it is to the last that was met is
  // enough, from either side.
  for (const Eigen::Vector2i& column : columns) {
    at(column.x() - corner_.x(), column.y() - corner_.y()) = 1;
  }
  const auto spread = [&](int along, const auto& cell) {
    std::vector<char> wide(static_cast<size_t>(along), 0);
    int last = -2 * reach;
    for (int i = 0; i < along; ++i) {
      if (cell(i) != 0) last = i;
      if (i - last <= reach) wide[static_cast<size_t>(i)] = 1;
    }
    last = along + 2 * reach;
    for (int i = along - 1; i >= 0; --i) {
      if (cell(i) != 0) last = i;
      if (last - i <= reach) wide[static_cast<size_t>(i)] = 1;
    }
    for (int i = 0; i < along; ++i) cell(i) = wide[static_cast<size_t>(i)];
  };
  for (int y = 0; y < size_.y(); ++y) {
    spread(size_.x(), [&](int x) -> char& { return at(x, y); });
  }
  for (int x = 0; x < size_.x(); ++x) {
    spread(size_.y(), [&](int y) -> char& { return at(x, y); });
  }
}

bool ScannerHeight::FloorNear(const Eigen::Vector2d& place) const {
  const Eigen::Array2i at = ColumnOf(place).array() - corner_;
  if (near_.empty() || (at < 0).any() || (at >= size_).any()) return false;
  return near_[static_cast<size_t>(at.x()) +
               static_cast<size_t>(size_.x()) * static_cast<size_t>(at.y())] != 0;
}

std::vector<ScannerHeight> ScannerHeights(const model::PlanningView& model,
                                          const FloorPlane* floor) {
  std::vector<ScannerHeight> heights;
  if (floor != nullptr) {
    for (const Floor& known : Floors(model)) {
      std::vector<Eigen::Vector2i> columns;
      for (const uint64_t key : known.columns) columns.push_back(LevelSurface::ColumnOf(key));
      heights.emplace_back(known.height - floor->height, columns);
    }
  }
  if (!heights.empty()) return heights;
  for (const model::Station& station : model.stations()) {
    for (const double off : {-kHeightOverStation, 0.0, kHeightOverStation}) {
      const double z = station.position.z() + off;
      const bool near =
          std::any_of(heights.begin(), heights.end(), [z](const ScannerHeight& other) {
            return std::abs(other.z() - z) < 0.5 * kHeightOverStation;
          });
      if (!near) heights.emplace_back(z);
    }
  }
  return heights;
}

std::vector<size_t> HeightsAt(const std::vector<ScannerHeight>& heights,
                              const Eigen::Vector2d& place) {
  std::vector<char> near(heights.size());
  for (size_t k = 0; k < heights.size(); ++k) near[k] = heights[k].FloorNear(place) ? 1 : 0;
  std::vector<size_t> here;
  for (size_t k = 0; k < heights.size(); ++k) {
    bool other = false;  // a floor of the same storey is known there
    for (size_t j = 0; near[k] == 0 && j < heights.size(); ++j) {
      other = other || (near[j] != 0 && std::abs(heights[j].z() - heights[k].z()) < kStorey);
    }
    if (!other) here.push_back(k);
  }
  return here;
}

}  // namespace vantage::registration

#include "core/registration/align/known_surface.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "absl/container/flat_hash_map.h"
#include "core/sensor/scanner_model.h"

namespace vantage::registration {
namespace {

// Which of the six ways a normal faces, so that both sides of a board, a floor and the wall above
// it stay pieces of their own.
int SideOf(const Eigen::Vector3f& normal) {
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return 2 * axis + (normal[axis] < 0 ? 1 : 0);
}

bool Overlaps(const model::VoxelIndex& brick, const model::VoxelBox& box) {
  const model::VoxelIndex first = brick * model::Brick::kSide;
  return ((first.array() + model::Brick::kSide) > box.min.array()).all() &&
         (first.array() < box.max.array()).all();
}

// Calls fn(VoxelIndex, const SurfaceVoxel&) for the measured surface in the box, in the model's
// order.
template <typename Fn>
void ForEachMeasured(const model::PlanningView& model, const model::VoxelBox& box, Fn&& fn) {
  for (const model::BrickAt& at : model.surface_bricks()) {
    if (at.contents->surface.empty() || !Overlaps(at.brick, box)) continue;
    size_t rank = 0;
    for (size_t word = 0; word < at.contents->surface_mask.size(); ++word) {
      for (uint64_t bits = at.contents->surface_mask[word]; bits != 0; bits &= bits - 1, ++rank) {
        const int local = static_cast<int>(word) * 64 + std::countr_zero(bits);
        if (at.contents->state[static_cast<size_t>(local)] != model::VoxelState::kTrueSurface) {
          continue;
        }
        const model::VoxelIndex v = model::PlanningView::Global(at.brick, local);
        if (!box.Contains(v)) continue;
        const model::SurfaceVoxel surface = at.contents->surface[rank];
        if (surface.area > 0) fn(v, surface);
      }
    }
  }
}

struct CubeKey {
  int x, y, z, side;
  bool operator==(const CubeKey&) const = default;
  template <typename H>
  friend H AbslHashValue(H h, const CubeKey& key) {
    return H::combine(std::move(h), key.x, key.y, key.z, key.side);
  }
};

int FloorDivided(int a, int b) { return a >= 0 ? a / b : -((b - 1 - a) / b); }

// With cubes of `edge` voxels; nothing where that makes more than `most` pieces.
std::optional<std::vector<SurfacePiece>> Thin(const model::PlanningView& model,
                                              const model::VoxelBox& box, int edge, size_t most) {
  absl::flat_hash_map<CubeKey, size_t> places;
  std::vector<SurfacePiece> pieces;
  bool too_many = false;
  ForEachMeasured(model, box, [&](const model::VoxelIndex& v, const model::SurfaceVoxel& voxel) {
    if (too_many) return;
    const CubeKey key{FloorDivided(v.x(), edge), FloorDivided(v.y(), edge),
                      FloorDivided(v.z(), edge), SideOf(voxel.normal)};
    const auto [it, added] = places.emplace(key, pieces.size());
    if (added) {
      too_many = pieces.size() == most;
      if (too_many) return;
      pieces.push_back({voxel.centroid, voxel.normal, 0});
    }
    pieces[it->second].area += voxel.area;
  });
  if (too_many) return std::nullopt;
  return pieces;
}

// The cells of a range image by direction.
class CellFinder {
 public:
  explicit CellFinder(const sensor::RangeImage& image) : image_(image) {
    azimuth_step_ = Step(image.azimuth);
    elevation_step_ = Step(image.elevation);
  }

  // What the cell nearest to a direction (scanner frame) and those around it hold, the nearest
  // first: kNoInformation outside the field of view.
  std::array<float, 9> Around(const Eigen::Vector3d& direction) const {
    std::array<float, 9> found;
    found.fill(sensor::RangeImage::kNoInformation);
    const double elevation = std::atan2(direction.z(), direction.head<2>().norm());
    const double azimuth = std::atan2(direction.y(), direction.x());
    const int row = Nearest(image_.elevation, elevation, elevation_step_);
    const double first = image_.azimuth.front();
    const double turn = 2 * sensor::kPi;
    const double wrapped = azimuth - turn * std::floor((azimuth - first) / turn);
    int column = Nearest(image_.azimuth, wrapped, azimuth_step_);
    // Just before the first column is after the last.
    if (column < 0) column = Nearest(image_.azimuth, wrapped - turn, azimuth_step_);
    if (row < 0 || column < 0) return found;
    found[0] = image_.at(column, row);
    size_t next = 1;
    for (int dc = -1; dc <= 1; ++dc) {
      for (int dr = -1; dr <= 1; ++dr) {
        if (dc == 0 && dr == 0) continue;
        found[next++] = At(column + dc, row + dr);
      }
    }
    return found;
  }

 private:
  float At(int column, int row) const {
    if (row < 0 || row >= image_.rows()) return sensor::RangeImage::kNoInformation;
    if (image_.full_turn) column = (column + image_.columns()) % image_.columns();
    if (column < 0 || column >= image_.columns()) return sensor::RangeImage::kNoInformation;
    return image_.at(column, row);
  }
  static double Step(const std::vector<double>& axis) {
    return axis.size() < 2 ? sensor::kPi
                           : (axis.back() - axis.front()) / static_cast<double>(axis.size() - 1);
  }
  // -1: farther than a step from all.
  static int Nearest(const std::vector<double>& axis, double at, double step) {
    const auto above = std::lower_bound(axis.begin(), axis.end(), at);
    auto best = above == axis.end() ? above - 1 : above;
    if (best != axis.begin() && std::abs(*(best - 1) - at) < std::abs(*best - at)) --best;
    return std::abs(*best - at) <= step ? static_cast<int>(best - axis.begin()) : -1;
  }

  const sensor::RangeImage& image_;
  double azimuth_step_ = 0;
  double elevation_step_ = 0;
};

}  // namespace

KnownSurface SurfaceIn(const model::PlanningView& model, const Eigen::AlignedBox3d& box,
                       size_t most) {
  // Cubes larger than the box are eight at most, around one corner.
  constexpr size_t kLeastPieces = size_t{8} * 6;
  most = std::max(most, kLeastPieces);
  const model::VoxelBox voxels{model.At(box.min()),
                               model.At(box.max()) + model::VoxelIndex::Ones()};
  size_t count = 0;
  ForEachMeasured(model, voxels, [&](const model::VoxelIndex&, const auto&) { ++count; });
  // A cube of n voxels holds n^2 of a surface, or a little less.
  int edge = std::max(
      1, static_cast<int>(std::sqrt(static_cast<double>(count) / static_cast<double>(most))));
  while (true) {
    std::optional<std::vector<SurfacePiece>> pieces = Thin(model, voxels, edge, most);
    if (pieces.has_value()) return {*std::move(pieces), edge * model.voxel_size()};
    edge += 1 + edge / 4;
  }
}

std::vector<SurfaceSight> SightsOf(const model::PlanningView& model,
                                   std::span<const SurfacePiece> pieces, const sensor::Scan& scan,
                                   const Eigen::Isometry3d& T_world_scan,
                                   parallel::Parallel& parallel) {
  const double h = model.voxel_size();
  // As far from the surface as a sample that contradicts it (space_agreement.cc), and as far before
  // it as its own voxels may reach.
  const double apart = 2 * h;
  const double before = 2 * h;
  constexpr double kFromScanner = 0.3;  // m: nearer there is only the tripod
  // Flatter, and a ray that misses by half a step lands metres away.
  const double facing = std::max(0.3, std::cos(scan.scanner.max_incidence));
  const Eigen::Vector3d origin = T_world_scan.translation();
  const Eigen::Matrix3d to_scan = T_world_scan.linear().transpose();
  const CellFinder cells(scan.image);
  const auto clear = [&](const Eigen::Vector3d& direction, double to) {
    model::VoxelIndex last = model::VoxelIndex::Constant(INT32_MIN);
    for (double t = kFromScanner; t < to; t += 0.5 * h) {
      const model::VoxelIndex v = model.At(origin + t * direction);
      if (v == last) continue;
      last = v;
      if (!model.Empty(v)) return false;
    }
    return true;
  };
  const auto sight = [&](const SurfacePiece& piece) {
    const Eigen::Vector3d point = piece.centroid.cast<double>();
    const Eigen::Vector3d normal = piece.normal.cast<double>();
    const double distance = (point - origin).norm();
    if (distance < scan.scanner.range_min || distance > scan.scanner.range_max) {
      return SurfaceSight::kOutOfSight;
    }
    const Eigen::Vector3d direction = (point - origin) / distance;
    const double cosine = -normal.dot(direction);
    if (cosine < facing) return SurfaceSight::kOutOfSight;
    const std::array<float, 9> around = cells.Around(to_scan * direction);
    if (around[0] == sensor::RangeImage::kNoInformation) return SurfaceSight::kOutOfSight;
    if (!clear(direction, distance - before / cosine)) return SurfaceSight::kOutOfSight;
    const auto off = [&](float range) { return (static_cast<double>(range) - distance) * cosine; };
    // At an edge one ray meets the surface and its neighbour passes by.
    bool any = false;
    for (const float range : around) {
      if (!sensor::RangeImage::IsRange(range)) continue;
      if (std::abs(off(range)) <= apart) return SurfaceSight::kSeen;
      any = any || off(range) < -apart;
    }
    if (!sensor::RangeImage::IsRange(around[0])) return SurfaceSight::kNoReturn;
    return any ? SurfaceSight::kHidden : SurfaceSight::kSeenThrough;
  };
  std::vector<SurfaceSight> sights(pieces.size(), SurfaceSight::kOutOfSight);
  constexpr size_t kChunk = 512;
  parallel.For((pieces.size() + kChunk - 1) / kChunk, [&](size_t chunk) {
    const size_t end = std::min(pieces.size(), (chunk + 1) * kChunk);
    for (size_t i = chunk * kChunk; i < end; ++i) sights[i] = sight(pieces[i]);
  });
  return sights;
}

}  // namespace vantage::registration

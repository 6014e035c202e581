#include "core/visibility/brick_geometry.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace vantage::visibility {
namespace {

constexpr float kSide = model::Brick::kSide;
// Voxels: whoever comes as near as that to an opaque one touches it, and is stopped, as by faces.
// So nothing passes between two that meet in an edge, which rays along a diagonal of the lattice
// would do. What rounds off is less: positions of some thousand voxels in floats, to a
// ten-thousandth.
constexpr float kTouch = 1e-4F;

// Whether any voxel of first <= v <= last is opaque.
bool AnyOpaque(const model::BrickMask& opaque, const int (&first)[3], const int (&last)[3]) {
  const auto bits = [](int from, int to) { return (0xffu >> (7 - to)) & (0xffu << from); };
  constexpr uint64_t kRows = 0x0101010101010101;
  const uint64_t rows = kRows << (8 * first[1]) & kRows >> (8 * (7 - last[1]));
  const uint64_t wanted = rows * bits(first[0], last[0]);
  uint64_t met = 0;
  for (int z = first[2]; z <= last[2]; ++z) met |= opaque.word[static_cast<size_t>(z)];
  return (met & wanted) != 0;
}

// Whether the segment from `origin` (voxels from the brick's corner) over `direction` touches one
// of the voxels, or, with none given, the brick: Amanatides and Woo's walk (1987), which looks to
// both sides where it passes an edge. Plain numbers: they stay in registers.
bool Touches(const model::BrickMask* opaque, const float (&origin)[3],
             const float (&direction)[3]) {
  float inverse[3];
  float enters = 0;
  float leaves = 1;
  for (int a = 0; a < 3; ++a) {
    if (direction[a] == 0) {
      if (origin[a] < -kTouch || origin[a] > kSide + kTouch) return false;
      inverse[a] = std::numeric_limits<float>::infinity();
      continue;
    }
    inverse[a] = 1 / direction[a];
    const float low = (-kTouch - origin[a]) * inverse[a];
    const float high = (kSide + kTouch - origin[a]) * inverse[a];
    enters = std::max(enters, std::min(low, high));
    leaves = std::min(leaves, std::max(low, high));
  }
  if (enters > leaves) return false;
  if (opaque == nullptr) return true;
  int first[3];
  int last[3];
  for (int a = 0; a < 3; ++a) {
    const float in = origin[a] + enters * direction[a];
    const float out = origin[a] + leaves * direction[a];
    const auto clamped = [](float at) {
      return static_cast<int>(std::clamp(at, 0.0F, kSide - kTouch));
    };
    first[a] = clamped(std::min(in, out) - kTouch);
    last[a] = clamped(std::max(in, out) + kTouch);
  }
  // Most rays pass a brick where nothing is.
  if (!AnyOpaque(*opaque, first, last)) return false;
  const auto is_opaque = [&](int x, int y, int z) {
    return (opaque->word[static_cast<size_t>(z)] >> (x + 8 * y) & 1) != 0;
  };
  int voxel[3];
  int step[3];
  float next[3];   // share of the segment at which each axis crosses its next face
  float touch[3];  // share of the segment in which it comes as near as that to a face
  for (int a = 0; a < 3; ++a) {
    const bool up = direction[a] > 0;
    step[a] = up ? 1 : -1;
    // At a face: in the voxel before it, so that the one behind is met at once.
    voxel[a] = up ? first[a] : last[a];
    const auto face = static_cast<float>(voxel[a] + (up ? 1 : 0));
    next[a] = direction[a] == 0 ? inverse[a] : (face - origin[a]) * inverse[a];
    inverse[a] = std::abs(inverse[a]);
    touch[a] = direction[a] == 0 ? 0 : kTouch * inverse[a];
  }
  if (is_opaque(voxel[0], voxel[1], voxel[2])) return true;
  while (true) {
    const int axis = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
    const float now = next[axis];
    if (now > leaves) return false;
    // At an edge the voxel to the other side, at a corner all around it.
    int beside[3] = {voxel[0], voxel[1], voxel[2]};
    int touched = 0;
    for (int other = 0; other < 3; ++other) {
      if (other == axis || next[other] - now > touch[other]) continue;
      beside[other] = voxel[other] + step[other];
      if ((beside[other] & ~7) != 0) {
        beside[other] = voxel[other];
        continue;
      }
      ++touched;
      const int x = other == 0 ? beside[0] : voxel[0];
      const int y = other == 1 ? beside[1] : voxel[1];
      const int z = other == 2 ? beside[2] : voxel[2];
      if (is_opaque(x, y, z)) return true;
    }
    if (touched == 2 && is_opaque(beside[0], beside[1], beside[2])) return true;
    voxel[axis] += step[axis];
    if ((voxel[axis] & ~7) != 0) return false;
    if (is_opaque(voxel[0], voxel[1], voxel[2])) return true;
    next[axis] += inverse[axis];
  }
}

const OpaqueBrick& BrickOf(void* bricks, unsigned index) {
  return static_cast<const OpaqueBrick*>(bricks)[index];
}

// The smallest box that holds its opaque voxels.
Eigen::AlignedBox3i BoundsOf(const OpaqueBrick& brick) {
  if (brick.opaque == nullptr) {
    return {brick.corner, (brick.corner.array() + model::Brick::kSide).matrix()};
  }
  Eigen::AlignedBox3i bounds;
  brick.opaque->ForEach([&](int local) {
    const Eigen::Vector3i at(local & 7, local >> 3 & 7, local >> 6);
    bounds.extend(brick.corner + at);
    bounds.extend(brick.corner + at + Eigen::Vector3i::Ones());
  });
  return bounds;
}

void WriteBounds(const RTCBoundsFunctionArguments* of) {
  const Eigen::AlignedBox3i bounds = BoundsOf(BrickOf(of->geometryUserPtr, of->primID));
  of->bounds_o->lower_x = static_cast<float>(bounds.min().x()) - kTouch;
  of->bounds_o->lower_y = static_cast<float>(bounds.min().y()) - kTouch;
  of->bounds_o->lower_z = static_cast<float>(bounds.min().z()) - kTouch;
  of->bounds_o->upper_x = static_cast<float>(bounds.max().x()) + kTouch;
  of->bounds_o->upper_y = static_cast<float>(bounds.max().y()) + kTouch;
  of->bounds_o->upper_z = static_cast<float>(bounds.max().z()) + kTouch;
}

// A ray that is stopped ends before it begins: so Embree is told.
void StopRays(const RTCOccludedFunctionNArguments* at) {
  const OpaqueBrick& brick = BrickOf(at->geometryUserPtr, at->primID);
  RTCRayN* const rays = at->ray;
  const unsigned count = at->N;
  // Differences of numbers that floats hold exactly, so that what is far from the scene's corner is
  // told as well as what is near.
  const float origin[3] = {RTCRayN_org_x(rays, count, 0) - static_cast<float>(brick.corner.x()),
                           RTCRayN_org_y(rays, count, 0) - static_cast<float>(brick.corner.y()),
                           RTCRayN_org_z(rays, count, 0) - static_cast<float>(brick.corner.z())};
  for (unsigned i = 0; i < count; ++i) {
    if (at->valid[i] == 0) continue;
    const float direction[3] = {RTCRayN_dir_x(rays, count, i), RTCRayN_dir_y(rays, count, i),
                                RTCRayN_dir_z(rays, count, i)};
    if (Touches(brick.opaque, origin, direction)) {
      RTCRayN_tfar(rays, count, i) = -std::numeric_limits<float>::infinity();
    }
  }
}

// Finds a page's bricks.
class PageBricks {
 public:
  explicit PageBricks(const OpaqueGrid& grid) : grid_(grid) {}

  void Add(const model::VoxelIndex& at, std::vector<OpaqueBrick>& bricks) const {
    const model::BrickPage& page = grid_.Page(at);
    if (page.all_empty() || (page.all_opaque() && !BesideAnyEmpty(at))) return;
    for (int local = 0; local < model::Brick::kVoxels; ++local) {
      if (!page.with_opaque().Has(local)) continue;
      const model::VoxelIndex brick =
          at * model::BrickPage::kSide + model::VoxelIndex(local & 7, local >> 3 & 7, local >> 6);
      const bool mixed = page.with_empty().Has(local);
      if (!mixed && !HasEmptyNeighbour(brick)) continue;
      bricks.push_back(
          {mixed ? &page.Opaque(local) : nullptr, brick * model::Brick::kSide - grid_.box().min});
    }
  }

 private:
  // Calls fn with the six neighbours, until it returns true.
  template <typename Fn>
  static bool AnyNeighbour(const model::VoxelIndex& at, Fn&& fn) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const int side : {-1, 1}) {
        model::VoxelIndex beside = at;
        beside[axis] += side;
        if (fn(beside)) return true;
      }
    }
    return false;
  }
  bool BesideAnyEmpty(const model::VoxelIndex& page) const {
    return AnyNeighbour(
        page, [&](const model::VoxelIndex& beside) { return !grid_.Page(beside).all_opaque(); });
  }
  bool HasEmptyNeighbour(const model::VoxelIndex& brick) const {
    return AnyNeighbour(brick, [&](const model::VoxelIndex& beside) {
      return grid_.Page(model::BrickPage::Of(beside))
          .with_empty()
          .Has(model::Brick::LocalOf(beside));
    });
  }

  const OpaqueGrid& grid_;
};

}  // namespace

std::vector<OpaqueBrick> FindOpaqueBricks(const OpaqueGrid& grid, parallel::Parallel& parallel,
                                          const parallel::Cancellation& cancelled) {
  std::vector<OpaqueBrick> bricks;
  if (grid.box().empty()) return bricks;
  const auto page_of = [](const model::VoxelIndex& v) {
    return model::BrickPage::Of(model::Brick::Of(v));
  };
  const model::VoxelIndex first = page_of(grid.box().min);
  const model::VoxelIndex last = page_of(grid.box().max - model::VoxelIndex::Ones());
  // By rows of pages along x, so that there is work for every thread in a flat site, too.
  const auto across = static_cast<size_t>(last.y() - first.y() + 1);
  std::vector<std::vector<OpaqueBrick>> rows(across *
                                             static_cast<size_t>(last.z() - first.z() + 1));
  const PageBricks pages(grid);
  parallel.For(rows.size(), [&](size_t row) {
    model::VoxelIndex at = first + model::VoxelIndex(0, static_cast<int>(row % across),
                                                     static_cast<int>(row / across));
    for (; at.x() <= last.x() && !cancelled.Requested(); ++at.x()) pages.Add(at, rows[row]);
  });
  size_t count = 0;
  for (const std::vector<OpaqueBrick>& row : rows) count += row.size();
  bricks.reserve(count);
  for (const std::vector<OpaqueBrick>& row : rows) {
    bricks.insert(bricks.end(), row.begin(), row.end());
  }
  return bricks;
}

RTCGeometry BrickGeometry(RTCDevice device, const std::vector<OpaqueBrick>& bricks) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(bricks.size()));
  // Embree hands it back without const; nobody writes to it.
  rtcSetGeometryUserData(geometry, const_cast<OpaqueBrick*>(bricks.data()));
  rtcSetGeometryBoundsFunction(geometry, WriteBounds, nullptr);
  rtcSetGeometryOccludedFunction(geometry, StopRays);
  return geometry;
}

}  // namespace vantage::visibility

#include "core/visibility/shaft.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace vantage::visibility {
namespace {

constexpr double kMargin = 1e-3;     // voxels
constexpr int kMostQueries = 64;     // of layers across one axis
constexpr int kFewVoxels = 64;       // are looked at one by one
constexpr int kMostSubdivision = 9;  // of a shaft's length: 512 slabs

// Linear in the coordinate along the axis.
struct Line {
  double at = 0;     // at the first layer's plane
  double slope = 0;  // per layer
  double operator()(int layer) const { return at + slope * layer; }
};

// Where segments cross the planes of layers, on one of the other two axes: the lower bound is the
// lesser of two lines, the upper one the greater of two.
struct Crossing {
  std::array<Line, 2> low;
  std::array<Line, 2> high;

  // Of the segment between the middles of the boxes.
  static Line Middle(const Eigen::AlignedBox3d& from, const Eigen::AlignedBox3d& to, int b,
                     int axis, double plane) {
    const auto middle = [](const Eigen::AlignedBox3d& box, int a) {
      return 0.5 * (box.min()[a] + box.max()[a]);
    };
    const double slope =
        (middle(to, b) - middle(from, b)) / (middle(to, axis) - middle(from, axis));
    return {middle(from, b) + slope * (plane - middle(from, axis)), slope};
  }
};

// The other two axes.
constexpr std::array<int, 2> Across(int axis) { return {axis == 0 ? 1 : 0, axis == 2 ? 1 : 2}; }

// The voxel of a layer across `kAxis`, by its coordinates on the other two.
template <int kAxis>
Eigen::Vector3i InLayer(int layer, int u, int v) {
  if constexpr (kAxis == 0) return {layer, u, v};
  if constexpr (kAxis == 1) return {u, layer, v};
  return {u, v, layer};
}

template <int kAxis>
bool OpaqueInLayer(OpaqueGrid::Walk& walk, int layer, int u, int v) {
  if constexpr (kAxis == 0) return walk.OpaqueAt(layer, u, v);
  if constexpr (kAxis == 1) return walk.OpaqueAt(u, layer, v);
  return walk.OpaqueAt(u, v, layer);
}

// For each axis a function of its own, so that the coordinates of voxels stay in registers: this is
// the innermost loop of step D.
template <int kAxis>
Hidden OcclusionAcross(const OpaqueGrid& grid, const Eigen::AlignedBox3d& from,
                       const Eigen::AlignedBox3d& to) {
  const Eigen::Vector3i size = grid.box().max - grid.box().min;
  const double from0 = from.min()[kAxis];
  const double from1 = from.max()[kAxis];
  const double to0 = to.min()[kAxis];
  const double to1 = to.max()[kAxis];
  // Layers whose middle plane lies strictly between the boxes.
  const int first = static_cast<int>(std::floor(from1 + 0.5 + kMargin));
  const int layers = static_cast<int>(std::ceil(to0 - 0.5 - kMargin)) - first;
  if (layers <= 0 || first < 0 || first + layers > size[kAxis]) return Hidden::kNone;

  constexpr std::array<int, 2> across = Across(kAxis);
  const double plane = first + 0.5;
  // A segment crosses a plane at the share (plane - from) / (to - from) of its length, which falls
  // with either end's coordinate.
  const Line least{(plane - from1) / (to1 - from1), 1 / (to1 - from1)};
  const Line most{(plane - from0) / (to0 - from0), 1 / (to0 - from0)};
  std::array<Crossing, 2> crossing;
  for (size_t i = 0; i < 2; ++i) {
    const int b = across[i];
    const auto line = [](double begin, double end, const Line& share, double margin) {
      return Line{begin + share.at * (end - begin) + margin, share.slope * (end - begin)};
    };
    const double low = from.min()[b];
    const double low_end = to.min()[b];
    const double high = from.max()[b];
    const double high_end = to.max()[b];
    crossing[i].low = {line(low, low_end, least, -kMargin), line(low, low_end, most, -kMargin)};
    crossing[i].high = {line(high, high_end, least, kMargin), line(high, high_end, most, kMargin)};
  }

  // Only layers that stop the segment between the middles can be opaque wherever one crosses.
  const std::array<Line, 2> middle = {Crossing::Middle(from, to, across[0], kAxis, plane),
                                      Crossing::Middle(from, to, across[1], kAxis, plane)};
  OpaqueGrid::Walk walk(grid);
  int queries = 0;
  for (int layer = 0; layer < layers && queries < kMostQueries; ++layer) {
    const int at = first + layer;
    const int u = static_cast<int>(middle[0](layer));
    const int v = static_cast<int>(middle[1](layer));
    if (!OpaqueInLayer<kAxis>(walk, at, u, v)) continue;
    ++queries;
    std::array<int, 2> low;
    std::array<int, 2> high;
    for (size_t i = 0; i < 2; ++i) {
      const auto& [lower, upper] = crossing[i];
      low[i] =
          std::max(0, static_cast<int>(std::floor(std::min(lower[0](layer), lower[1](layer)))));
      high[i] =
          std::min(size[across[i]],
                   static_cast<int>(std::floor(std::max(upper[0](layer), upper[1](layer)))) + 1);
    }
    if (grid.AllOpaque(InLayer<kAxis>(at, low[0], low[1]),
                       InLayer<kAxis>(at + 1, high[0], high[1]))) {
      return Hidden::kAll;
    }
  }
  return queries > 0 ? Hidden::kMaybe : Hidden::kNone;
}

// The same where the boxes are apart along the axis; the crossings are the same from either end.
template <int kAxis>
Hidden OcclusionAlong(const OpaqueGrid& grid, const Eigen::AlignedBox3d& views,
                      const Eigen::AlignedBox3d& targets) {
  if (views.max()[kAxis] < targets.min()[kAxis]) {
    return OcclusionAcross<kAxis>(grid, views, targets);
  }
  if (targets.max()[kAxis] < views.min()[kAxis]) {
    return OcclusionAcross<kAxis>(grid, targets, views);
  }
  return Hidden::kNone;
}

}  // namespace

Hidden Occlusion(const OpaqueGrid& grid, const Eigen::AlignedBox3d& views,
                 const Eigen::AlignedBox3d& targets) {
  Hidden hidden = OcclusionAlong<0>(grid, views, targets);
  if (hidden != Hidden::kAll) hidden = std::max(hidden, OcclusionAlong<1>(grid, views, targets));
  if (hidden != Hidden::kAll) hidden = std::max(hidden, OcclusionAlong<2>(grid, views, targets));
  return hidden;
}

bool EntirelyVisible(const OpaqueGrid& grid, const Eigen::AlignedBox3d& views,
                     const Eigen::AlignedBox3d& targets) {
  // The hull of two boxes is the union of their sections (1 - s) V + s T, which are boxes.
  const Eigen::Vector3d low0 = views.min().array() - kMargin;
  const Eigen::Vector3d high0 = views.max().array() + kMargin;
  const Eigen::Vector3d low_slope = targets.min() - views.min();
  const Eigen::Vector3d high_slope = targets.max() - views.max();
  const Eigen::Vector3i size = grid.box().max - grid.box().min;
  const auto all_empty = [&](const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                             Eigen::Vector3i& first, Eigen::Vector3i& end) {
    for (int a = 0; a < 3; ++a) {
      if (!(low[a] >= 0) || !(high[a] < size[a])) return false;  // all is opaque outside
      first[a] = static_cast<int>(low[a]);
      end[a] = static_cast<int>(high[a]) + 1;
    }
    return grid.AllEmpty(first, end);
  };
  OpaqueGrid::Walk walk(grid);
  struct Slab {
    double begin, end;
    int level;
  };
  std::array<Slab, kMostSubdivision + 2> stack;
  size_t depth = 0;
  stack[depth++] = {0, 1, 0};
  while (depth > 0) {
    const Slab slab = stack[--depth];
    const double middle = (slab.begin + slab.end) / 2;
    Eigen::Vector3i first;
    Eigen::Vector3i end;
    // Fails soonest where something stands in a section.
    if (!all_empty(low0 + middle * low_slope, high0 + middle * high_slope, first, end)) {
      return false;
    }
    const Eigen::Vector3d low =
        (low0 + slab.begin * low_slope).cwiseMin(low0 + slab.end * low_slope);
    const Eigen::Vector3d high =
        (high0 + slab.begin * high_slope).cwiseMax(high0 + slab.end * high_slope);
    if (all_empty(low, high, first, end)) continue;
    if ((end - first).prod() > kFewVoxels) {
      if (slab.level == kMostSubdivision) return false;
      stack[depth++] = {slab.begin, middle, slab.level + 1};
      stack[depth++] = {middle, slab.end, slab.level + 1};
      continue;
    }
    for (int z = first.z(); z < end.z(); ++z) {
      for (int y = first.y(); y < end.y(); ++y) {
        for (int x = first.x(); x < end.x(); ++x) {
          if (!walk.OpaqueAt(x, y, z)) continue;
          const Eigen::Vector3i voxel(x, y, z);
          // The sections that touch the voxel, axis by axis, are an interval.
          double begin = slab.begin;
          double until = slab.end;
          const auto limit = [&](double at, double slope) {  // at + s slope >= 0
            if (slope > 0) {
              begin = std::max(begin, -at / slope);
            } else if (slope < 0) {
              until = std::min(until, -at / slope);
            } else if (at < 0) {
              until = -1;
            }
          };
          for (int a = 0; a < 3; ++a) {
            limit(voxel[a] + 1 - low0[a], -low_slope[a]);
            limit(high0[a] - voxel[a], high_slope[a]);
          }
          if (begin <= until) return false;
        }
      }
    }
  }
  return true;
}

}  // namespace vantage::visibility

#include "core/model/reflections/suspects.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "core/model/reflections/mirror_fit.h"
#include "core/model/reflections/reflection_regions.h"
#include "core/model/scan/scan_planes.h"

namespace vantage::model {
namespace {

struct RegionIn {
  const ReflectingPlane* plane;
  const SuspectedRegion* region;
};

// A suspect of whose returns some are asked, spread over the region: those that would tell.
SuspectedReflector MakeSuspect(const RangeSurface& surface, const RegionIn& found) {
  constexpr size_t kAsked = 400;      // a share of them is off by 2.5 %, one sigma
  constexpr size_t kLookedAt = 2000;  // for them: where a fifth tells, they are as many
  const ReturnTest tester(surface);
  const ReflectingPlane& plane = *found.plane;
  const std::vector<ScanCell>& cells = found.region->cells;
  std::vector<ScanCell> telling;
  const size_t looked_at = std::min(kLookedAt, cells.size());
  for (size_t i = 0; i < looked_at; ++i) {
    const ScanCell& cell = cells[i * cells.size() / looked_at];
    if (tester.WellBehind(plane, cell.column, cell.row) &&
        tester.Telling(plane, cell.column, cell.row)) {
      telling.push_back(cell);
    }
  }
  SuspectedReflector suspect{plane, {}, ApertureOf(surface, plane, cells), found.region->wall};
  const size_t asked = std::min(kAsked, telling.size());
  for (size_t i = 0; i < asked; ++i) {
    suspect.asked.push_back(telling[i * telling.size() / asked]);
  }
  return suspect;
}

// The connected parts of what lies behind a wall, by every `stride`-th column and row; each as
// points.
std::vector<std::vector<Eigen::Vector3d>> PartsBehind(const RangeSurface& surface,
                                                      const ReturnTest& tester,
                                                      const ScanPlane& wall, int stride) {
  const int columns = (surface.columns() + stride - 1) / stride;
  const int rows = (surface.rows() + stride - 1) / stride;
  const auto index = [rows](int c, int r) {
    return static_cast<size_t>(c) * static_cast<size_t>(rows) + static_cast<size_t>(r);
  };
  std::vector<uint8_t> behind(static_cast<size_t>(columns) * static_cast<size_t>(rows), 0);
  for (int c = 0; c < columns; ++c) {
    for (int r = 0; r < rows; ++r) {
      if (!surface.Returned(c * stride, r * stride)) continue;
      const Eigen::Vector3d point = tester.Point(c * stride, r * stride);
      behind[index(c, r)] = wall.Above(point) < -tester.WellBehind() ? 1 : 0;
    }
  }
  std::vector<std::vector<Eigen::Vector3d>> parts;
  for (int c0 = 0; c0 < columns; ++c0) {
    for (int r0 = 0; r0 < rows; ++r0) {
      if (behind[index(c0, r0)] == 0) continue;
      std::vector<ScanCell> part = {{c0, r0}};
      behind[index(c0, r0)] = 0;
      for (size_t i = 0; i < part.size(); ++i) {
        const ScanCell at = part[i];
        for (const auto& [dc, dr] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
          int c = at.column + dc;
          const int r = at.row + dr;
          if (surface.azimuth().closed()) c = (c + columns) % columns;
          if (c < 0 || c >= columns || r < 0 || r >= rows || behind[index(c, r)] == 0) continue;
          behind[index(c, r)] = 0;
          part.push_back({c, r});
        }
      }
      std::vector<Eigen::Vector3d>& points = parts.emplace_back();
      points.reserve(part.size());
      for (const ScanCell& at : part) {
        points.push_back(tester.Point(at.column * stride, at.row * stride));
      }
    }
  }
  return parts;
}

struct PlaneOfPart {
  ReflectingPlane plane;
  Hangs hangs;
  size_t cells;  // of the part, that were looked at
};

// Planes before a wall, up to as far as furniture stands out from it, that each reflect most of one
// connected part of what lies behind the wall: mirrors are doors of wardrobes, too.
std::vector<PlaneOfPart> BeforeWall(const RangeSurface& surface, const ReturnTest& tester,
                                    const ScanPlane& wall, int stride) {
  constexpr size_t kLeastPoints = 8;  // a degree or more apart: as of reflection_regions.cc
  constexpr double kDeepest = 0.75;   // m: wardrobes are 0.6 m deep, and stand off their wall
  constexpr double kStep = 0.03;      // m: half the agreement, since it counts twice
  constexpr double kFurniture = 0.3;  // m: no opening lies so far before its wall
  std::vector<PlaneOfPart> found;
  if (!ReflectingPlane{wall.normal, wall.distance}.IsUpright()) return found;
  for (const std::vector<Eigen::Vector3d>& part : PartsBehind(surface, tester, wall, stride)) {
    if (part.size() < kLeastPoints) continue;
    const size_t skip = (part.size() + kTested - 1) / kTested;
    std::vector<Eigen::Vector3d> points;
    for (size_t i = 0; i < part.size(); i += skip) points.push_back(part[i]);
    const std::array<MirrorWitness, 1> own = {{{&tester}}};
    std::optional<ReflectingPlane> best;
    size_t most = points.size() / 3;
    for (double before = 0; before <= kDeepest; before += kStep) {
      const ReflectingPlane plane{wall.normal, wall.distance - before, tester.Behind()};
      if (plane.distance < kNearestReflector) break;
      const size_t agree = ComeBack(own, plane, points, tester.Agreement());
      if (agree <= most) continue;
      most = agree;
      best = plane;
    }
    if (!best) continue;
    ReflectingPlane straight = Straighten(own, *best, points);
    ReflectingPlane fitted = Fit(tester, straight, points);
    const Hangs hangs =
        wall.distance - best->distance > kFurniture ? Hangs::kOnFurniture : Hangs::kOnWall;
    for (ReflectingPlane* mirror : {&fitted, &straight}) {
      StartPastItsWall({wall}, points, *mirror);
      found.push_back({*mirror, hangs, part.size()});
    }
  }
  return found;
}

// The planes that are looked at: those that reflect parts behind walls, the largest part first, and
// `untold`.
std::vector<PlaneOfPart> PlanesToLookAt(const RangeSurface& surface,
                                        const std::vector<ReflectingPlane>& untold, int stride,
                                        parallel::Parallel& parallel) {
  constexpr size_t kMost = 48;  // each costs a look at the whole scan
  const std::vector<ScanPlane> walls = FindScanPlanes(surface, kMostPlanes, parallel);
  const ReturnTest tester(surface);
  std::vector<std::vector<PlaneOfPart>> by_wall(walls.size());
  parallel.For(walls.size(),
               [&](size_t i) { by_wall[i] = BeforeWall(surface, tester, walls[i], stride); });
  std::vector<PlaneOfPart> of_parts;
  for (const std::vector<PlaneOfPart>& some : by_wall) {
    of_parts.insert(of_parts.end(), some.begin(), some.end());
  }
  std::stable_sort(of_parts.begin(), of_parts.end(),
                   [](const PlaneOfPart& a, const PlaneOfPart& b) { return a.cells > b.cells; });
  std::vector<PlaneOfPart> planes;
  const auto add = [&planes](const PlaneOfPart& of_part) {
    const ReflectingPlane& plane = of_part.plane;
    // One and a half of Straighten()'s steps: 0.36 degrees and 1.5 cm.
    const auto same = [&plane](const PlaneOfPart& other) {
      return other.plane.normal.dot(plane.normal) > 0.99998 &&
             std::abs(other.plane.distance - plane.distance) < 0.015;
    };
    if (planes.size() < kMost && plane.IsUpright() &&
        std::none_of(planes.begin(), planes.end(), same)) {
      planes.push_back(of_part);
    }
  };
  for (const PlaneOfPart& of_part : of_parts) add(of_part);
  for (const ReflectingPlane& plane : untold) add({plane, Hangs::kOnWall, 0});
  return planes;
}

}  // namespace

std::vector<SuspectedReflector> FindSuspects(const RangeSurface& surface,
                                             const std::vector<ReflectingPlane>& untold,
                                             parallel::Parallel& parallel) {
  constexpr size_t kMostSuspects = 8;  // of a scan: each is asked of all others
  const int stride = StrideOf(surface, kCoarse);
  const int fine = StrideOf(surface, kFine);
  const std::vector<PlaneOfPart> planes = PlanesToLookAt(surface, untold, stride, parallel);
  std::vector<std::vector<SuspectedRegion>> regions(planes.size());
  parallel.For(planes.size(), [&](size_t i) {
    if (!MayHaveReflections(surface, planes[i].plane, stride)) return;
    regions[i] = FindSuspectedReflections(surface, planes[i].plane, fine, planes[i].hangs);
  });
  std::vector<RegionIn> found;
  for (size_t i = 0; i < planes.size(); ++i) {
    for (const SuspectedRegion& region : regions[i]) found.push_back({&planes[i].plane, &region});
  }
  std::stable_sort(found.begin(), found.end(), [](const RegionIn& a, const RegionIn& b) {
    return a.region->cells.size() > b.region->cells.size();
  });
  std::vector<SuspectedReflector> suspects;
  for (const RegionIn& one : found) {
    if (suspects.size() >= kMostSuspects) break;
    SuspectedReflector suspect = MakeSuspect(surface, one);
    if (suspect.asked.size() >= kLeastAsked) suspects.push_back(std::move(suspect));
  }
  return suspects;
}

}  // namespace vantage::model

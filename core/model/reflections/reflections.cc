#include "core/model/reflections/reflections.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "core/model/reflections/mirror_fit.h"
#include "core/model/reflections/reflected_return.h"
#include "core/model/reflections/reflection_regions.h"
#include "core/model/reflections/suspects.h"
#include "core/model/scan/scan_planes.h"

namespace vantage::model {
namespace {

constexpr double kDisplaced = 0.3;  // cosine to its normal: reflecting turns the surface
constexpr size_t kMostJudged = 16;  // candidates: each costs a look at the whole scan

// The plane that reflects `from` into `to`, if it is upright and in front of the scanner. A
// reflecting floor is found by its own measured surface.
std::optional<ReflectingPlane> Between(const ReturnTest& tester, const ScanPlane& from,
                                       const ScanPlane& to) {
  const Eigen::Vector3d turn = to.normal - from.normal;
  const double length = turn.norm();
  if (length < 2 * kDisplaced) return std::nullopt;
  const ReflectingPlane plane{turn / length, (to.distance - from.distance) / length,
                              tester.Behind()};
  if (plane.distance < kNearestReflector || !plane.IsUpright()) return std::nullopt;
  return plane;
}

// By least squares and by steps: the likelier one is judged, and where it tells nothing, what the
// other shows may be suspected as well.
struct PlaneOnWall {
  ReflectingPlane plane;
  std::optional<ReflectingPlane> other;
};

// The plane, among a measured one and those up to a decimetre in front of it, that reflects most of
// the points behind it onto measured surface. A mirror hangs on its wall, with a frame.
std::optional<PlaneOnWall> OnWall(const ReturnTest& tester, const ScanPlane& wall,
                                  const std::vector<ScanCell>& sample) {
  // Cells, a degree or more apart; this many are two tenths of a square metre two metres away.
  constexpr size_t kEnough = 20;
  constexpr size_t kMost = 400;   // that are looked at: a share of them is off by 2.5 %, one sigma
  constexpr double kStep = 0.01;  // m: a sixth of the agreement, and it counts twice
  constexpr int kSteps = 10;      // to nearly ReflectingPlane::kProud
  const ReflectingPlane itself{wall.normal, wall.distance, tester.Behind()};
  if (!itself.IsUpright() && !itself.IsLevel()) return std::nullopt;
  std::vector<Eigen::Vector3d> behind;
  for (const ScanCell& cell : sample) {
    const Eigen::Vector3d point = tester.Point(cell.column, cell.row);
    if (wall.Above(point) < -tester.WellBehind()) behind.push_back(point);
  }
  if (behind.size() < kEnough) return std::nullopt;
  const size_t skip = std::max<size_t>(1, behind.size() / kMost);
  std::vector<Eigen::Vector3d> looked_at;
  for (size_t i = 0; i < behind.size(); i += skip) looked_at.push_back(behind[i]);
  const std::array<MirrorWitness, 1> own = {{{&tester}}};
  std::optional<ReflectingPlane> best;
  size_t most = kEnough / 2;
  for (int before = 0; before <= kSteps; ++before) {
    const ReflectingPlane plane{wall.normal, wall.distance - kStep * before, tester.Behind()};
    if (plane.distance < kNearestReflector) break;
    const size_t agree = ComeBack(own, plane, looked_at, tester.Agreement());
    if (agree <= most) continue;
    most = agree;
    best = plane;
  }
  if (!best) return std::nullopt;
  if (!best->IsUpright()) return PlaneOnWall{*best, std::nullopt};
  ReflectingPlane straight = Straighten(own, *best, looked_at);
  ReflectingPlane fitted = Fit(tester, straight, looked_at);
  // Steps go where most come back by chance, too; where a tenth fewer do, least squares went
  // astray.
  const bool astray = 10 * ComeBack(own, fitted, looked_at, tester.Closely()) <
                      9 * ComeBack(own, straight, looked_at, tester.Closely());
  StartPastItsWall({wall}, looked_at, straight);
  StartPastItsWall({wall}, looked_at, fitted);
  return astray ? PlaneOnWall{straight, fitted} : PlaneOnWall{fitted, straight};
}

// The share of the sampled cells that agree, less the share that contradicts; 0 below one half.
double Support(const ReturnTest& tester, const ReflectingPlane& plane,
               const std::vector<ScanCell>& cells) {
  const size_t stride = std::max<size_t>(1, cells.size() / kTested);
  double agree = 0;
  double contradict = 0;
  double behind = 0;
  for (size_t i = 0; i < cells.size(); i += stride) {
    const Back back = tester.Test(plane, cells[i].column, cells[i].row);
    behind += back == Back::kInFront ? 0 : 1;
    agree += back == Back::kAgrees ? 1 : 0;
    contradict += back == Back::kContradicts ? 1 : 0;
  }
  // Of a share of fewer cells nothing can be said; a fifth that contradicts is furniture moved or a
  // plane that is half a degree off, and more is no reflection.
  constexpr double kFewest = 8;          // cells, of kTested
  constexpr double kMostContrary = 0.2;  // share of what lies behind the plane
  if (behind < kFewest || 2 * agree < behind || contradict / behind > kMostContrary) return 0;
  return agree - contradict;
}

// True when returns from behind the plane are right beside its own in many places. A polished floor
// returns some rays itself and reflects others, ray by ray whatever their step; so `beside` counts
// rays and is no length.
bool HasScattered(const RangeSurface& surface, const ScanPlane& plane) {
  const ReturnTest tester(surface);
  const ReflectingPlane itself{plane.normal, plane.distance, tester.Behind()};
  constexpr int kBeside = 2;         // rays, to all sides
  constexpr size_t kManyPlaces = 8;  // cells that are well behind: half of them is off by 18 %
  constexpr int kSide = 2 * kBeside + 1;
  size_t scattered = 0;
  size_t agree = 0;
  for (const ScanCell& cell : plane.cells) {
    for (int k = 0; k < kSide * kSide; ++k) {
      const int c = cell.column + k % kSide - kBeside;
      const int r = cell.row + k / kSide - kBeside;
      if (c < 0 || c >= surface.columns() || r < 0 || r >= surface.rows()) continue;
      const Back back = tester.Test(itself, c, r);
      if (back == Back::kInFront || !tester.WellBehind(itself, c, r)) continue;
      ++scattered;
      agree += back == Back::kAgrees ? 1 : 0;
    }
  }
  return scattered >= kManyPlaces && 2 * agree > scattered;
}

struct Candidate {
  double support;
  ReflectingPlane plane;
  bool scattered;  // its regions may be too ragged for the coarse judgement
  std::optional<ReflectingPlane> other = std::nullopt;  // as PlaneOnWall::other
};

// The best score comes first.
std::vector<Candidate> FindCandidates(const RangeSurface& surface, int stride,
                                      parallel::Parallel& parallel) {
  const std::vector<ScanPlane> planes = FindScanPlanes(surface, kMostPlanes, parallel);
  const ReturnTest tester(surface);
  std::vector<ScanCell> sample;
  for (int c = 0; c < surface.columns(); c += stride) {
    for (int r = 0; r < surface.rows(); r += stride) {
      if (surface.Returned(c, r)) sample.push_back({c, r});
    }
  }
  std::vector<std::vector<Candidate>> by_plane(planes.size());
  parallel.For(planes.size(), [&](size_t i) {
    const ScanPlane& plane = planes[i];
    std::vector<Candidate>& candidates = by_plane[i];
    const ReflectingPlane itself{plane.normal, plane.distance, tester.Behind()};
    if (HasScattered(surface, plane)) {
      constexpr double kBeforeAllOthers = 1e6;
      candidates.push_back({kBeforeAllOthers * plane.area, itself, true});
    }
    if (const std::optional<PlaneOnWall> on_wall = OnWall(tester, plane, sample)) {
      candidates.push_back({plane.area, on_wall->plane, false, on_wall->other});
    }
    for (const ScanPlane& other : planes) {
      std::optional<ReflectingPlane> between = Between(tester, plane, other);
      if (!between) continue;
      const double support = Support(tester, *between, other.cells);
      if (support <= 0) continue;
      StartPastItsWall(planes, tester.Points(other.cells), *between);
      candidates.push_back({support * other.area, *between, false});
    }
  });
  std::vector<Candidate> candidates;
  for (const std::vector<Candidate>& some : by_plane) {
    candidates.insert(candidates.end(), some.begin(), some.end());
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.support > b.support; });
  return candidates;
}

// Two candidates for one mirror: both are straightened from within so much of it (Straighten).
bool Same(const ReflectingPlane& a, const ReflectingPlane& b) {
  constexpr double kSameNormal = 0.998;   // cosine: 3.6 degrees; two mirrors meet at 90
  constexpr double kSameDistance = 0.05;  // m: mirrors of one wall that differ by less are one
  return a.normal.dot(b.normal) > kSameNormal && std::abs(a.distance - b.distance) < kSameDistance;
}

// The likeliest candidates that differ.
std::vector<Candidate> FindJudged(const RangeSurface& surface, int stride,
                                  parallel::Parallel& parallel) {
  std::vector<Candidate> judged;
  for (const Candidate& candidate : FindCandidates(surface, stride, parallel)) {
    if (judged.size() >= kMostJudged) break;
    if (std::none_of(judged.begin(), judged.end(),
                     [&](const Candidate& j) { return Same(j.plane, candidate.plane); })) {
      judged.push_back(candidate);
    }
  }
  return judged;
}

// Which candidates reflect, and the cells of their reflections, whose rays are ended.
std::vector<std::vector<ScanCell>> EndReflectionsIn(const std::vector<Candidate>& judged,
                                                    OpenRangeSurface& surface,
                                                    parallel::Parallel& parallel) {
  const int stride = StrideOf(surface, kCoarse);
  const int fine = StrideOf(surface, kFine);
  std::vector<std::vector<ScanCell>> reflections(judged.size());
  parallel.For(judged.size(), [&](size_t i) {
    // Candidates are judged coarsely first, since most do not reflect.
    const ReflectingPlane& plane = judged[i].plane;
    if (!judged[i].scattered && !HasReflections(surface, plane, stride)) return;
    reflections[i] = FindReflections(surface, plane, fine);
  });
  absl::flat_hash_map<std::pair<int, int>, double> ends;  // column and row to range, m
  for (size_t i = 0; i < judged.size(); ++i) {
    // A ray that met two reflectors ended at the first.
    const ReflectingPlane& plane = judged[i].plane;
    for (const ScanCell& cell : reflections[i]) {
      const double towards = -plane.normal.dot(surface.Direction(cell.column, cell.row));
      const auto [it, fresh] = ends.try_emplace({cell.column, cell.row}, plane.distance / towards);
      if (!fresh) it->second = std::min(it->second, plane.distance / towards);
    }
  }
  for (const auto& [cell, range] : ends) {
    surface.EndAt(cell.first, cell.second, static_cast<float>(range));
  }
  return reflections;
}

std::vector<Reflector> MakeReflectors(const RangeSurface& surface,
                                      const std::vector<Candidate>& judged,
                                      const std::vector<std::vector<ScanCell>>& reflections) {
  std::vector<Reflector> reflectors;
  for (size_t i = 0; i < judged.size(); ++i) {
    const ReflectingPlane& plane = judged[i].plane;
    if (reflections[i].empty()) continue;
    reflectors.push_back({plane.normal, plane.distance, reflections[i].size(),
                          ApertureOf(surface, plane, reflections[i])});
  }
  return reflectors;
}

}  // namespace

std::vector<Reflector> EndReflections(OpenRangeSurface& surface, parallel::Parallel& parallel) {
  const std::vector<Candidate> judged = FindJudged(surface, StrideOf(surface, kCoarse), parallel);
  return MakeReflectors(surface, judged, EndReflectionsIn(judged, surface, parallel));
}

Reflections EndAndSuspectReflections(OpenRangeSurface& surface, parallel::Parallel& parallel) {
  const std::vector<Candidate> judged = FindJudged(surface, StrideOf(surface, kCoarse), parallel);
  const std::vector<std::vector<ScanCell>> told = EndReflectionsIn(judged, surface, parallel);
  std::vector<ReflectingPlane> untold;
  for (size_t i = 0; i < judged.size(); ++i) {
    if (!told[i].empty()) continue;
    untold.push_back(judged[i].plane);
    if (judged[i].other) untold.push_back(*judged[i].other);
  }
  return {MakeReflectors(surface, judged, told), FindSuspects(surface, untold, parallel)};
}

}  // namespace vantage::model

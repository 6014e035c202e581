#include "core/planning/ranking/rank_views.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "core/visibility/voxel_walk.h"

namespace vantage::planning {
namespace {

constexpr double kAsGood = 0.95;
constexpr double kSameFacing = sensor::Radians(10.001);  // as far as a person misses a heading
constexpr size_t kMostPatches = 5;
constexpr double kWallReach = 20.0;  // m
constexpr int kWallRays = 72;        // around the horizon
constexpr int kWallSupport = 3;      // rays that must meet a plane for it to be a wall
constexpr float kWallTilt = 0.3f;    // |nz| of a wall at most
constexpr double kOneWall = 3;       // voxels, between planes of one wall

const char* AxisName(const Eigen::Vector3d& direction) {
  if (std::abs(direction.x()) >= std::abs(direction.y())) {
    return direction.x() >= 0 ? "+x" : "-x";
  }
  return direction.y() >= 0 ? "+y" : "-y";
}

// A plane that several horizontal rays meet.
struct Wall {
  WallOffset offset;
  int support = 0;
};

// What is measured where a ray from `position` along a unit vector leaves what is known to be
// empty.
std::optional<model::SurfaceVoxel> SurfaceTowards(const model::PlanningView& model,
                                                  const Eigen::Vector3d& position,
                                                  const Eigen::Vector3d& direction) {
  const double h = model.voxel_size();
  std::optional<model::SurfaceVoxel> hit;
  visibility::WalkVoxels(position / h, (position + kWallReach * direction) / h,
                         [&](const model::VoxelIndex& v, double) {
                           if (model.Empty(v)) return true;
                           if (model.State(v) == model::VoxelState::kTrueSurface) {
                             hit = model.Surface(v);
                           }
                           return false;
                         });
  return hit;
}

// Whether a tape along the offset ends at the wall: its plane may be met beside its end, in a
// doorway.
bool TapeEndsAt(const model::PlanningView& model, const Eigen::Vector3d& position,
                const WallOffset& offset) {
  const auto hit = SurfaceTowards(model, position, -offset.wall_normal);
  return hit.has_value() &&
         std::abs(offset.wall_normal.dot(position - hit->centroid.cast<double>()) -
                  offset.distance) < kOneWall * model.voxel_size();
}

// The walls that are visible at the height of `position`, in the order of the rays.
std::vector<Wall> WallsAround(const model::PlanningView& model, const Eigen::Vector3d& position) {
  std::vector<Wall> walls;
  const double h = model.voxel_size();
  for (int i = 0; i < kWallRays; ++i) {
    const double azimuth = 2 * sensor::kPi * i / kWallRays;
    const auto hit =
        SurfaceTowards(model, position, Eigen::Vector3d(std::cos(azimuth), std::sin(azimuth), 0));
    if (!hit.has_value() || std::abs(hit->normal.z()) > kWallTilt) continue;
    Eigen::Vector3d normal = hit->normal.cast<double>();
    normal.z() = 0;
    normal.normalize();
    const Eigen::Vector3d point = hit->centroid.cast<double>();
    const double distance = normal.dot(position - point);
    if (distance <= 0) continue;
    const auto same = std::find_if(walls.begin(), walls.end(), [&](const Wall& wall) {
      return wall.offset.wall_normal.dot(normal) > 0.95 &&
             std::abs(wall.offset.distance - distance) < kOneWall * h;
    });
    if (same != walls.end()) {
      ++same->support;
    } else {
      walls.push_back({{point, normal, distance}, 1});
    }
  }
  return walls;
}

}  // namespace

std::vector<uint32_t> RankViews(const Evaluation& evaluation, const FeasibleViews& feasible,
                                double separation, size_t count, std::span<const uint32_t> others,
                                absl::FunctionRef<bool(uint32_t)> eligible) {
  std::vector<uint32_t> ranked;
  for (const uint32_t i : ByScore(evaluation)) {
    if (ranked.size() >= count) break;
    // Ranks are scores less their errors, so a view that gains nothing may rank before some that
    // gain.
    if (evaluation.views[i].score <= 0 || !eligible(i)) continue;
    const Eigen::Vector3d at = feasible.Centre(i);
    const auto near = [&](uint32_t j) { return (feasible.Centre(j) - at).norm() < separation; };
    if (std::none_of(ranked.begin(), ranked.end(), near) &&
        std::none_of(others.begin(), others.end(), near)) {
      ranked.push_back(i);
    }
  }
  return ranked;
}

namespace {

// The cells around `view` that `alike` holds for.
EquivalentRegion RegionAround(const FeasibleViews& feasible, uint32_t view,
                              absl::FunctionRef<bool(uint32_t)> alike) {
  std::vector<uint32_t> members{view};
  std::vector<uint8_t> taken(feasible.cells().size(), 0);
  taken[view] = 1;
  EquivalentRegion region;
  for (size_t head = 0; head < members.size(); ++head) {
    const FeasibleViews::CellIndex& cell = feasible.cells()[members[head]];
    const Eigen::Vector3d low = cell.cast<double>() * feasible.cell_size();
    region.box.extend(low);
    region.box.extend(Eigen::Vector3d(low.array() + feasible.cell_size()));
    for (int axis = 0; axis < 3; ++axis) {
      for (const int side : {-1, 1}) {
        FeasibleViews::CellIndex to = cell;
        to[axis] += side;
        const int i = feasible.IndexOf(to);
        if (i < 0 || taken[static_cast<size_t>(i)]) continue;
        if (!alike(static_cast<uint32_t>(i))) continue;
        taken[static_cast<size_t>(i)] = 1;
        members.push_back(static_cast<uint32_t>(i));
      }
    }
  }
  region.viewcell_count = static_cast<int>(members.size());
  region.volume = region.viewcell_count * std::pow(feasible.cell_size(), 3);
  return region;
}

}  // namespace

EquivalentRegion EquivalentRegionOf(const Evaluation& evaluation, const FeasibleViews& feasible,
                                    uint32_t view) {
  const double enough = kAsGood * evaluation.views[view].score;
  return RegionAround(feasible, view, [&](uint32_t i) {
    const ViewEstimate& estimate = evaluation.views[i];
    return estimate.scored && estimate.score >= enough;
  });
}

EquivalentRegion EquivalentRegionOf(const Evaluation& evaluation, const FeasibleViews& feasible,
                                    uint32_t view, const Headings& headings, size_t heading,
                                    double score) {
  return RegionAround(feasible, view, [&](uint32_t i) {
    const ViewEstimate& estimate = evaluation.views[i];
    const double turned = headings.Angle(estimate.heading) - headings.Angle(heading);
    return estimate.scored && estimate.score >= kAsGood * score &&
           std::abs(std::remainder(turned, 2 * sensor::kPi)) < kSameFacing;
  });
}

EquivalentRegion RegionOfCell(const FeasibleViews& feasible, const FeasibleViews::CellIndex& cell) {
  const Eigen::Vector3d low = cell.cast<double>() * feasible.cell_size();
  EquivalentRegion region;
  region.box = Region(low, Eigen::Vector3d(low.array() + feasible.cell_size()));
  region.volume = region.box.volume();
  region.viewcell_count = 1;
  return region;
}

LocationDescription DescribeLocation(const PlanningProblem& problem, const RankedView& view) {
  const model::PlanningView& model = problem.model();
  LocationDescription location;
  std::vector<std::string> parts;
  if (view.storey.has_value() && problem.feasible().floor().storeys().count() > 1) {
    parts.push_back(absl::StrCat("on ", view.storey->Words()));
  }
  if (!model.stations().empty()) {
    const Eigen::Vector2d offset =
        view.position.head<2>() - model.stations().back().position.head<2>();
    const double distance = offset.norm();
    const double bearing = std::atan2(offset.y(), offset.x());
    location.last_station_distance = distance;
    location.last_station_bearing = bearing;
    parts.push_back(absl::StrFormat("%.2f m from %s at a bearing of %.0f degrees from +x", distance,
                                    kLastStation, sensor::Degrees(bearing)));
  }
  // First the wall that most rays meet, then the best one across it.
  const std::vector<Wall> walls = WallsAround(model, view.position);
  const auto best = [&](const WallOffset* other) {
    const Wall* found = nullptr;
    for (const Wall& wall : walls) {
      if (wall.support < kWallSupport || !TapeEndsAt(model, view.position, wall.offset)) continue;
      if (other != nullptr && std::abs(wall.offset.wall_normal.dot(other->wall_normal)) > 0.5) {
        continue;
      }
      if (found == nullptr || wall.support > found->support) found = &wall;
    }
    return found;
  };
  if (const Wall* first = best(nullptr); first != nullptr) {
    location.walls.push_back(first->offset);
    if (const Wall* second = best(&location.walls.front()); second != nullptr) {
      location.walls.push_back(second->offset);
    }
  }
  for (const WallOffset& wall : location.walls) {
    parts.push_back(absl::StrFormat("%.2f m from the wall on its %s side", wall.distance,
                                    AxisName(-wall.wall_normal)));
  }
  if (view.storey.has_value()) {
    parts.push_back(absl::StrFormat("tripod height %.2f m", view.height_over_floor));
    if (!view.floor_measured) parts.emplace_back("the floor below was not measured");
  } else {
    parts.emplace_back("no floor is known below");
  }
  if (view.heading.has_value()) {
    parts.push_back(absl::StrFormat("facing a bearing of %.0f degrees from +x",
                                    sensor::Degrees(*view.heading)));
  }
  location.description = absl::StrJoin(parts, "; ");
  return location;
}

double FaceHeading(const Headings& headings, const sensor::ScannerModel& scanner,
                   const CellArrays& cells, std::span<float> cell_scores, RankedView& view) {
  const std::vector<double> by_heading = SumByHeading(headings, view.position, cells, cell_scores);
  view.score_by_heading.assign(by_heading.begin(), by_heading.end());
  if (!view.heading.has_value()) view.heading = headings.Angle(BestOf(by_heading).heading);
  return KeepSector(Sector(scanner, view.heading), view.position, cells, cell_scores);
}

void SplitScore(const CellArrays& cells, std::span<const float> cell_scores,
                const PatchSet& patches, RankedView& view) {
  view.score_by_kind.fill(0);
  std::vector<double> patch_scores(patches.patches.size(), 0);
  for (size_t i = 0; i < cells.size(); ++i) {
    if (cell_scores[i] <= 0) continue;
    // Patches own their cells side by side, in order.
    const auto patch = std::partition_point(
        patches.patches.begin(), patches.patches.end(),
        [&](const Patch& other) { return other.cells.back() < cells.cell[i]; });
    view.score_by_kind[static_cast<size_t>(patch->kind)] += static_cast<double>(cell_scores[i]);
    patch_scores[static_cast<size_t>(patch - patches.patches.begin())] +=
        static_cast<double>(cell_scores[i]);
  }
  std::vector<PatchScore> by_patch;
  for (size_t k = 0; k < patch_scores.size(); ++k) {
    if (patch_scores[k] > 0) by_patch.push_back({static_cast<int>(k), patch_scores[k]});
  }
  std::stable_sort(by_patch.begin(), by_patch.end(),
                   [](const PatchScore& a, const PatchScore& b) { return a.score > b.score; });
  by_patch.resize(std::min(by_patch.size(), kMostPatches));
  view.patch_scores = by_patch;
}

}  // namespace vantage::planning

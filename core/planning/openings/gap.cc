#include "core/planning/openings/gap.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/planning/feasibility/floor_pieces.h"
#include "core/planning/openings/wall_distance.h"

namespace vantage::planning {
namespace {

// Widths of what people call a doorway or a passage, m: from what somebody squeezes through
// sideways to a double door. What is wider has no sides that belong together.
constexpr double kNarrowestGap = 0.40;
constexpr double kWidestGap = 2.6;
constexpr double kJambReach = 0.3;  // m around its nearest column in which a jamb's edge is sought
// Cosine of the angle at which the two jambs are seen from between them, at most: 120 degrees.
constexpr double kOppositeJambs = -0.5;
// Of what lies between the jambs, that must be known to be empty: through a doorway that is seen at
// a grazing angle, no more is.
constexpr double kSeenThrough = 0.25;
// m to either side of the line between the jambs in which the face of their wall is looked for:
// from along it hardly more of the jambs is measured than their edges.
constexpr double kWithinTheWall = 0.1;
// A jamb is wall when it goes on upwards to near the ceiling, where no furniture does. In metres
// below the ceiling: the band that is looked at, and the share of its layers that must be measured.
constexpr double kWallTop = 0.15;
constexpr double kWallBand = 0.4;
constexpr double kWallShare = 0.3;
constexpr double kWallReach = 0.35;  // m from the middle of a reveal to the face of its wall
// Where no wall is over a gap, walls have to recede on both sides of it, straight ahead: so far
// from the middle, and so far from the nearest wall there, in halves of its width. In a corridor
// they recede by 1.2 at most, where doors are.
constexpr double kRecedeWithin = 3;
constexpr double kRecede = 1.8;
// Between a threshold and the section, a column through which somebody can walk is known to be
// empty: from here on, m over the floor, in this share of the layers.
constexpr double kBodyLow = 0.3;
constexpr double kFreeToWalk = 0.75;
constexpr double kHighest = 6.0;       // m over the floor; a higher ceiling is as good as none
constexpr double kFloorReach = 0.45;   // m from the middle of a gap, to both sides
constexpr double kCeilingReach = 0.8;  // m around the middle of a gap
constexpr double kCeilingStep = 0.1;   // m, between the places there whose ceiling is looked at
// m around a place: what walls and thresholds are uneven, and a column that was not measured.
constexpr double kFloorBeside = 0.1;
constexpr double kWallBeside = 0.05;

// Columns that make a length (m), at least one.
int ColumnsIn(double length, double voxel) {
  return std::max(1, static_cast<int>(std::lround(length / voxel)));
}

}  // namespace

model::VoxelIndex GapFinder::Voxel(uint32_t column, double over_floor) const {
  const Eigen::Vector2i at = floor_.columns().Voxel(column);
  const double z = static_cast<double>(section_.FloorHeight(column)) + over_floor;
  return {at.x(), at.y(), static_cast<int>(std::floor(z / model_.voxel_size()))};
}

// The nearest solid column, and the nearest one on the opposite side; then, around both, the two
// that are nearest to each other.
std::optional<std::pair<Eigen::Vector2i, Eigen::Vector2i>> GapFinder::Jambs(uint32_t cell,
                                                                            int32_t squared) const {
  const Eigen::Vector2i at = section_.At(cell);
  const double voxel = model_.voxel_size();
  const int most = static_cast<int>(std::ceil(kWidestGap / voxel));
  const int nearest = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(squared))));
  std::optional<Eigen::Vector2i> first;
  for (int y = -nearest; y <= nearest && !first.has_value(); ++y) {
    for (int x = -nearest; x <= nearest && !first.has_value(); ++x) {
      if (x * x + y * y == squared && Solid(at + Eigen::Vector2i(x, y))) first.emplace(x, y);
    }
  }
  if (!first.has_value()) return std::nullopt;
  std::optional<Eigen::Vector2i> second;
  for (int y = -most; y <= most; ++y) {
    for (int x = -most; x <= most; ++x) {
      const Eigen::Vector2i to(x, y);
      if (second.has_value() && to.squaredNorm() >= second->squaredNorm()) continue;
      if (!Solid(at + to)) continue;
      const double cosine = to.cast<double>().normalized().dot(first->cast<double>().normalized());
      if (cosine <= kOppositeJambs) second = to;
    }
  }
  if (!second.has_value()) return std::nullopt;
  const int reach = static_cast<int>(std::lround(kJambReach / voxel));
  std::vector<Eigen::Vector2i> sides[2];
  for (int y = -reach; y <= reach; ++y) {
    for (int x = -reach; x <= reach; ++x) {
      const Eigen::Vector2i off(x, y);
      if (Solid(at + *first + off)) sides[0].push_back(at + *first + off);
      if (Solid(at + *second + off)) sides[1].push_back(at + *second + off);
    }
  }
  std::pair<Eigen::Vector2i, Eigen::Vector2i> jambs(at + *first, at + *second);
  const auto apart = [](const auto& a, const auto& b) { return (a - b).squaredNorm(); };
  for (const Eigen::Vector2i& a : sides[0]) {
    for (const Eigen::Vector2i& b : sides[1]) {
      // Only pairs that the middle of the narrow place lies between.
      if ((a - at).dot(b - at) >= 0) continue;
      if (apart(a, b) < apart(jambs.first, jambs.second)) jambs = {a, b};
    }
  }
  return jambs;
}

// The columns on the straight line from a to b, ends included.
std::vector<uint32_t> GapFinder::Between(const Eigen::Vector2d& a, const Eigen::Vector2d& b) const {
  std::vector<uint32_t> between;
  const int steps = std::max(1, static_cast<int>(std::ceil((b - a).norm())));
  for (int i = 0; i <= steps; ++i) {
    const Eigen::Vector2d p = a + (b - a) * i / steps;
    const Eigen::Vector2i at = p.array().round().cast<int>();
    if (section_.Inside(at)) between.push_back(section_.Column(at));
  }
  return between;
}

bool GapFinder::Measured(uint32_t column, double over_floor) const {
  const model::VoxelState state = model_.State(Voxel(column, over_floor));
  return state == model::VoxelState::kTrueSurface || state == model::VoxelState::kAbsorbed;
}

bool GapFinder::EndsInWall(const Eigen::Vector2d& end, const Eigen::Vector2d& outward) const {
  constexpr int kWithin = 2;  // columns: jambs are no straighter than that
  for (int i = 0; i <= kWithin; ++i) {
    if (Solid((end + outward * i).array().round().cast<int>().matrix())) return true;
  }
  return false;
}

std::optional<double> GapFinder::LowestOver(uint32_t column) const {
  const double voxel = model_.voxel_size();
  for (double height = kSectionHigh; height < kHighest; height += voxel) {
    if (Measured(column, height)) return height;
  }
  return std::nullopt;
}

std::optional<double> GapFinder::CeilingAround(const Eigen::Vector2d& at) const {
  const int reach = static_cast<int>(std::lround(kCeilingReach / model_.voxel_size()));
  const int step = ColumnsIn(kCeilingStep, model_.voxel_size());
  const Eigen::Vector2i middle = at.array().round().cast<int>();
  std::vector<double> heights;
  for (int y = -reach; y <= reach; y += step) {
    for (int x = -reach; x <= reach; x += step) {
      const Eigen::Vector2i near = middle + Eigen::Vector2i(x, y);
      if (!Free(near)) continue;
      if (const auto height = LowestOver(section_.Column(near)); height.has_value()) {
        heights.push_back(*height);
      }
    }
  }
  if (heights.empty()) return std::nullopt;
  const auto median = heights.begin() + static_cast<ptrdiff_t>(heights.size() / 2);
  std::nth_element(heights.begin(), median, heights.end());
  return *median;
}

double GapFinder::SillIn(uint32_t column) const {
  const double voxel = model_.voxel_size();
  // The first voxels over the floor count as floor.
  for (double height = kSectionLow; height > 2 * voxel; height -= voxel) {
    if (Measured(column, height)) return height + voxel;
  }
  return 0;
}

// A reveal may not be measured over the lintel; the faces of its wall are.
bool GapFinder::IsWall(const Eigen::Vector2d& jamb, const Eigen::Vector2d& across,
                       double ceiling) const {
  const double voxel = model_.voxel_size();
  const double low = std::max(kSectionHigh, ceiling - kWallTop - kWallBand);
  const int layers = std::max(
      1, static_cast<int>(std::lround((std::max(ceiling - kWallTop, low + voxel) - low) / voxel)));
  const int beside = ColumnsIn(kWallBeside, voxel);
  for (double t = -kWallReach; t <= kWallReach; t += voxel) {
    const Eigen::Vector2i middle = (jamb + across * (t / voxel)).array().round().cast<int>();
    for (int y = -beside; y <= beside; ++y) {
      for (int x = -beside; x <= beside; ++x) {
        const Eigen::Vector2i at = middle + Eigen::Vector2i(x, y);
        if (!section_.Inside(at)) continue;
        int measured = 0;
        for (int i = 0; i < layers; ++i) {
          measured += Measured(section_.Column(at), low + i * voxel) ? 1 : 0;
        }
        if (measured >= kWallShare * layers) return true;
      }
    }
  }
  return false;
}

bool GapFinder::Recedes(const Gap& gap, const Eigen::Vector2d& out,
                        const std::vector<int32_t>& squared) const {
  const double half = 0.5 * (gap.other_jamb - gap.jamb).norm();
  double widest = 0;
  for (double t = 0; t <= kRecedeWithin * half; t += 1) {
    const Eigen::Vector2i at = (gap.middle() + out * t).array().round().cast<int>();
    if (!Free(at)) continue;
    widest = std::max(widest, std::sqrt(static_cast<double>(squared[section_.Column(at)])));
  }
  return widest >= kRecede * half;
}

bool GapFinder::FreeBelow(uint32_t column) const {
  const double voxel = model_.voxel_size();
  int empty = 0;
  int layers = 0;
  for (double height = kBodyLow; height < kSectionLow; height += voxel, ++layers) {
    empty += model_.Empty(Voxel(column, height)) ? 1 : 0;
  }
  return empty >= kFreeToWalk * layers;
}

bool GapFinder::FloorKnownNear(const Eigen::Vector2d& at) const {
  const Eigen::Vector2i middle = at.array().round().cast<int>();
  const int beside = ColumnsIn(kFloorBeside, model_.voxel_size());
  for (int y = -beside; y <= beside; ++y) {
    for (int x = -beside; x <= beside; ++x) {
      const Eigen::Vector2i near = middle + Eigen::Vector2i(x, y);
      if (section_.Inside(near) && section_.HasFloor(section_.Column(near))) return true;
    }
  }
  return false;
}

Narrow GapFinder::Measure(const NarrowPlace& narrow, const std::vector<int32_t>& squared, Gap& gap,
                          Seen seen) const {
  if (squared[narrow.cell] == kNoWall) return Narrow::kSpace;
  const auto jambs = Jambs(narrow.cell, squared[narrow.cell]);
  if (!jambs.has_value()) return Narrow::kSpace;
  const double voxel = model_.voxel_size();
  gap.jamb = jambs->first.cast<double>();
  gap.other_jamb = jambs->second.cast<double>();
  const double width = (gap.jamb - gap.other_jamb).norm() * voxel;
  if (width < kNarrowestGap) return Narrow::kCrack;
  if (width > kWidestGap) return Narrow::kSpace;

  const Eigen::Vector2d along = (gap.other_jamb - gap.jamb).normalized();
  const Eigen::Vector2d across(-along.y(), along.x());
  std::vector<uint32_t> open;
  double share = 0;
  const int reach = seen == Seen::kAlongAFace ? ColumnsIn(kWithinTheWall, voxel) : 0;
  for (int i = 0; i <= 2 * reach && share < kSeenThrough; ++i) {
    const Eigen::Vector2d off = across * (i % 2 == 0 ? i / 2 : -(i + 1) / 2);
    // Before a wall all is free, also where the wall itself returned nothing.
    if (i > 0 && !(EndsInWall(gap.jamb + off, -along) && EndsInWall(gap.other_jamb + off, along))) {
      continue;
    }
    const std::vector<uint32_t> between = Between(gap.jamb + off, gap.other_jamb + off);
    open.clear();
    for (const uint32_t column : between) {
      if (section_.State(column) == SectionState::kFree) open.push_back(column);
    }
    share =
        static_cast<double>(open.size()) / static_cast<double>(std::max<size_t>(1, between.size()));
  }
  if (share < kSeenThrough) return Narrow::kSpace;
  // The middle half of what is open, where the frame stands least in the way.
  const auto from_middle = [&](uint32_t column) {
    return (section_.At(column).cast<double>() - gap.middle()).squaredNorm();
  };
  std::stable_sort(open.begin(), open.end(),
                   [&](uint32_t a, uint32_t b) { return from_middle(a) < from_middle(b); });
  open.resize(std::max<size_t>(1, open.size() / 2));

  const std::optional<double> ceiling = CeilingAround(gap.middle());
  if (!ceiling.has_value() || !IsWall(gap.jamb, across, *ceiling) ||
      !IsWall(gap.other_jamb, across, *ceiling)) {
    return Narrow::kSpace;
  }
  // With wall over it, it is a doorway or a window. Without, it may be a stretch of a corridor.
  gap.lintel = IsWall(gap.middle(), across, *ceiling);
  if (!gap.lintel && !(Recedes(gap, across, squared) && Recedes(gap, -across, squared))) {
    return Narrow::kSpace;
  }
  std::vector<double> heads;
  gap.sill = std::numeric_limits<double>::infinity();
  size_t walkable = 0;
  for (const uint32_t column : open) {
    walkable += FreeBelow(column) ? 1 : 0;
    gap.sill = std::min(gap.sill, SillIn(column));
    heads.push_back(LowestOver(column).value_or(*ceiling));
  }
  const auto median = heads.begin() + static_cast<ptrdiff_t>(heads.size() / 2);
  std::nth_element(heads.begin(), median, heads.end());
  gap.head = *median;
  bool floor_known = false;
  for (const double away : {-kFloorReach, 0.0, kFloorReach}) {
    floor_known = floor_known || FloorKnownNear(gap.middle() + across * (away / voxel));
  }
  gap.floor = section_.FloorHeight(open.front());
  gap.floor_through =
      floor_known && gap.sill <= kMaxStep &&
      static_cast<double>(walkable) >= kSeenThrough * static_cast<double>(open.size());
  if (gap.floor_through) gap.sill = 0;
  return Narrow::kGap;
}

}  // namespace vantage::planning

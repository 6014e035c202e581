#include "core/planning/openings/glimpses.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/planning/openings/basins.h"
#include "core/planning/openings/wall_distance.h"
#include "core/planning/plan/opening.h"

namespace vantage::planning {
namespace {

// Widths of doorways that people go through, m. Gaps of other kinds, such as the shadows of things
// before a wall, are mostly narrower or wider.
constexpr double kNarrowest = 0.5;
constexpr double kWidest = 1.6;
// How far free space is taken to go on, m, and how far before and behind a doorway is looked at
// what is known: twice as thick as the walls of most rooms, a third as deep as most rooms.
constexpr double kBeyond = 0.6;
// Of the columns straight before and straight behind it, more of one side and less of the other.
constexpr double kFreeOfGlimpse = 0.5;

// The section with a margin on all sides, in rows along x.
class Surroundings {
 public:
  Surroundings(const StoreySection& section, int margin)
      : section_(section),
        margin_(margin),
        size_(section.size().array() + 2 * margin),
        state_(static_cast<size_t>(size_.x()) * static_cast<size_t>(size_.y()),
               SectionState::kUnknown) {
    for (uint32_t column = 0; column < section.columns(); ++column) {
      const Eigen::Vector2i at = section.At(column).array() + margin;
      state_[static_cast<size_t>(at.x()) +
             static_cast<size_t>(size_.x()) * static_cast<size_t>(at.y())] = section.State(column);
    }
  }

  const Eigen::Vector2i& size() const { return size_; }
  std::vector<uint8_t> Marked(SectionState state) const {
    std::vector<uint8_t> marked(state_.size());
    for (size_t i = 0; i < state_.size(); ++i) marked[i] = state_[i] == state;
    return marked;
  }
  // What is free, and the unknown up to `steps` away from it.
  std::vector<uint8_t> FreeAndOn(int steps) const {
    std::vector<uint8_t> free = Marked(SectionState::kFree);
    std::vector<size_t> front;
    for (size_t i = 0; i < free.size(); ++i) {
      if (free[i] != 0) front.push_back(i);
    }
    const auto width = static_cast<size_t>(size_.x());
    std::vector<size_t> next;
    const auto visit = [&](size_t i) {
      if (free[i] != 0 || state_[i] != SectionState::kUnknown) return;
      free[i] = 1;
      next.push_back(i);
    };
    for (int step = 0; step < steps; ++step) {
      next.clear();
      for (const size_t i : front) {
        if (i % width > 0) visit(i - 1);
        if (i % width + 1 < width) visit(i + 1);
        if (i >= width) visit(i - width);
        if (i + width < free.size()) visit(i + width);
      }
      std::swap(front, next);
    }
    return free;
  }
  // Of the section; nothing in the margin.
  std::optional<uint32_t> Column(uint32_t cell) const {
    const auto i = static_cast<int>(cell);
    const Eigen::Vector2i at(i % size_.x() - margin_, i / size_.x() - margin_);
    if (!section_.Inside(at)) return std::nullopt;
    return section_.Column(at);
  }

 private:
  const StoreySection& section_;
  const int margin_;
  const Eigen::Vector2i size_;
  std::vector<SectionState> state_;
};

// Of the columns straight out of the gap, from half of `reach` to `reach` columns away, those that
// are free.
double FreeShare(const StoreySection& section, const Gap& gap, const Eigen::Vector2d& out,
                 double reach) {
  const auto aside = static_cast<int>(0.5 * gap.columns());
  int free = 0;
  int all = 0;
  for (double t = reach / 2; t <= reach; t += 1) {
    for (int i = -aside; i <= aside; ++i, ++all) {
      const Eigen::Vector2d p = gap.middle() + out * t + gap.along() * i;
      const Eigen::Vector2i at = p.array().round().cast<int>();
      free +=
          section.Inside(at) && section.State(section.Column(at)) == SectionState::kFree ? 1 : 0;
    }
  }
  return static_cast<double>(free) / std::max(1, all);
}

// Towards what is unknown behind it; nothing where as much is known on either side.
std::optional<Eigen::Vector2d> TowardsUnknown(const StoreySection& section, const Gap& gap,
                                              double reach) {
  const bool there = FreeShare(section, gap, gap.across(), reach) >= kFreeOfGlimpse;
  const bool here = FreeShare(section, gap, -gap.across(), reach) >= kFreeOfGlimpse;
  if (there == here) return std::nullopt;
  return here ? gap.across() : Eigen::Vector2d(-gap.across());
}

bool IsDoorway(const Gap& gap, double voxel) {
  const double width = gap.columns() * voxel;
  return gap.lintel && gap.floor_through && gap.head <= kHighestDoor && width >= kNarrowest &&
         width <= kWidest;
}

// Gaps of one hole in a wall: their middles lie within half a width of each other, or within a
// whole one where they run alike. A gap across what is seen through a doorway, from one of its
// jambs to a thing in the room, is another.
bool SamePlace(const Gap& a, const Gap& b) {
  constexpr double kAlike = 0.87;  // cosine of 30 degrees
  const double apart = (a.middle() - b.middle()).norm();
  const double width = std::max(a.columns(), b.columns());
  return apart <= 0.5 * width || (apart <= width && std::abs(a.along().dot(b.along())) >= kAlike);
}

}  // namespace

std::optional<std::vector<Glimpse>> FindGlimpses(const GapFinder& finder,
                                                 const StoreySection& section,
                                                 const std::vector<int32_t>& squared,
                                                 std::span<const Gap> known, double voxel,
                                                 const parallel::Cancellation& cancelled) {
  const int steps = std::max(1, static_cast<int>(std::lround(kBeyond / voxel)));
  const Surroundings around(section, steps);
  const std::optional<Basins> basins = FindBasins(
      around.size(), around.FreeAndOn(steps),
      SquaredWallDistance(around.size(), around.Marked(SectionState::kSolid)), cancelled);
  if (!basins.has_value()) return std::nullopt;
  std::vector<Glimpse> found;
  for (const NarrowPlace& narrow : basins->narrows) {
    if (cancelled.Requested()) return std::nullopt;
    const std::optional<uint32_t> column = around.Column(narrow.cell);
    if (!column.has_value()) continue;
    Gap gap;
    const NarrowPlace place{*column, narrow.basin, narrow.other};
    if (finder.Measure(place, squared, gap, GapFinder::Seen::kAlongAFace) != Narrow::kGap ||
        !IsDoorway(gap, voxel)) {
      continue;
    }
    const auto same = [&](const Gap& other) { return SamePlace(gap, other); };
    if (std::any_of(known.begin(), known.end(), same)) continue;
    if (std::any_of(found.begin(), found.end(),
                    [&](const Glimpse& other) { return same(other.gap); })) {
      continue;
    }
    if (const auto across = TowardsUnknown(section, gap, steps); across.has_value()) {
      found.push_back({gap, *across});
    }
  }
  return found;
}

}  // namespace vantage::planning

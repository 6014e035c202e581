#include "core/planning/openings/openings.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/planning/openings/basins.h"
#include "core/planning/openings/gap.h"
#include "core/planning/openings/glimpses.h"
#include "core/planning/openings/groups.h"
#include "core/planning/openings/storey_section.h"
#include "core/planning/openings/wall_distance.h"
#include "core/visibility/surface_walk.h"

namespace vantage::planning {
namespace {

constexpr double kBefore = 0.6;  // m from an opening: where one stands to look through
// m around a voxel of false surface, and a column at least, in which the free space is sought that
// it bounds: it is unknown itself, and so may be shreds of its neighbours.
constexpr double kBeside = 0.1;

// One storey: its section, divided at gaps.
class StoreyOpenings {
 public:
  // Appends what it finds to what was found on other storeys; nothing when cancelled on the way.
  static std::optional<StoreyOpenings> Find(const model::PlanningView& model, const FloorMap& floor,
                                            int storey, const parallel::Cancellation& cancelled,
                                            Openings& all) {
    std::optional<StoreySection> section = StoreySection::Of(model, floor, storey, cancelled);
    if (!section.has_value()) return std::nullopt;
    StoreyOpenings found(model, floor, storey, *std::move(section));
    if (!found.Divide(cancelled)) return std::nullopt;
    found.NumberSpaces(all);
    for (const auto& [narrow, gap] : found.gaps_) found.Describe(narrow, gap, all);
    for (const Glimpse& glimpse : found.glimpsed_) found.Describe(glimpse, all);
    return found;
  }
  // The space that the false surface in this voxel bounds: into Openings::spaces.
  std::optional<int> SpaceBeside(const Eigen::Vector2i& column) const {
    if (const std::optional<int> own = SpaceAt(column)) return own;
    const int beside = std::max(1, static_cast<int>(std::lround(kBeside / model_.voxel_size())));
    std::optional<int> space;
    int least = 0;
    for (int y = -beside; y <= beside; ++y) {
      for (int x = -beside; x <= beside; ++x) {
        const int away = x * x + y * y;
        if (space.has_value() && away >= least) continue;
        const std::optional<int> here = SpaceAt(column + Eigen::Vector2i(x, y));
        if (!here.has_value()) continue;
        space = here;
        least = away;
      }
    }
    return space;
  }

 private:
  std::optional<int> SpaceAt(const Eigen::Vector2i& column) const {
    if (!section_.Inside(column)) return std::nullopt;
    const int basin = basins_.of[section_.Column(column)];
    if (basin < 0) return std::nullopt;
    return space_[static_cast<size_t>(basin)];
  }

  StoreyOpenings(const model::PlanningView& model, const FloorMap& floor, int storey,
                 StoreySection section)
      : model_(model), floor_(floor), storey_(storey), section_(std::move(section)) {}

  // False when cancelled on the way.
  bool Divide(const parallel::Cancellation& cancelled) {
    std::vector<uint8_t> solid(section_.columns());
    std::vector<uint8_t> free(section_.columns());
    for (uint32_t column = 0; column < section_.columns(); ++column) {
      solid[column] = section_.State(column) == SectionState::kSolid;
      free[column] = section_.State(column) == SectionState::kFree;
    }
    const std::vector<int32_t> squared = SquaredWallDistance(section_.size(), solid);
    std::optional<Basins> basins = FindBasins(section_.size(), free, squared, cancelled);
    if (!basins.has_value()) return false;
    basins_ = *std::move(basins);
    const GapFinder finder(model_, floor_, section_);
    Groups groups(static_cast<size_t>(basins_.count));
    std::vector<NarrowPlace> spaces;
    for (const NarrowPlace& narrow : basins_.narrows) {
      if (cancelled.Requested()) return false;
      Gap gap;
      const Narrow found = finder.Measure(narrow, squared, gap);
      if (found == Narrow::kGap) gaps_.emplace_back(narrow, gap);
      if (found == Narrow::kSpace) spaces.push_back(narrow);
    }
    for (const NarrowPlace& narrow : spaces) {
      if (InGap(narrow)) continue;
      groups.Join(static_cast<size_t>(narrow.basin), static_cast<size_t>(narrow.other));
    }
    group_.resize(static_cast<size_t>(basins_.count));
    for (size_t i = 0; i < group_.size(); ++i) group_[i] = groups.Of(i);
    std::vector<Gap> known;
    for (const auto& [narrow, gap] : gaps_) known.push_back(gap);
    auto glimpsed = FindGlimpses(finder, section_, squared, known, model_.voxel_size(), cancelled);
    if (!glimpsed.has_value()) return false;
    glimpsed_ = *std::move(glimpsed);
    return true;
  }

  // Between the jambs of a gap a frame or a leaf makes further narrow places, which join nothing.
  bool InGap(const NarrowPlace& narrow) const {
    const Eigen::Vector2d at = section_.At(narrow.cell).cast<double>();
    return std::any_of(gaps_.begin(), gaps_.end(), [&](const auto& known) {
      return known.first.basin == narrow.basin && known.first.other == narrow.other &&
             (at - known.second.middle()).norm() <=
                 (known.second.other_jamb - known.second.jamb).norm();
    });
  }

  void NumberSpaces(Openings& all) {
    space_.assign(group_.size(), -1);
    for (size_t i = 0; i < group_.size(); ++i) {
      if (group_[i] == i) {
        space_[i] = static_cast<int>(all.spaces.size());
        all.spaces.push_back({storey_, false, 0, 0});
      }
      space_[i] = space_[group_[i]];
    }
    const double voxel = model_.voxel_size();
    for (const int basin : basins_.of) {
      if (basin < 0) continue;
      all.spaces[static_cast<size_t>(space_[static_cast<size_t>(basin)])].free_area +=
          voxel * voxel;
    }
    for (const model::Station& station : model_.stations()) {
      if (floor_.storeys().At(station.floor_height) != storey_) continue;
      const Eigen::Vector2i at = model_.At(station.position).head<2>() - floor_.columns().Voxel(0);
      if (const auto space = SpaceBeside(at); space.has_value()) {
        all.spaces[static_cast<size_t>(*space)].entered = true;
      }
    }
  }

  Eigen::Vector3d Place(const Eigen::Vector2d& columns, float z) const {
    const Eigen::Vector2d at = (columns + floor_.columns().Voxel(0).cast<double>()).array() + 0.5;
    return {at.x() * model_.voxel_size(), at.y() * model_.voxel_size(), static_cast<double>(z)};
  }

  // On which side of the gap a space lies, by where most of it near the gap does: +1 towards
  // `across`.
  double SideOf(const Gap& gap, const Eigen::Vector2d& across, int space) const {
    const int reach = static_cast<int>(std::lround(2 * kBefore / model_.voxel_size()));
    const Eigen::Vector2i middle = gap.middle().array().round().cast<int>();
    double sum = 0;
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        const Eigen::Vector2i at = middle + Eigen::Vector2i(x, y);
        if (!section_.Inside(at)) continue;
        const int basin = basins_.of[section_.Column(at)];
        if (basin < 0 || space_[static_cast<size_t>(basin)] != space) continue;
        sum += across.dot(Eigen::Vector2d(x, y)) > 0 ? 1 : -1;
      }
    }
    return sum < 0 ? -1 : 1;
  }

  void Describe(const NarrowPlace& narrow, const Gap& gap, Openings& all) const {
    int from = space_[static_cast<size_t>(narrow.basin)];
    int behind = space_[static_cast<size_t>(narrow.other)];
    // Between basins that hang together elsewhere it divides nothing.
    if (from == behind) return;
    const Space& a = all.spaces[static_cast<size_t>(from)];
    const Space& b = all.spaces[static_cast<size_t>(behind)];
    if (std::pair(b.entered, b.free_area) > std::pair(a.entered, a.free_area)) {
      std::swap(from, behind);
    }
    Eigen::Vector2d across = gap.across();
    across *= -SideOf(gap, across, from);
    Opening opening = Measured(gap, across, from);
    opening.behind = behind;
    all.openings.push_back(opening);
  }

  Opening Measured(const Gap& gap, const Eigen::Vector2d& across, int from) const {
    Opening opening;
    opening.centre = Place(gap.middle(), gap.floor);
    opening.direction = {across.x(), across.y(), 0};
    opening.width = (gap.other_jamb - gap.jamb).norm() * model_.voxel_size();
    opening.head = gap.head;
    opening.sill = gap.sill;
    opening.floor_through = gap.floor_through;
    opening.lintel = gap.lintel;
    opening.storey = storey_;
    opening.standing = StandingBefore(gap, across, from);
    opening.from = from;
    return opening;
  }

  // What it leads to is a space of its own, since nothing is known of it.
  void Describe(const Glimpse& glimpse, Openings& all) const {
    const Eigen::Vector2d before =
        glimpse.gap.middle() - glimpse.across * (kBefore / model_.voxel_size());
    const std::optional<int> from = SpaceBeside(before.array().round().cast<int>());
    if (!from.has_value()) return;
    Opening opening = Measured(glimpse.gap, glimpse.across, *from);
    opening.glimpsed = true;
    opening.behind = static_cast<int>(all.spaces.size());
    all.spaces.push_back({storey_, false, 0, opening.width * opening.height()});
    all.openings.push_back(opening);
  }

  // Of the places on the near side with floor, the one nearest to straight before the gap.
  Eigen::Vector3d StandingBefore(const Gap& gap, const Eigen::Vector2d& across, int space) const {
    const double voxel = model_.voxel_size();
    const Eigen::Vector2d wanted = gap.middle() - across * (kBefore / voxel);
    const int reach = static_cast<int>(std::lround(kBefore / voxel));
    const Eigen::Vector2i middle = wanted.array().round().cast<int>();
    Eigen::Vector3d standing = Place(wanted, gap.floor);
    double least = reach * reach + 1;
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        const Eigen::Vector2i at = middle + Eigen::Vector2i(x, y);
        if (!section_.Inside(at) || x * x + y * y >= least) continue;
        const uint32_t column = section_.Column(at);
        const int basin = basins_.of[column];
        if (basin < 0 || space_[static_cast<size_t>(basin)] != space ||
            !section_.HasFloor(column)) {
          continue;
        }
        least = x * x + y * y;
        standing = Place(at.cast<double>(), section_.FloorHeight(column));
      }
    }
    return standing;
  }

  const model::PlanningView& model_;
  const FloorMap& floor_;
  const int storey_;
  StoreySection section_;
  Basins basins_;
  std::vector<std::pair<NarrowPlace, Gap>> gaps_;
  std::vector<Glimpse> glimpsed_;
  std::vector<size_t> group_;  // by basin: the lowest of those that are one space with it
  std::vector<int> space_;     // by basin: into Openings::spaces
};

}  // namespace

absl::StatusOr<Openings> FindOpenings(const model::PlanningView& model, const FloorMap& floor,
                                      const parallel::Cancellation& cancelled) {
  Openings found;
  if (!floor.found() || floor.columns().floors().front().source == FloorSource::kGiven)
    return found;
  std::vector<StoreyOpenings> storeys;
  for (size_t storey = 0; storey < floor.storeys().count(); ++storey) {
    auto one = StoreyOpenings::Find(model, floor, static_cast<int>(storey), cancelled, found);
    if (!one.has_value()) return absl::CancelledError("openings");
    storeys.push_back(*std::move(one));
  }
  const Eigen::Vector2i corner = floor.columns().Voxel(0);
  const bool whole = visibility::WalkSurface(
      model, cancelled,
      [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& surface) {
        if (!model::IsFalseSurface(state) || surface.given_up) return;
        const int storey = floor.storeys().At(model.Centre(v).z());
        const auto space = storeys[static_cast<size_t>(storey)].SpaceBeside(v.head<2>() - corner);
        if (!space.has_value()) return;
        found.spaces[static_cast<size_t>(*space)].frontier_area +=
            static_cast<double>(surface.area);
      });
  if (!whole) return absl::CancelledError("openings");
  return found;
}

}  // namespace vantage::planning

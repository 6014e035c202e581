#include "core/planning/scoring/potentially_visible_sets.h"

#include <algorithm>
#include <cstddef>

#include "core/visibility/shaft.h"

namespace vantage::planning {
namespace {

// Smaller groups are hidden more often, but testing them takes longer than it saves.
constexpr uint32_t kLeastPackets = 64;

}  // namespace

PotentiallyVisibleSets::PotentiallyVisibleSets(const OrderedCells& cells,
                                               const visibility::OpaqueGrid& grid)
    : grid_(grid) {
  groups_.push_back({0, static_cast<uint32_t>(cells.packets()), 0, {}});
  for (uint32_t i = 0; i < groups_.size(); ++i) {
    const Group group = groups_[i];
    if (group.end - group.begin < 2 * kLeastPackets) {
      const size_t end = std::min(group.end * CellArrays::kPacket, cells.size());
      for (size_t k = group.begin * CellArrays::kPacket; k < end; ++k) {
        groups_[i].targets.extend(Eigen::Vector3f(cells.tx[k], cells.ty[k], cells.tz[k]));
      }
      continue;
    }
    groups_[i].half = static_cast<uint32_t>(groups_.size());
    const uint32_t middle = group.begin + (group.end - group.begin) / 2;
    groups_.push_back({group.begin, middle, 0, {}});
    groups_.push_back({middle, group.end, 0, {}});
  }
  for (size_t i = groups_.size(); i-- > 0;) {
    const uint32_t half = groups_[i].half;
    if (half != 0) groups_[i].targets = groups_[half].targets.merged(groups_[half + 1].targets);
  }
}

std::vector<PacketRange> PotentiallyVisibleSets::From(const Eigen::AlignedBox3d& views) const {
  std::vector<PacketRange> ranges;
  AddFrom(views, groups_.front(), ranges);
  return ranges;
}

void PotentiallyVisibleSets::AddFrom(const Eigen::AlignedBox3d& views, const Group& group,
                                     std::vector<PacketRange>& ranges) const {
  if (group.targets.isEmpty()) return;
  if (visibility::Occlusion(grid_, views, group.targets.cast<double>()) == visibility::Hidden::kAll)
    return;
  if (group.half != 0) {
    AddFrom(views, groups_[group.half], ranges);
    AddFrom(views, groups_[group.half + 1], ranges);
  } else if (!ranges.empty() && ranges.back().end == group.begin) {
    ranges.back().end = group.end;
  } else {
    ranges.push_back({group.begin, group.end, false});
  }
}

}  // namespace vantage::planning

#include "core/planning/evaluation/visibility_cache.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vantage::planning {
namespace {

constexpr double kSide = 0.6;  // m, approximate edge of the boxes that share a set
// Finding a set takes as long as scoring one view on this share of the cells.
constexpr uint64_t kFindingTakes = 10;
constexpr double kRaySlack = 1e-5;  // m: views are floats where rays are cast

}  // namespace

VisibilityCache::VisibilityCache(const BruteForceScorer& scorer, const FeasibleViews& views,
                                 const OrderedCells& cells, const visibility::OpaqueGrid& grid)
    : scorer_(scorer),
      views_(views),
      worth_finding_(cells.size() / kFindingTakes),
      side_(std::max(1, static_cast<int>(std::lround(kSide / views.cell_size())))),
      visible_sets_(cells, grid) {}

VisibilityCache::Key VisibilityCache::KeyOf(uint32_t view) const {
  Key key;
  for (int a = 0; a < 3; ++a) {
    const int at = views_.cells()[view][a];
    key[static_cast<size_t>(a)] = (at >= 0 ? at : at - side_ + 1) / side_;
  }
  return key;
}

Eigen::AlignedBox3d VisibilityCache::BoxOf(const Key& key) const {
  const Eigen::Vector3d first = Eigen::Vector3i(key[0], key[1], key[2]).cast<double>() * side_;
  const Eigen::Vector3d low = first.array() + 0.5;
  const Eigen::Vector3d high = first.array() + side_ - 0.5;
  const double around = scorer_.reach() + kRaySlack;
  const auto in_scene = [&](const Eigen::Vector3d& viewcells, double by) -> Eigen::Vector3d {
    const Eigen::Vector3d at = viewcells * views_.cell_size();
    return (at.array() + by) / scorer_.voxel() - scorer_.scene().corner().array();
  };
  return {in_scene(low, -around), in_scene(high, around)};
}

void VisibilityCache::Prepare(std::span<const uint32_t> which, size_t drawn,
                              const parallel::Budget& budget, parallel::Parallel& parallel) {
  struct Missing {
    Key key;
    std::optional<std::vector<PacketRange>> potentially_visible;
  };
  std::vector<Missing> missing;
  for (const uint32_t view : which) {
    const Key key = KeyOf(view);
    Entry& entry = entries_[key];
    const bool before = entry.scored >= worth_finding_;
    entry.scored += drawn;
    if (!before && entry.scored >= worth_finding_) missing.push_back({key, {}});
  }
  parallel.For(missing.size(), [&](size_t k) {
    if (budget.Expired()) return;
    missing[k].potentially_visible = visible_sets_.From(BoxOf(missing[k].key));
  });
  for (Missing& found : missing) {
    entries_[found.key].potentially_visible = std::move(found.potentially_visible);
  }
}

const std::vector<PacketRange>* VisibilityCache::PotentiallyVisibleFrom(uint32_t view) const {
  const auto found = entries_.find(KeyOf(view));
  if (found == entries_.end() || !found->second.potentially_visible.has_value()) return nullptr;
  return &*found->second.potentially_visible;
}

}  // namespace vantage::planning

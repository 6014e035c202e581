#include "core/planning/evaluation/visibility_cache.h"

#include <utility>

namespace vantage::planning {
namespace {

// Finding a set takes as long as scoring one view on this share of the cells.
constexpr uint64_t kFindingTakes = 10;

}  // namespace

VisibilityCache::VisibilityCache(const BruteForceScorer& scorer, const FeasibleViews& views,
                                 const OrderedCells& cells, const visibility::OpaqueGrid& grid)
    : boxes_(scorer, views),
      worth_finding_(cells.size() / kFindingTakes),
      visible_sets_(cells, grid) {}

void VisibilityCache::Prepare(std::span<const uint32_t> which, size_t drawn,
                              const parallel::Budget& budget, parallel::Parallel& parallel) {
  struct Missing {
    ViewBoxes::Key key;
    std::optional<std::vector<PacketRange>> potentially_visible;
  };
  std::vector<Missing> missing;
  for (const uint32_t view : which) {
    const ViewBoxes::Key key = boxes_.KeyOf(view);
    Entry& entry = entries_[key];
    const bool before = entry.scored >= worth_finding_;
    entry.scored += drawn;
    if (!before && entry.scored >= worth_finding_) missing.push_back({key, {}});
  }
  parallel.For(missing.size(), [&](size_t k) {
    if (budget.Expired()) return;
    missing[k].potentially_visible = visible_sets_.From(boxes_.BoxOf(missing[k].key));
  });
  for (Missing& found : missing) {
    entries_[found.key].potentially_visible = std::move(found.potentially_visible);
  }
}

const std::vector<PacketRange>* VisibilityCache::PotentiallyVisibleFrom(uint32_t view) const {
  const auto found = entries_.find(boxes_.KeyOf(view));
  if (found == entries_.end() || !found->second.potentially_visible.has_value()) return nullptr;
  return &*found->second.potentially_visible;
}

}  // namespace vantage::planning

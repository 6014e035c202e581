#include "core/planning/evaluation/hierarchy.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/memory/memory.h"
#include "absl/status/status.h"

namespace vantage::planning {
namespace {

constexpr size_t kCandidatesBetweenPolls = 256;

std::vector<PacketRange> RangesOf(const PatchTree& tree,
                                  std::span<const ViewBlock::Candidate> candidates) {
  std::vector<PacketRange> ranges;
  ranges.reserve(candidates.size());
  for (const ViewBlock::Candidate& candidate : candidates) {
    const PatchTree::Node& node = tree[candidate.node];
    const bool visible = (candidate.satisfied & kVisible) != 0;
    if (!ranges.empty() && ranges.back().end == node.first_packet() &&
        ranges.back().visible == visible) {
      ranges.back().end = node.end_packet();
    } else {
      ranges.push_back({node.first_packet(), node.end_packet(), visible});
    }
  }
  return ranges;
}

}  // namespace

// The arguments of the recursion below a block.
struct HierarchicalScorer::Descent {
  const parallel::Budget& budget;
  uint32_t first;  // view of `scores`, in the order of the tree
  std::span<ViewScore> scores;
  std::span<std::atomic<uint8_t>> seen;
  HierarchyCounts counts;
};

absl::StatusOr<std::unique_ptr<HierarchicalScorer>> HierarchicalScorer::Create(
    const BruteForceScorer& scorer, const visibility::OpaqueGrid& grid, const OrderedCells& cells,
    std::span<const Eigen::Vector3i> viewcells, double viewcell_size,
    const HierarchyOptions& options, const parallel::Budget& budget, parallel::Parallel& parallel,
    std::span<std::atomic<uint8_t>> seen) {
  auto summed = grid.Summed(parallel, budget);
  if (!summed.ok()) return summed.status();
  auto patches = PatchTree::Create(cells, parallel, budget);
  if (!patches.ok()) return patches.status();
  auto made = absl::WrapUnique(new HierarchicalScorer(scorer, *std::move(summed), cells, viewcells,
                                                      viewcell_size, options, *std::move(patches)));
  if (!made->Cull(budget, parallel, seen)) return absl::CancelledError("hierarchy of views");
  return made;
}

HierarchicalScorer::HierarchicalScorer(const BruteForceScorer& scorer, visibility::OpaqueGrid grid,
                                       const OrderedCells& cells,
                                       std::span<const Eigen::Vector3i> viewcells,
                                       double viewcell_size, const HierarchyOptions& options,
                                       PatchTree patches)
    : scorer_(scorer),
      cells_(cells),
      viewcells_(viewcells),
      viewcell_size_(viewcell_size),
      options_(options),
      grid_(std::move(grid)),
      classifier_(scorer, grid_, options.tolerance, options.visible_pairs),
      patches_(std::move(patches)),
      views_(viewcells, viewcell_size, options.leaf_views) {}

void HierarchicalScorer::Refine(const ViewBox& pass, const ViewBlock::Candidate& candidate,
                                Candidates& out, double& certain, HierarchyCounts& counts,
                                std::span<std::atomic<uint8_t>> seen) const {
  const PatchTree::Node& node = patches_[candidate.node];
  uint8_t satisfied = candidate.satisfied;
  double score = 0;
  switch (classifier_.Classify(pass, node, cells_, satisfied, score, counts, seen)) {
    case ShaftClassifier::Relation::kNothing:
      return;
    case ShaftClassifier::Relation::kConstant:
      certain += score;
      return;
    case ShaftClassifier::Relation::kMixed:
      break;
  }
  // The larger of the two is split. The patch is split here, the views by the caller.
  if (node.child != 0 && (pass.leaf || static_cast<double>(node.width) > pass.width)) {
    for (uint32_t child = node.child; child < node.child + 2; ++child) {
      Refine(pass, {child, satisfied}, out, certain, counts, seen);
    }
    return;
  }
  out.push_back({candidate.node, satisfied});
}

bool HierarchicalScorer::RefineAll(const ViewBox& pass,
                                   std::span<const ViewBlock::Candidate> candidates,
                                   const parallel::Budget& budget, Candidates& out, double& certain,
                                   HierarchyCounts& counts,
                                   std::span<std::atomic<uint8_t>> seen) const {
  for (size_t i = 0; i < candidates.size(); ++i) {
    if (i % kCandidatesBetweenPolls == 0 && budget.Expired()) return false;
    Refine(pass, candidates[i], out, certain, counts, seen);
  }
  return true;
}

bool HierarchicalScorer::Cull(const parallel::Budget& budget, parallel::Parallel& parallel,
                              std::span<std::atomic<uint8_t>> seen) {
  block_of_.assign(viewcells_.size(), 0);
  if (viewcells_.empty() || cells_.size() == 0) return true;
  const auto refine = [&](uint32_t node, const ViewBlock& parent, ViewBlock& block) {
    HierarchyCounts counts;
    block.node = node;
    block.certain = parent.certain;
    RefineAll(classifier_.Of(views_[node]), parent.candidates, budget, block.candidates,
              block.certain, counts, seen);
  };
  ViewBlock all;
  all.candidates.push_back({});
  std::vector<ViewBlock> front(1);
  refine(0, all, front[0]);
  if (budget.Expired()) return false;
  while (!front.empty()) {
    // The nodes of one level are culled in parallel, each with its parent's list.
    struct Task {
      uint32_t node;
      const ViewBlock* parent;
    };
    std::vector<Task> tasks;
    for (ViewBlock& block : front) {
      const ViewTree::Node& node = views_[block.node];
      if (node.size() <= options_.block_views || node.children == 0) {
        blocks_.push_back(std::move(block));
        continue;
      }
      for (uint32_t c = 0; c < node.children; ++c) tasks.push_back({node.child + c, &block});
    }
    std::vector<ViewBlock> next(tasks.size());
    parallel.For(tasks.size(), [&](size_t i) { refine(tasks[i].node, *tasks[i].parent, next[i]); });
    if (budget.Expired()) return false;  // a list may be cut short
    front = std::move(next);
  }
  std::sort(blocks_.begin(), blocks_.end(), [this](const ViewBlock& a, const ViewBlock& b) {
    return views_[a.node].begin < views_[b.node].begin;
  });
  for (uint32_t b = 0; b < blocks_.size(); ++b) {
    ViewBlock& block = blocks_[b];
    block.potential = PotentialOf(block);
    for (const uint32_t view : Views(block)) block_of_[view] = b;
  }
  return true;
}

double HierarchicalScorer::PotentialOf(const ViewBlock& block) const {
  const Headings& headings = scorer_.headings();
  if (headings.all_around()) {
    double potential = block.certain;
    for (const ViewBlock::Candidate& candidate : block.candidates) {
      potential += patches_[candidate.node].potential;
    }
    return potential;
  }
  // No heading gains more than what lies where it may look.
  const Eigen::AlignedBox3d views = classifier_.Of(views_[block.node]).box;
  std::vector<double> by_heading(headings.size(), block.certain);
  for (const ViewBlock::Candidate& candidate : block.candidates) {
    const PatchTree::Node& node = patches_[candidate.node];
    const Eigen::Vector3d low = node.bounds.position.min().cast<double>() - views.max();
    const Eigen::Vector3d high = node.bounds.position.max().cast<double>() - views.min();
    headings.AddWhereSeen(Eigen::AlignedBox2d(low.head<2>(), high.head<2>()), node.potential,
                          by_heading);
  }
  return BestOf(by_heading).score;
}

void HierarchicalScorer::Descend(Descent& descent, uint32_t index,
                                 std::span<const ViewBlock::Candidate> candidates,
                                 double certain) const {
  const ViewTree::Node& node = views_[index];
  Candidates own;
  own.reserve(candidates.size());
  if (!RefineAll(classifier_.Of(node), candidates, descent.budget, own, certain, descent.counts,
                 descent.seen)) {
    return;
  }
  if (node.children > 0) {
    for (uint32_t c = 0; c < node.children; ++c) Descend(descent, node.child + c, own, certain);
    return;
  }
  const std::vector<PacketRange> ranges = RangesOf(patches_, own);
  for (uint32_t k = node.begin; k < node.end; ++k) {
    descent.scores[k - descent.first] =
        ScoreOn(views_.order()[k], ranges, certain, descent.budget, descent.seen);
  }
}

ViewScore HierarchicalScorer::ScoreOn(uint32_t view, std::span<const PacketRange> ranges,
                                      double certain, const parallel::Budget& budget,
                                      std::span<std::atomic<uint8_t>> seen) const {
  const Headings& headings = scorer_.headings();
  if (headings.all_around()) {
    ViewScore score = scorer_.ScorePackets(Centre(view), cells_, ranges, budget, seen);
    score.score += certain;
    return score;
  }
  std::vector<double> by_bin(headings.bins(), 0);
  std::vector<double> by_heading(headings.size());
  ViewScore score = scorer_.ScoreBins(Centre(view), cells_, ranges, budget, seen, by_bin);
  headings.Sum(by_bin, by_heading);
  const BestHeading best = BestOf(by_heading);
  score.score = best.score;
  score.heading = best.heading;
  return score;
}

HierarchyCounts HierarchicalScorer::ScoreBlock(const ViewBlock& block,
                                               const parallel::Budget& budget,
                                               std::span<ViewScore> scores,
                                               std::span<std::atomic<uint8_t>> seen) const {
  HierarchyCounts counts;
  for (size_t part = 0; part < Parts(block); ++part) {
    counts += ScorePart(block, part, budget, scores, seen);
  }
  return counts;
}

size_t HierarchicalScorer::Parts(const ViewBlock& block) const {
  return std::max(1u, static_cast<uint32_t>(views_[block.node].children));
}

HierarchyCounts HierarchicalScorer::ScorePart(const ViewBlock& block, size_t part,
                                              const parallel::Budget& budget,
                                              std::span<ViewScore> scores,
                                              std::span<std::atomic<uint8_t>> seen) const {
  const ViewTree::Node& node = views_[block.node];
  Descent descent{budget, node.begin, scores, seen, {}};
  const uint32_t below = node.children > 0 ? node.child + static_cast<uint32_t>(part) : block.node;
  Descend(descent, below, block.candidates, block.certain);
  return descent.counts;
}

ViewScore HierarchicalScorer::ScoreView(uint32_t view, const parallel::Budget& budget,
                                        std::span<std::atomic<uint8_t>> seen) const {
  const ViewBlock& block = blocks_[block_of_[view]];
  return ScoreOn(view, RangesOf(patches_, block.candidates), block.certain, budget, seen);
}

std::vector<ViewScore> ScoreEveryView(const HierarchicalScorer& scorer,
                                      const parallel::Budget& budget,
                                      parallel::Parallel& parallel) {
  size_t views = 0;
  for (const ViewBlock& block : scorer.blocks()) views += scorer.Views(block).size();
  std::vector<ViewScore> scores(views);
  parallel.For(scorer.blocks().size(), [&](size_t b) {
    const ViewBlock& block = scorer.blocks()[b];
    const std::span<const uint32_t> which = scorer.Views(block);
    std::vector<ViewScore> own(which.size());
    scorer.ScoreBlock(block, budget, own);
    for (size_t k = 0; k < own.size(); ++k) scores[which[k]] = own[k];
  });
  return scores;
}

}  // namespace vantage::planning

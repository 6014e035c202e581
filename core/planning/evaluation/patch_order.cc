#include "core/planning/evaluation/patch_order.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/planning/evaluation/cell_sample.h"

namespace vantage::planning {
namespace {

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();
constexpr size_t kTasks = 16;  // patches evaluated together

}  // namespace

PatchOrderScorer::PatchOrderScorer(EvaluationRun& run, const PatchSet& patches,
                                   const visibility::OpaqueGrid& grid,
                                   const HierarchyOptions& options)
    : run_(run),
      patches_(patches),
      options_(options),
      classifier_(run.scorer(), grid, options.tolerance, options.visible_pairs),
      views_(run.views().cells(), run.views().cell_size(), options.leaf_views),
      own_(views_.size(), 0),
      alone_(run.size() * run.scorer().headings().bins(), 0),
      task_of_(views_.size(), kNone) {}

void PatchOrderScorer::Run(EvaluationProgress progress) {
  const CellArrays& cells = run_.cells();
  std::vector<uint32_t> position(patches_.cells.size(), kNone);  // of a deficient cell in `cells`
  for (uint32_t i = 0; i < cells.size(); ++i) position[cells.cell[i]] = i;
  double left = run_.size() > 0 ? run_.view(0).upper : 0;  // nothing evaluated yet
  parallel::Serial serial;
  bool all = true;
  size_t done = 0;
  for (size_t shown = 1; all && done < patches_.patches.size(); ++done) {
    if (run_.Spent(run_.budget())) break;
    Group group;
    std::vector<uint32_t> members;
    for (const uint32_t cell : patches_.patches[done].cells) {
      if (position[cell] != kNone) members.push_back(position[cell]);
    }
    if (members.empty()) continue;
    std::sort(members.begin(), members.end());
    std::vector<float> factors;
    double potential = 0;
    for (const uint32_t i : members) {
      factors.push_back(cells.factor[i]);
      potential += static_cast<double>(cells.factor[i] * (cells.enough[i] - cells.q[i]));
    }
    group.cells = OrderedCells::Order(cells.Gather(members, factors), serial).value();
    group.tree = PatchTree::Create(group.cells, serial).value();
    all = EvaluatePatch(group);
    if (!all) break;
    left -= potential;
    if (done >= patches_.patches.size() * shown / 8) {
      ++shown;
      PushDown(std::max(0.0, left));
      progress(run_.evaluation());
    }
  }
  const bool complete = all && done == patches_.patches.size();
  PushDown(complete ? 0 : std::max(0.0, left));
  if (!complete) return;
  for (uint32_t i = 0; i < run_.size(); ++i) {
    run_.SetExact(i, run_.view(i).score, run_.view(i).heading);
  }
  run_.SetComplete();
}

bool PatchOrderScorer::EvaluatePatch(const Group& group) {
  tasks_.clear();
  Assign(group, 0, {});
  std::vector<uint64_t> rays;
  for (size_t begin = 0; begin < tasks_.size(); begin += rays.size()) {
    if (run_.Spent(run_.budget())) return false;
    rays.assign(std::min(kTasks, tasks_.size() - begin), 0);
    // Groups of views have no node below them in common, so that no two threads write to the same
    // place.
    run_.parallel().For(rays.size(), [&](size_t k) {
      const Task& task = tasks_[begin + k];
      for (const ViewBlock::Candidate& pair : task.pairs) {
        rays[k] += Evaluate(group, task.node, pair);
      }
    });
    for (const uint64_t cast : rays) run_.AddRays(cast);
  }
  for (const Task& task : tasks_) task_of_[task.node] = kNone;
  return !run_.budget().Expired();
}

// Goes down to the groups of views that are handed out to threads.
void PatchOrderScorer::Assign(const Group& group, uint32_t node, ViewBlock::Candidate pair) {
  const ViewTree::Node& views = views_[node];
  if (views.size() <= options_.block_views || views.children == 0) {
    if (task_of_[node] == kNone) {
      task_of_[node] = static_cast<uint32_t>(tasks_.size());
      tasks_.push_back({node, {}});
    }
    tasks_[task_of_[node]].pairs.push_back(pair);
    return;
  }
  if (run_.budget().Expired()) return;
  const PatchTree::Node& cells = group.tree[pair.node];
  const ViewBox box = classifier_.Of(views);
  double score = 0;
  HierarchyCounts counts;
  switch (
      classifier_.Classify(box, cells, group.cells, pair.satisfied, score, counts, run_.seen())) {
    case ShaftClassifier::Relation::kNothing:
      return;
    case ShaftClassifier::Relation::kConstant:
      own_[node] += score;
      return;
    case ShaftClassifier::Relation::kMixed:
      break;
  }
  if (cells.child != 0 && static_cast<double>(cells.width) > box.width) {
    Assign(group, node, {cells.child, pair.satisfied});
    Assign(group, node, {cells.child + 1, pair.satisfied});
    return;
  }
  for (uint32_t c = 0; c < views.children; ++c) Assign(group, views.child + c, pair);
}

// Returns the rays cast.
uint64_t PatchOrderScorer::Evaluate(const Group& group, uint32_t node, ViewBlock::Candidate pair) {
  if (run_.budget().Expired()) return 0;
  const ViewTree::Node& views = views_[node];
  const PatchTree::Node& cells = group.tree[pair.node];
  const ViewBox box = classifier_.Of(views);
  double score = 0;
  HierarchyCounts counts;
  switch (
      classifier_.Classify(box, cells, group.cells, pair.satisfied, score, counts, run_.seen())) {
    case ShaftClassifier::Relation::kNothing:
      return 0;
    case ShaftClassifier::Relation::kConstant:
      own_[node] += score;
      return 0;
    case ShaftClassifier::Relation::kMixed:
      break;
  }
  uint64_t rays = 0;
  if (cells.child != 0 && (box.leaf || static_cast<double>(cells.width) > box.width)) {
    for (uint32_t child = cells.child; child < cells.child + 2; ++child) {
      rays += Evaluate(group, node, {child, pair.satisfied});
    }
  } else if (!box.leaf) {
    for (uint32_t c = 0; c < views.children; ++c) rays += Evaluate(group, views.child + c, pair);
  } else {
    const PacketRange packet{cells.first_packet(), cells.end_packet(),
                             (pair.satisfied & kVisible) != 0};
    const Headings& headings = run_.scorer().headings();
    for (const uint32_t i : views_.Views(views)) {
      const std::span<double> by_bin =
          std::span(alone_).subspan(i * headings.bins(), headings.bins());
      const Eigen::Vector3d view = run_.views().Centre(i);
      if (headings.all_around()) {
        const ViewScore exact =
            run_.scorer().ScorePackets(view, group.cells, {&packet, 1}, run_.budget(), run_.seen());
        rays += exact.rays;
        by_bin[0] += exact.score;
      } else {
        rays += run_.scorer()
                    .ScoreBins(view, group.cells, {&packet, 1}, run_.budget(), run_.seen(), by_bin)
                    .rays;
      }
    }
  }
  return rays;
}

// A view's total is its own and that of every group it belongs to. `left`: samples that the patches
// not evaluated may add.
void PatchOrderScorer::PushDown(double left) {
  const Headings& headings = run_.scorer().headings();
  std::vector<double> by_heading(headings.size());
  std::vector<double> above(views_.size(), 0);
  for (uint32_t node = 0; node < views_.size(); ++node) {  // parents come before their children
    const ViewTree::Node& views = views_[node];
    above[node] += own_[node];
    for (uint32_t c = 0; c < views.children; ++c) above[views.child + c] = above[node];
    if (views.children > 0) continue;
    for (const uint32_t i : views_.Views(views)) {
      headings.Sum(std::span(alone_).subspan(i * headings.bins(), headings.bins()), by_heading);
      const BestHeading best = BestOf(by_heading);
      const double sum = above[node] + best.score;
      ViewEstimate& view = run_.view(i);
      view.scored = true;
      view.heading = best.heading;
      view.score = sum;
      view.lower = sum * (1 - kRounding);
      view.upper = std::max(sum, sum * (1 + kRounding) + left);
    }
  }
}

Evaluation EvaluateByPatches(const BruteForceScorer& scorer, const FeasibleViews& views,
                             const CellArrays& cells, const PatchSet& patches,
                             const visibility::OpaqueGrid& grid, const HierarchyOptions& options,
                             const parallel::Budget& budget, parallel::Parallel& parallel,
                             EvaluationProgress progress) {
  const CellSampler sampler(cells);
  EvaluationRun run(scorer, views, cells, sampler.potential(), budget, parallel);
  if (views.cells().empty()) return run.Finish();
  const auto summed = grid.Summed(parallel, budget);
  if (!summed.ok()) return run.Finish();
  PatchOrderScorer by_patches(run, patches, *summed, options);
  by_patches.Run(progress);
  return run.Finish();
}

}  // namespace vantage::planning

#include "core/planning/evaluation/completion.h"

#include <algorithm>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "core/planning/evaluation/hierarchy.h"

namespace vantage::planning {
namespace {

constexpr size_t kViews = 16;   // together
constexpr size_t kBlocks = 32;  // together

// Shows the evaluation whenever another eighth of the views is exact.
class Shown {
 public:
  Shown(const EvaluationRun& run, EvaluationProgress progress) : run_(run), progress_(progress) {}
  void Show() {
    const Evaluation& evaluation = run_.evaluation();
    if (evaluation.exact * 8 < run_.size() * eighths_) return;
    eighths_ = evaluation.exact * 8 / run_.size() + 1;
    progress_(evaluation);
  }

 private:
  const EvaluationRun& run_;
  EvaluationProgress progress_;
  size_t eighths_ = 1;
};

class ByHierarchy {
 public:
  // `hierarchy` scores the run's views on its cells.
  ByHierarchy(EvaluationRun& run, const HierarchicalScorer& hierarchy)
      : run_(run), hierarchy_(hierarchy) {}

  void Complete(EvaluationProgress progress) {
    Shown shown(run_, progress);
    const std::vector<uint32_t> order = BoundAndOrder();
    size_t count = 0;
    for (size_t begin = 0; begin < order.size(); begin += std::max<size_t>(count, 1)) {
      const uint64_t left = run_.WorkLeft(run_.budget());
      uint64_t bound = 0;
      for (count = 0; count < kBlocks && begin + count < order.size(); ++count) {
        bound += MostRays(hierarchy_.blocks()[order[begin + count]]);
        if (bound > left) break;
      }
      const bool all = count > 0 ? ScoreBlocks({order.data() + begin, count})
                                 : ScoreByOne(hierarchy_.blocks()[order[begin]]);
      if (!all) return;
      shown.Show();
    }
    run_.SetComplete();
  }

 private:
  // Blocks with views that are not exact, the highest upper bound first.
  std::vector<uint32_t> BoundAndOrder() {
    std::vector<std::pair<double, uint32_t>> order;
    for (uint32_t b = 0; b < hierarchy_.blocks().size(); ++b) {
      const ViewBlock& block = hierarchy_.blocks()[b];
      double most = -1;
      for (const uint32_t i : hierarchy_.Views(block)) {
        ViewEstimate& view = run_.view(i);
        if (view.exact) continue;
        view.upper = std::min(view.upper, block.potential * (1 + kRounding));
        view.lower = std::clamp(block.certain * (1 - kRounding), view.lower,
                                std::max(view.lower, view.upper));
        view.upper = std::max(view.upper, view.lower);
        view.score = std::clamp(view.score, view.lower, view.upper);
        most = std::max(most, run_.Worth(i) * view.upper);
      }
      if (most >= 0) order.emplace_back(-most, b);
    }
    std::stable_sort(order.begin(), order.end());
    std::vector<uint32_t> blocks;
    blocks.reserve(order.size());
    for (const auto& [key, b] : order) blocks.push_back(b);
    return blocks;
  }

  // What a block can cost at most.
  uint64_t MostRays(const ViewBlock& block) const {
    uint64_t cells = 0;
    for (const ViewBlock::Candidate& candidate : block.candidates) {
      cells += hierarchy_.patches()[candidate.node].size();
    }
    return hierarchy_.Views(block).size() * cells * (run_.scorer().reach() > 0 ? 9 : 1);
  }

  bool ScoreBlocks(std::span<const uint32_t> which) {
    if (run_.Spent(run_.budget())) return false;
    struct Part {
      uint64_t rays;  // of its block, at most
      size_t block;   // of `which`
      size_t part;
    };
    std::vector<Part> parts;
    std::vector<std::vector<ViewScore>> scores(which.size());
    for (size_t k = 0; k < which.size(); ++k) {
      const ViewBlock& block = hierarchy_.blocks()[which[k]];
      scores[k].resize(hierarchy_.Views(block).size());
      for (size_t i = 0; i < hierarchy_.Parts(block); ++i) parts.push_back({MostRays(block), k, i});
    }
    // The longest tasks come first, so that all threads end at about the same time.
    std::stable_sort(parts.begin(), parts.end(),
                     [](const Part& a, const Part& b) { return a.rays > b.rays; });
    run_.parallel().For(parts.size(), [&](size_t i) {
      const Part& part = parts[i];
      hierarchy_.ScorePart(hierarchy_.blocks()[which[part.block]], part.part, run_.budget(),
                           scores[part.block], run_.seen());
    });
    bool all = true;
    for (size_t k = 0; k < which.size(); ++k) {
      const auto views = hierarchy_.Views(hierarchy_.blocks()[which[k]]);
      for (size_t j = 0; j < views.size(); ++j) {
        run_.AddRays(scores[k][j].rays);
        all = all && scores[k][j].finished;
        if (scores[k][j].finished) {
          run_.SetExact(views[j], scores[k][j].score, scores[k][j].heading);
        }
      }
    }
    return all;
  }

  // With little work left views are scored one by one, so that the limit is overrun by one view at
  // most.
  bool ScoreByOne(const ViewBlock& block) {
    const auto views = hierarchy_.Views(block);
    const uint64_t each = std::max<uint64_t>(1, MostRays(block) / views.size());
    std::vector<ViewScore> scores;
    for (size_t begin = 0; begin < views.size(); begin += scores.size()) {
      if (run_.Spent(run_.budget())) return false;
      const uint64_t affordable = run_.WorkLeft(run_.budget()) / each;
      scores.assign(
          std::min<size_t>(std::clamp<uint64_t>(affordable, 1, kViews), views.size() - begin), {});
      run_.parallel().For(scores.size(), [&](size_t k) {
        scores[k] = hierarchy_.ScoreView(views[begin + k], run_.budget(), run_.seen());
      });
      for (size_t k = 0; k < scores.size(); ++k) {
        run_.AddRays(scores[k].rays);
        if (!scores[k].finished) return false;
        run_.SetExact(views[begin + k], scores[k].score, scores[k].heading);
      }
    }
    return true;
  }

  EvaluationRun& run_;
  const HierarchicalScorer& hierarchy_;
};

}  // namespace

void CompleteByView(EvaluationRun& run, EvaluationProgress progress) {
  std::vector<uint32_t> rest;
  for (uint32_t i = 0; i < run.size(); ++i) {
    if (!run.view(i).exact) rest.push_back(i);
  }
  std::stable_sort(rest.begin(), rest.end(), [&](uint32_t a, uint32_t b) {
    return run.Worth(a) * run.view(a).upper > run.Worth(b) * run.view(b).upper;
  });
  Shown shown(run, progress);
  size_t count = 0;
  for (size_t begin = 0; begin < rest.size(); begin += count) {
    count = std::min(kViews, rest.size() - begin);
    if (!run.ScoreExactly({rest.data() + begin, count}, run.budget())) return;
    shown.Show();
  }
  run.SetComplete();
}

void CompleteByHierarchy(EvaluationRun& run, const OrderedCells& cells,
                         const visibility::OpaqueGrid& grid, EvaluationProgress progress) {
  if (run.Spent(run.budget())) return;
  const auto hierarchy = HierarchicalScorer::Create(run.scorer(), grid, cells, run.views().cells(),
                                                    run.views().cell_size(), HierarchyOptions{},
                                                    run.budget(), run.parallel(), run.seen());
  if (hierarchy.ok()) ByHierarchy(run, **hierarchy).Complete(progress);
}

}  // namespace vantage::planning

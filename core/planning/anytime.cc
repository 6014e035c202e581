#include "core/planning/anytime.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <chrono>
#include <cmath>
#include <numeric>
#include <queue>
#include <utility>

#include "core/planning/confidence_bounds.h"
#include "core/planning/hierarchy.h"

namespace vantage {
namespace {

// Floats round: what a sum of gains in float may be off by, relatively.
constexpr double kRounding = 1e-5;

class Evaluator {
 public:
  Evaluator(const BruteForceScorer& scorer, std::span<const Eigen::Vector3d> views,
            const CellArrays& cells, const AnytimeOptions& options, const Budget& budget,
            Parallel& parallel)
      : scorer_(scorer),
        views_(views),
        cells_(cells),
        options_(options),
        budget_(budget),
        parallel_(parallel) {
    line_.reserve(cells.size());
    for (size_t i = 0; i < cells.size(); ++i) {
      potential_ += static_cast<double>(cells.factor[i] * (cells.enough[i] - cells.q[i]));
      line_.push_back(potential_);
    }
    evaluation_.views.assign(views.size(), {0, 0, potential_, false, false});
    log_inverse_error_ =
        std::log(2.0 * static_cast<double>(options.rounds.size()) *
                 static_cast<double>(std::max<size_t>(1, views.size())) / (1 - options.confidence));
    uint32_t last = 0;
    for (const uint32_t cell : cells.cell) last = std::max(last, cell + 1);
    seen_ = std::vector<std::atomic<uint8_t>>(last);
  }

  // A stratified sample on all views, then larger ones on the best.
  void Race(std::span<const uint32_t> first_order) {
    std::vector<uint32_t> field(first_order.begin(), first_order.end());
    for (size_t round = 0; round < options_.rounds.size(); ++round) {
      const auto draws = std::max(
          options_.least_sample,
          static_cast<size_t>(options_.rounds[round].sample * static_cast<double>(cells_.size())));
      if (draws * 3 > cells_.size()) return;  // exact scores cost little more
      if (round > 0) {
        field = ByScore(evaluation_);
        const auto keep = static_cast<size_t>(
            std::ceil(options_.rounds[round].views * static_cast<double>(views_.size())));
        field.resize(std::min(field.size(), std::max<size_t>(keep, 16)));
      }
      // Half of what is left for each round, so that the leaders can still be decided on.
      if (!RunRound(round, draws, field, Share(0.5))) return;
    }
  }

  // The best views that lie apart, exactly: whoever looks best is scored, until the best are.
  void Decide() {
    std::priority_queue<Entry> queue;
    for (uint32_t i = 0; i < views_.size(); ++i) {
      if (evaluation_.views[i].scored) queue.push({evaluation_.views[i].score, i});
    }
    if (queue.empty()) return;  // no race was run: everything is exact soon, or out of time
    std::vector<uint32_t> leaders;
    std::vector<uint32_t> batch;
    while (!queue.empty() && static_cast<int>(leaders.size()) < options_.leaders) {
      // As many as look better than the best exact one, at most a batch.
      batch.clear();
      const size_t most = Affordable(cells_, kExactBatch, budget_);
      while (!queue.empty() && batch.size() < most) {
        const uint32_t i = queue.top().view;
        if (NearAny(i, leaders)) {
          queue.pop();
          continue;
        }
        if (evaluation_.views[i].exact) {
          if (!batch.empty()) break;
          leaders.push_back(i);
          queue.pop();
          break;
        }
        batch.push_back(i);
        queue.pop();
      }
      if (batch.empty()) continue;
      if (!ScoreExactly(batch, budget_)) return;
      for (const uint32_t i : batch) queue.push({evaluation_.views[i].score, i});
    }
    evaluation_.decided = true;
  }

  // Everything else, the most promising first: the gap closes fastest so.
  void Complete(std::span<const uint32_t> first_order,
                absl::FunctionRef<void(const Evaluation&)> progress) {
    std::vector<uint32_t> rest;
    for (const uint32_t i : first_order) {
      if (!evaluation_.views[i].exact) rest.push_back(i);
    }
    std::stable_sort(rest.begin(), rest.end(), [this](uint32_t a, uint32_t b) {
      return evaluation_.views[a].upper > evaluation_.views[b].upper;
    });
    size_t shown = 1;
    size_t count = 0;
    for (size_t begin = 0; begin < rest.size(); begin += count) {
      count = std::min(Affordable(cells_, kExactBatch, budget_), rest.size() - begin);
      if (!ScoreExactly({rest.data() + begin, count}, budget_)) return;
      if (begin >= rest.size() * shown / 8) {
        ++shown;
        progress(evaluation_);
      }
    }
    evaluation_.complete = true;
    evaluation_.decided = true;
  }

  // The same by the hierarchy. What its upper levels leave to see bounds every view at once.
  void CompleteByHierarchy(const HierarchyInput& input,
                           absl::FunctionRef<void(const Evaluation&)> progress) {
    if (Spent(budget_)) return;
    HierarchicalScorer hierarchy(scorer_, input.grid, cells_, input.viewcells, input.viewcell_size,
                                 HierarchyOptions{}, parallel_);
    if (!hierarchy.Cull(budget_, parallel_, seen_)) return;
    std::vector<std::pair<double, uint32_t>> order;  // blocks, the most promising first
    for (uint32_t b = 0; b < hierarchy.blocks().size(); ++b) {
      const ViewBlock& block = hierarchy.blocks()[b];
      double most = -1;
      for (const uint32_t i : hierarchy.Views(block)) {
        ViewEstimate& view = evaluation_.views[i];
        if (view.exact) continue;
        view.upper = std::min(view.upper, block.potential * (1 + kRounding));
        view.lower = std::clamp(block.certain * (1 - kRounding), view.lower,
                                std::max(view.lower, view.upper));
        view.upper = std::max(view.upper, view.lower);
        view.score = std::clamp(view.score, view.lower, view.upper);
        most = std::max(most, view.upper);
      }
      if (most >= 0) order.emplace_back(-most, b);
    }
    std::stable_sort(order.begin(), order.end());

    size_t shown = 1;
    for (size_t begin = 0; begin < order.size();) {
      const uint64_t left =
          budget_.work_limit - std::min<uint64_t>(budget_.work_limit, evaluation_.rays);
      uint64_t bound = 0;
      size_t count = 0;
      while (count < kBlockBatch && begin + count < order.size()) {
        bound += MostRays(hierarchy, hierarchy.blocks()[order[begin + count].second]);
        if (bound > left) break;
        ++count;
      }
      const bool all = count > 0 ? ScoreBlocks(hierarchy, {order.data() + begin, count})
                                 : ScoreByOne(hierarchy, hierarchy.blocks()[order[begin].second]);
      if (!all) return;
      begin += std::max<size_t>(count, 1);
      if (evaluation_.exact >= views_.size() * shown / 8) {
        ++shown;
        progress(evaluation_);
      }
    }
    evaluation_.complete = true;
    evaluation_.decided = true;
  }

  bool WorthAHierarchy(const HierarchyInput& input) const {
    const VoxelBox& box = input.grid.box();
    const double voxels = (box.max - box.min).cast<double>().prod();
    const auto left = static_cast<uint64_t>(views_.size() - evaluation_.exact) * cells_.size();
    if (left < options_.hierarchy_pairs ||
        voxels > static_cast<double>(options_.hierarchy_voxels)) {
      return false;
    }
    // Nothing interrupts the building, which takes a third of this on one thread.
    const double seconds = 1e-6 * static_cast<double>(cells_.size()) + 1e-8 * voxels;
    return budget_.deadline == Budget::Clock::time_point::max() ||
           std::chrono::duration<double>(budget_.deadline - Budget::Clock::now()).count() > seconds;
  }

  const Evaluation& evaluation() const { return evaluation_; }

  Evaluation Finish() {
    evaluation_.seen.assign(seen_.begin(), seen_.end());
    return std::move(evaluation_);
  }

 private:
  static constexpr size_t kExactBatch = 16;
  static constexpr size_t kBlockBatch = 16;

  struct Entry {
    double score;
    uint32_t view;
    bool operator<(const Entry& other) const {
      return score != other.score ? score < other.score : view > other.view;
    }
  };

  // A part of what is left of time and work.
  Budget Share(double share) const {
    Budget part = budget_;
    if (budget_.deadline != Budget::Clock::time_point::max()) {
      const auto now = Budget::Clock::now();
      part.deadline = now + std::chrono::duration_cast<Budget::Clock::duration>(
                                share * (budget_.deadline - now));
    }
    if (budget_.work_limit != std::numeric_limits<uint64_t>::max()) {
      const uint64_t left =
          budget_.work_limit > evaluation_.rays ? budget_.work_limit - evaluation_.rays : 0;
      part.work_limit = evaluation_.rays + static_cast<uint64_t>(share * static_cast<double>(left));
    }
    return part;
  }
  bool Spent(const Budget& budget) const {
    return evaluation_.rays >= budget.work_limit || budget.Expired();
  }

  // Views that may be scored together on `cells`: a work limit is overrun by one view at most.
  size_t Affordable(const CellArrays& cells, size_t most, const Budget& budget) const {
    const uint64_t left =
        budget.work_limit - std::min<uint64_t>(budget.work_limit, evaluation_.rays);
    const uint64_t each = std::max<uint64_t>(1, scorer_.MostRays(cells));
    return static_cast<size_t>(std::clamp<uint64_t>(left / each, 1, most));
  }

  bool NearAny(uint32_t i, std::span<const uint32_t> others) const {
    return std::any_of(others.begin(), others.end(), [&](uint32_t j) {
      return (views_[i] - views_[j]).norm() < options_.separation;
    });
  }

  // Independent draws for each round, the same for all views.
  CellArrays Sample(size_t round, size_t draws) const {
    std::vector<uint32_t> indices;
    std::vector<float> factors;
    const double part = potential_ / static_cast<double>(draws);
    size_t at = 0;
    for (size_t k = 0; k < draws; ++k) {
      const double point = (static_cast<double>(k) + HashToUnit(options_.seed, round, k)) * part;
      while (at + 1 < line_.size() && line_[at] <= point) ++at;
      const float unit =
          1 / (cells_.enough[at] - cells_.q[at]);  // a gain as a share of the most it can be
      if (!indices.empty() && indices.back() == at) {
        factors.back() += unit;
      } else {
        indices.push_back(static_cast<uint32_t>(at));
        factors.push_back(unit);
      }
    }
    return cells_.Gather(indices, factors);
  }

  bool RunRound(size_t round, size_t draws, std::span<const uint32_t> field, const Budget& part) {
    const CellArrays sample = Sample(round, draws);
    const MeanBounds bounds(draws, log_inverse_error_);
    // A batch is a few milliseconds of work, whatever the sample.
    const size_t batch = std::clamp<size_t>((size_t{1} << 19) / draws, 32, 4096);
    std::vector<ViewScore> scores;
    size_t count = 0;
    for (size_t begin = 0; begin < field.size(); begin += count) {
      if (Spent(part)) break;
      count = std::min(Affordable(sample, batch, part), field.size() - begin);
      scores.assign(count, {});
      parallel_.For(count, [&](size_t k) {
        scores[k] = scorer_.Score(views_[field[begin + k]], sample, part, seen_);
      });
      for (size_t k = 0; k < count; ++k) {
        evaluation_.rays += scores[k].rays;
        if (scores[k].finished) Note(field[begin + k], scores[k].gain, draws, bounds);
      }
    }
    return !Spent(budget_);
  }

  void Note(uint32_t i, double sum, size_t draws, const MeanBounds& bounds) {
    ViewEstimate& view = evaluation_.views[i];
    if (view.exact) return;
    const double average = std::clamp(sum / static_cast<double>(draws), 0.0, 1.0);
    view.scored = true;
    view.score = average * potential_;
    view.upper =
        std::min(view.upper, std::min(1.0, bounds.Upper(average) + kRounding) * potential_);
    view.lower =
        std::max(view.lower, std::max(0.0, bounds.Lower(average) - kRounding) * potential_);
    view.lower = std::min(view.lower, view.upper);
    view.score = std::clamp(view.score, view.lower, view.upper);
  }

  bool ScoreExactly(std::span<const uint32_t> which, const Budget& part) {
    if (Spent(part)) return false;
    std::vector<ViewScore> scores(which.size());
    parallel_.For(which.size(), [&](size_t k) {
      scores[k] = scorer_.Score(views_[which[k]], cells_, part, seen_);
    });
    bool all = true;
    for (size_t k = 0; k < which.size(); ++k) {
      evaluation_.rays += scores[k].rays;
      if (!scores[k].finished) {
        all = false;
        continue;
      }
      SetExact(which[k], scores[k]);
    }
    return all;
  }

  void SetExact(uint32_t i, const ViewScore& score) {
    if (!evaluation_.views[i].exact) ++evaluation_.exact;
    evaluation_.views[i] = {score.gain, score.gain, score.gain, true, true};
  }

  // What a block can cost at most.
  uint64_t MostRays(const HierarchicalScorer& hierarchy, const ViewBlock& block) const {
    uint64_t cells = 0;
    for (const ViewBlock::Candidate& candidate : block.candidates) {
      cells += hierarchy.patches()[candidate.node].size();
    }
    return hierarchy.Views(block).size() * cells * (scorer_.reach() > 0 ? 9 : 1);
  }

  bool ScoreBlocks(const HierarchicalScorer& hierarchy,
                   std::span<const std::pair<double, uint32_t>> which) {
    if (Spent(budget_)) return false;
    std::vector<std::vector<ViewScore>> scores(which.size());
    parallel_.For(which.size(), [&](size_t k) {
      const ViewBlock& block = hierarchy.blocks()[which[k].second];
      scores[k].resize(hierarchy.Views(block).size());
      hierarchy.ScoreBlock(block, budget_, scores[k], seen_);
    });
    bool all = true;
    for (size_t k = 0; k < which.size(); ++k) {
      const auto views = hierarchy.Views(hierarchy.blocks()[which[k].second]);
      for (size_t j = 0; j < views.size(); ++j) {
        evaluation_.rays += scores[k][j].rays;
        all = all && scores[k][j].finished;
        if (scores[k][j].finished) SetExact(views[j], scores[k][j]);
      }
    }
    return all;
  }

  // With little work left: one view after the other, so that the limit is overrun by one at most.
  bool ScoreByOne(const HierarchicalScorer& hierarchy, const ViewBlock& block) {
    const auto views = hierarchy.Views(block);
    const uint64_t each = std::max<uint64_t>(1, MostRays(hierarchy, block) / views.size());
    std::vector<ViewScore> scores;
    for (size_t begin = 0; begin < views.size(); begin += scores.size()) {
      if (Spent(budget_)) return false;
      const uint64_t left =
          budget_.work_limit - std::min<uint64_t>(budget_.work_limit, evaluation_.rays);
      scores.assign(
          std::min<size_t>(std::clamp<uint64_t>(left / each, 1, kExactBatch), views.size() - begin),
          {});
      parallel_.For(scores.size(), [&](size_t k) {
        scores[k] = hierarchy.ScoreView(views[begin + k], budget_, seen_);
      });
      for (size_t k = 0; k < scores.size(); ++k) {
        evaluation_.rays += scores[k].rays;
        if (!scores[k].finished) return false;
        SetExact(views[begin + k], scores[k]);
      }
    }
    return true;
  }

  const BruteForceScorer& scorer_;
  const std::span<const Eigen::Vector3d> views_;
  const CellArrays& cells_;
  const AnytimeOptions& options_;
  const Budget& budget_;
  Parallel& parallel_;
  double potential_ = 0;      // the most that any view can gain, samples
  std::vector<double> line_;  // where each cell ends on the line of potentials
  double log_inverse_error_ = 0;
  std::vector<std::atomic<uint8_t>> seen_;  // by needy cell
  Evaluation evaluation_;
};

}  // namespace

Evaluation EvaluateViews(const BruteForceScorer& scorer, std::span<const Eigen::Vector3d> views,
                         std::span<const uint32_t> first_order, const CellArrays& cells,
                         const AnytimeOptions& options, const Budget& budget, Parallel& parallel,
                         absl::FunctionRef<void(const Evaluation&)> progress,
                         const HierarchyInput* hierarchy) {
  Evaluator evaluator(scorer, views, cells, options, budget, parallel);
  evaluator.Race(first_order);
  if (evaluator.evaluation().any()) progress(evaluator.evaluation());
  evaluator.Decide();
  if (evaluator.evaluation().any()) progress(evaluator.evaluation());
  if (hierarchy != nullptr && evaluator.WorthAHierarchy(*hierarchy)) {
    evaluator.CompleteByHierarchy(*hierarchy, progress);
  } else {
    evaluator.Complete(first_order, progress);
  }
  return evaluator.Finish();
}

std::vector<uint32_t> CoarseFirst(std::span<const Eigen::Vector3i> cells) {
  std::vector<uint32_t> order(cells.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto level = [&](uint32_t i) {
    const auto bits = static_cast<uint32_t>(cells[i].x() | cells[i].y() | cells[i].z());
    return std::min(std::countr_zero(bits), 6);
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](uint32_t a, uint32_t b) { return level(a) > level(b); });
  return order;
}

std::vector<uint32_t> ByScore(const Evaluation& evaluation) {
  std::vector<uint32_t> order;
  for (uint32_t i = 0; i < evaluation.views.size(); ++i) {
    if (evaluation.views[i].scored) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    return evaluation.views[a].score > evaluation.views[b].score;
  });
  return order;
}

}  // namespace vantage

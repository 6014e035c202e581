#include "core/planning/evaluation/anytime.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <queue>
#include <span>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "core/planning/evaluation/cell_sample.h"
#include "core/planning/evaluation/completion.h"

namespace vantage::planning {
namespace {

constexpr size_t kDecideBatch = 8;  // views
constexpr size_t kMostChallengers = 16;

struct Entry {
  double score;
  uint32_t view;
  bool operator<(const Entry& other) const {
    return score != other.score ? score < other.score : view > other.view;
  }
};

bool NearAny(const FeasibleViews& views, uint32_t i, std::span<const uint32_t> others,
             double separation) {
  return std::any_of(others.begin(), others.end(), [&](uint32_t j) {
    return (views.Centre(i) - views.Centre(j)).norm() < separation;
  });
}

// Views that rank behind an exact one but whose estimate plus standard error reaches beyond it, the
// best first.
std::vector<uint32_t> Challengers(const EvaluationRun& run, uint32_t exact, size_t most) {
  const double to_beat = run.Rank(exact);
  std::vector<Entry> entries;
  for (uint32_t i = 0; i < run.size(); ++i) {
    const ViewEstimate& view = run.view(i);
    if (!view.scored || view.exact) continue;
    if (run.Worth(i) * (view.score + view.error) > to_beat) {
      entries.push_back({run.Worth(i) * view.score, i});
    }
  }
  std::sort(entries.rbegin(), entries.rend());
  entries.resize(std::min(entries.size(), most));
  std::vector<uint32_t> challengers;
  challengers.reserve(entries.size());
  for (const Entry& entry : entries) challengers.push_back(entry.view);
  return challengers;
}

// Neighbours of an exact view that are not exact: those two viewcells away or, when none of these
// is left, those next to it. Samples do not tell such views apart, since they see mostly the same.
std::vector<uint32_t> Around(const EvaluationRun& run, uint32_t exact, size_t most) {
  std::vector<uint32_t> around;
  for (const int step : {2, 1}) {
    for (int k = 0; k < 6; ++k) {
      Eigen::Vector3i to = run.views().cells()[exact];
      to[k / 2] += k % 2 == 0 ? step : -step;
      const int at = run.views().IndexOf(to);
      if (at < 0 || around.size() == most) continue;
      const auto i = static_cast<uint32_t>(at);
      if (!run.view(i).exact && run.Worth(i) > 0) around.push_back(i);
    }
    if (!around.empty()) break;
  }
  return around;
}

// Scores the best ranked views exactly until the leaders, which are the best views at least
// `separation` apart, are exact. People go to the first leader first. So its surroundings are
// searched and its challengers are scored before the other leaders are; a challenger that wins
// becomes the first leader and is treated in the same way (algorithm.md section 8, 'Decide').
void Decide(const AnytimeOptions& options, EvaluationRun& run) {
  std::priority_queue<Entry> queue;
  for (uint32_t i = 0; i < run.size(); ++i) {
    if (run.view(i).scored && run.Worth(i) > 0) queue.push({run.Rank(i), i});
  }
  if (queue.empty()) return;
  std::vector<uint32_t> leaders;
  std::vector<uint32_t> batch;
  bool challenged = false;
  while (!queue.empty() && static_cast<int>(leaders.size()) < options.leaders) {
    // The views that rank before the best exact one, at most a batch.
    batch.clear();
    const size_t most = run.Affordable(run.cells(), kDecideBatch, run.budget());
    while (!queue.empty() && batch.size() < most) {
      const uint32_t i = queue.top().view;
      // The rank of a view changes when it becomes exact; the view is then in the queue a second
      // time.
      const bool outdated = queue.top().score != run.Rank(i);
      if (outdated || NearAny(run.views(), i, leaders, options.separation)) {
        queue.pop();
        continue;
      }
      if (run.view(i).exact) {
        if (!batch.empty()) break;
        if (leaders.empty()) {
          batch = Around(run, i, most);
          if (batch.empty() && !challenged) {
            challenged = true;
            batch =
                Challengers(run, i, run.Affordable(run.cells(), kMostChallengers, run.budget()));
          }
          if (!batch.empty()) break;
        }
        leaders.push_back(i);
        queue.pop();
        break;
      }
      batch.push_back(i);
      queue.pop();
    }
    if (batch.empty()) continue;
    if (!run.ScoreExactly(batch, run.budget())) return;
    for (const uint32_t i : batch) queue.push({run.Rank(i), i});
  }
  run.SetDecided();
}

bool WorthAHierarchy(const AnytimeOptions& options, const EvaluationRun& run,
                     const visibility::OpaqueGrid& grid) {
  const auto left = static_cast<uint64_t>(run.size() - run.evaluation().exact) * run.cells().size();
  if (left < options.hierarchy_pairs) return false;
  // Building takes about a third of this on one thread.
  const auto table =
      static_cast<double>(visibility::SummedVolumeTable::Bytes(grid.box().max - grid.box().min));
  const double seconds = 1e-6 * static_cast<double>(run.cells().size()) + 2.5e-9 * table;
  const parallel::Budget& budget = run.budget();
  return budget.deadline == parallel::Budget::Clock::time_point::max() ||
         std::chrono::duration<double>(budget.deadline - budget.now()).count() > seconds;
}

// Race, decide, complete.
Evaluation Evaluate(const CellSampler& sampler, const AnytimeOptions& options, EvaluationRun& run,
                    EvaluationProgress progress, absl::FunctionRef<void()> complete) {
  std::optional<ViewRace> race(std::in_place, run, sampler, options.race, options.confidence,
                               options.seed);
  race->Look(run.Share(options.race_share));
  if (run.evaluation().any()) {
    progress(run.evaluation());
    if (options.after_first_look) run.AddRays((*options.after_first_look)(run.evaluation()));
  }
  race->Run(run.Share(options.race_share));
  if (run.evaluation().any()) progress(run.evaluation());
  Decide(options, run);
  if (run.evaluation().any()) progress(run.evaluation());
  if (!options.complete) return run.Finish();
  // Each time that further samples have changed the estimates, the leaders are decided anew.
  while (race->Widen()) {
    race->Run(run.Share(options.race_share));
    Decide(options, run);
  }
  if (run.evaluation().any()) progress(run.evaluation());
  for (size_t rung = 1; rung + 1 < race->rungs(); ++rung) {
    race->Tighten(rung, run.Share(options.race_share));
    Decide(options, run);
  }
  if (run.evaluation().any()) progress(run.evaluation());
  race.reset();  // its samples are half as large as all cells
  complete();
  return run.Finish();
}

}  // namespace

Evaluation EvaluateViews(const BruteForceScorer& scorer, const FeasibleViews& views,
                         const OrderedCells& cells, const visibility::OpaqueGrid& grid,
                         const AnytimeOptions& options, const parallel::Budget& budget,
                         parallel::Parallel& parallel, EvaluationProgress progress) {
  const CellSampler sampler(cells);
  EvaluationRun run(scorer, views, cells, sampler.potential(), budget, parallel, options.worth,
                    VisibilityCache(scorer, views, cells, grid));
  return Evaluate(sampler, options, run, progress, [&] {
    if (WorthAHierarchy(options, run, grid)) {
      CompleteByHierarchy(run, cells, grid, progress);
    } else {
      CompleteByView(run, progress);
    }
  });
}

Evaluation EvaluateViews(const BruteForceScorer& scorer, const FeasibleViews& views,
                         const CellArrays& cells, const AnytimeOptions& options,
                         const parallel::Budget& budget, parallel::Parallel& parallel,
                         EvaluationProgress progress) {
  const CellSampler sampler(cells);
  EvaluationRun run(scorer, views, cells, sampler.potential(), budget, parallel, options.worth);
  return Evaluate(sampler, options, run, progress, [&] { CompleteByView(run, progress); });
}

}  // namespace vantage::planning

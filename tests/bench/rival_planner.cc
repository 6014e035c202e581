#include "tests/bench/rival_planner.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <span>

#include "core/planning/evaluation/cell_sample.h"
#include "core/planning/evaluation/view_lattice.h"

namespace vantage::bench {
namespace {

bool OnLattice(const Eigen::Vector3i& cell, int stride) {
  return cell.x() % stride == 0 && cell.y() % stride == 0 && cell.z() % stride == 0;
}

}  // namespace

std::vector<RivalSettings> RivalChoices() {
  std::vector<RivalSettings> choices;
  for (const int stride : {2, 3, 5}) {
    for (const size_t draws : {256u, 1024u, 4096u}) {
      for (const double share : {0.35, 0.6}) choices.push_back({stride, draws, 0.05, share});
    }
  }
  return choices;
}

planning::Evaluation RivalEvaluation(const PlanningJob& job, const RivalSettings& settings,
                                     uint64_t seed, const parallel::Budget& budget) {
  const planning::CellArrays& cells = job.scoring->cells();
  const planning::BruteForceScorer& scorer = job.scoring->scorer();
  const planning::CellSampler sampler(cells);
  const planning::CellArrays sample = sampler.Draw(settings.draws, seed, 0).cells;
  const double unit = sampler.potential() / static_cast<double>(settings.draws);
  planning::Evaluation evaluation;
  evaluation.views.resize(job.views.size());
  const auto score = [&](uint32_t i, const parallel::Budget& part) {
    const planning::ViewScore found = scorer.Score(job.views[i], sample, part);
    evaluation.rays += found.rays;
    if (!found.finished) return false;
    evaluation.views[i].score = found.score * unit;
    evaluation.views[i].scored = true;
    return true;
  };
  // The order of the planner's own lattice is random within a level.
  const parallel::Budget lattice_part = budget.Part(settings.lattice_share, 0);
  size_t on_lattice = 0;
  planning::ViewLattice lattice(job.feasible.cells(), seed);
  while (const auto i = lattice.Next()) {
    if (!OnLattice(job.feasible.cells()[*i], settings.stride)) continue;
    if (!score(*i, lattice_part)) break;
    ++on_lattice;
  }
  const parallel::Budget refine_part = budget.Part(0.5, 0);
  std::vector<uint32_t> best = planning::ByScore(evaluation);
  const auto kept =
      static_cast<size_t>(std::ceil(settings.refined * static_cast<double>(on_lattice)));
  best.resize(std::min(best.size(), kept));
  bool time = true;
  const int reach = settings.stride - 1;
  for (size_t k = 0; time && k < best.size(); ++k) {
    for (int z = -reach; time && z <= reach; ++z) {
      for (int y = -reach; time && y <= reach; ++y) {
        for (int x = -reach; time && x <= reach; ++x) {
          const int i =
              job.feasible.IndexOf(job.feasible.cells()[best[k]] + Eigen::Vector3i(x, y, z));
          if (i < 0 || evaluation.views[static_cast<size_t>(i)].scored) continue;
          time = score(static_cast<uint32_t>(i), refine_part);
        }
      }
    }
  }
  for (const uint32_t i : planning::ByScore(evaluation)) {
    const planning::ViewScore found = scorer.Score(job.views[i], cells, budget);
    if (!found.finished) break;
    evaluation.rays += found.rays;
    evaluation.views[i].score = found.score;
    evaluation.views[i].exact = true;
    ++evaluation.exact;
  }
  // Exact scores rank before estimates.
  for (planning::ViewEstimate& view : evaluation.views) {
    if (view.scored && !view.exact && evaluation.exact > 0) view.error = sampler.potential();
  }
  return evaluation;
}

}  // namespace vantage::bench

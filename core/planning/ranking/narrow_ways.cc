#include "core/planning/ranking/narrow_ways.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <vector>

#include "core/planning/ranking/view_report.h"
#include "core/planning/scoring/gain_cells.h"

namespace vantage::planning {
namespace {

constexpr double kNarrowestScanner = 0.25;  // m, of a tripod that is folded up and carried through
constexpr double kMuchMore = 2;             // times the gain of the best view
// Views behind one way that are looked at. A person wants to know of a room, not of its best
// corner.
constexpr size_t kViewsBehind = 48;
constexpr size_t kMostWays = 16;  // that are looked at, those with the most views behind

bool Within(const Eigen::Vector3d& place, std::span<const Region> reach) {
  return reach.empty() || std::any_of(reach.begin(), reach.end(),
                                      [&](const Region& box) { return box.contains(place); });
}

}  // namespace

NarrowWays FindNarrowWays(const NarrowWayQuestion& question, uint64_t done,
                          const parallel::Budget& budget, parallel::Parallel& parallel) {
  NarrowWays found;
  const PlanningProblem& problem = question.problem;
  if (budget.Expired() || done >= budget.work_limit) return found;
  const FeasibleViews& feasible = problem.feasible();
  const std::vector<FeasibleViews::CellIndex> cells = feasible.Unreachable();
  if (cells.empty()) return found;
  const ReachMap& reach = feasible.reach();
  const std::vector<ReachMap::WidestWay> ways = reach.FindWidestWays(problem.view());
  std::map<uint32_t, std::vector<Eigen::Vector3d>> behind;  // views by the narrowest node before
  for (const FeasibleViews::CellIndex& cell : cells) {
    const Eigen::Vector3d centre =
        (cell.cast<double>().array() + 0.5).matrix() * feasible.cell_size();
    if (!Within(centre, question.reach)) continue;
    const auto node = reach.nodes().Under(centre);
    if (!node.has_value() || static_cast<double>(ways[*node].width) < kNarrowestScanner) continue;
    behind[ways[*node].narrowest].push_back(centre);
  }
  std::vector<uint32_t> order;
  order.reserve(behind.size());
  // A doorway that was only glimpsed may be wider than what was seen of it.
  const auto only_glimpsed = [&](uint32_t node) {
    const Expectation* expectation = problem.expectation();
    const Eigen::Vector2d at =
        (reach.nodes().Column(node).cast<double>().array() + 0.5) * feasible.cell_size();
    const auto z = static_cast<double>(reach.nodes().Height(node));
    return expectation != nullptr &&
           expectation->OnlyGlimpsed(problem.model().At({at.x(), at.y(), z}));
  };
  for (const auto& [narrowest, views] : behind) {
    if (!only_glimpsed(narrowest)) order.push_back(narrowest);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](uint32_t a, uint32_t b) { return behind[a].size() > behind[b].size(); });
  order.resize(std::min(order.size(), kMostWays));
  if (order.empty()) return found;
  const CellArrays gains = GainCells(question.cells, problem.patches());
  for (const uint32_t narrowest : order) {
    if (budget.Expired() || done + found.rays >= budget.work_limit) break;
    const std::vector<Eigen::Vector3d>& views = behind[narrowest];
    const size_t count = std::min(views.size(), kViewsBehind);
    std::vector<ViewScore> scores(count);
    // Evenly over the list, which runs row by row: a lattice of the space behind.
    const auto view = [&](size_t k) { return views[k * views.size() / count]; };
    parallel.For(count, [&](size_t k) {
      scores[k] = problem.scoring().scorer().Score(view(k), gains, budget);
    });
    NarrowWay way;
    for (size_t k = 0; k < count; ++k) {
      found.rays += scores[k].rays;
      if (!scores[k].finished || scores[k].score <= way.gain_without_hidden) continue;
      way.gain_without_hidden = scores[k].score;
      way.place = view(k);
    }
    if (way.gain_without_hidden < problem.config().terminate_below ||
        way.gain_without_hidden <= kMuchMore * question.best) {
      continue;
    }
    std::vector<float> by_cell(gains.size());
    const ViewScore score =
        problem.scoring().scorer().ScoreCells(way.place, gains, budget, by_cell);
    found.rays += score.rays;
    if (!score.finished) break;
    RankedView from_there;
    ViewReport::SetGain(gains, problem.patches(), by_cell, from_there);
    way.model_gain = *from_there.model_gain;
    const Eigen::Vector2i column = reach.nodes().Column(narrowest);
    way.narrowest = {(column.x() + 0.5) * feasible.cell_size(),
                     (column.y() + 0.5) * feasible.cell_size(),
                     static_cast<double>(reach.nodes().Height(narrowest))};
    way.width = std::floor(100 * static_cast<double>(ways[narrowest].width) + 1e-6) / 100;
    found.ways.push_back(way);
  }
  std::stable_sort(found.ways.begin(), found.ways.end(),
                   [](const NarrowWay& a, const NarrowWay& b) {
                     return a.gain_without_hidden > b.gain_without_hidden;
                   });
  return found;
}

}  // namespace vantage::planning

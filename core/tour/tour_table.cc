#include "core/tour/tour_table.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "core/planning/scoring/gain_cells.h"
#include "core/planning/scoring/headings.h"

namespace vantage::tour {
namespace {

// Of what a cell gains when it comes to the required density: from half on it counts as brought to
// it, since what is just short of it is so by rounding.
constexpr float kCountsAsThere = 0.5F;

}  // namespace

GainElements GainElements::Of(const planning::PlanningProblem& problem, size_t most, size_t first,
                              parallel::Parallel& parallel) {
  const planning::CellArrays gains =
      planning::GainCells(problem.scoring().cells(), problem.patches(), parallel);
  std::vector<uint32_t> counting;
  for (uint32_t i = 0; i < gains.size(); ++i) {
    if (gains.factor[i] > 0) counting.push_back(i);
  }
  const size_t stride = std::max<size_t>(1, (counting.size() + most - 1) / most);
  std::vector<uint32_t> indices;
  std::vector<float> factors;
  GainElements elements;
  for (size_t k = first % stride; k < counting.size(); k += stride) {
    const uint32_t i = counting[k];
    indices.push_back(i);
    factors.push_back(gains.factor[i]);
    const double weight =
        static_cast<double>(stride) * gains.factor[i] * (gains.enough[i] - gains.q[i]);
    elements.weights.push_back(weight);
    elements.total += weight;
  }
  elements.cells = gains.Gather(indices, factors);
  return elements;
}

std::optional<cover::ElementSet> Brought(const planning::PlanningProblem& problem,
                                         const Candidate& candidate, const GainElements& elements,
                                         const parallel::Budget& budget, uint64_t& rays) {
  const planning::CellArrays& cells = elements.cells;
  cover::ElementSet brought = cover::EmptySet(elements.weights.size());
  if (elements.weights.empty()) return brought;
  std::vector<float> scores(cells.size());
  const planning::ViewScore score =
      problem.scoring().scorer().ScoreCells(candidate.position, cells, budget, scores);
  rays += score.rays;
  if (!score.finished) return std::nullopt;
  planning::KeepSector(planning::Sector(problem.scanner(), candidate.heading), candidate.position,
                       cells, scores);
  for (size_t i = 0; i < elements.weights.size(); ++i) {
    const float all = cells.factor[i] * (cells.enough[i] - cells.q[i]);
    if (scores[i] >= kCountsAsThere * all) cover::Insert(brought, i);
  }
  return brought;
}

TourTable::TourTable(const planning::PlanningProblem& problem, const OverlapTable& overlap,
                     const GainElements& elements)
    : problem_(problem), overlap_(overlap), elements_(elements) {
  cover_.weights = elements.weights;
}

absl::Status TourTable::Add(std::span<const Candidate> candidates, const parallel::Budget& budget,
                            parallel::Parallel& parallel) {
  std::vector<Candidate> fresh;
  for (const Candidate& candidate : candidates) {
    if (std::find(candidates_.begin(), candidates_.end(), candidate) == candidates_.end() &&
        std::find(fresh.begin(), fresh.end(), candidate) == fresh.end()) {
      fresh.push_back(candidate);
    }
  }
  struct Row {
    std::optional<cover::ElementSet> brought;
    std::optional<OverlapTable::Sight> sight;
    uint64_t rays = 0;
    bool anchored = false;
    std::vector<uint32_t> links;  // to candidates before it, ascending
  };
  std::vector<Row> rows(fresh.size());
  parallel.For(fresh.size(), [&](size_t k) {
    if (budget.Expired()) return;
    Row& row = rows[k];
    row.brought = Brought(problem_, fresh[k], elements_, budget, row.rays);
    if (row.brought.has_value()) row.sight = overlap_.SightFrom(fresh[k], budget, row.rays);
    if (row.sight.has_value()) row.anchored = overlap_.MayRegisterToKnown(*row.sight);
  });
  absl::Status stopped = absl::CancelledError("the tour's table");
  for (const Row& row : rows) {
    if (!row.sight.has_value()) return stopped;
  }
  const size_t before = candidates_.size();
  const auto sight_of = [&](size_t i) -> const OverlapTable::Sight& {
    return i < before ? sights_[i] : *rows[i - before].sight;
  };
  const auto place_of = [&](size_t i) -> const Eigen::Vector3d& {
    return i < before ? candidates_[i].position : fresh[i - before].position;
  };
  const double farthest = 2 * problem_.scanner().range_max;
  parallel.For(fresh.size(), [&](size_t k) {
    for (uint32_t i = 0; i < before + k; ++i) {
      if (budget.Expired()) return;
      if ((place_of(i) - fresh[k].position).norm() > farthest) continue;
      if (overlap_.Linked(sight_of(i), *rows[k].sight)) rows[k].links.push_back(i);
    }
  });
  if (budget.Expired()) return stopped;
  for (size_t k = 0; k < fresh.size(); ++k) {
    const auto at = static_cast<uint32_t>(candidates_.size());
    rays_ += rows[k].rays;
    candidates_.push_back(fresh[k]);
    sights_.push_back(*std::move(rows[k].sight));
    cover_.covers.push_back(*std::move(rows[k].brought));
    cover_.links.push_back(std::move(rows[k].links));
    for (const uint32_t other : cover_.links.back()) cover_.links[other].push_back(at);
    if (rows[k].anchored) cover_.anchored.push_back(at);
  }
  std::vector<uint32_t> all(candidates_.size());
  for (uint32_t i = 0; i < all.size(); ++i) all[i] = i;
  attainable_ = Weight(all);
  return absl::OkStatus();
}

cover::ElementSet TourTable::Covered(std::span<const uint32_t> stations) const {
  cover::ElementSet covered = cover::EmptySet(elements_.weights.size());
  for (const uint32_t station : stations) cover::Unite(covered, cover_.covers[station]);
  return covered;
}

double TourTable::Weight(const cover::ElementSet& covered) const {
  double weight = 0;
  cover::ForEach(covered, [&](size_t i) { weight += elements_.weights[i]; });
  return weight;
}

double TourTable::Weight(std::span<const uint32_t> stations) const {
  return Weight(Covered(stations));
}

}  // namespace vantage::tour

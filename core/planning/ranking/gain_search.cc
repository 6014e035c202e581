#include "core/planning/ranking/gain_search.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "core/planning/evaluation/view_boxes.h"
#include "core/planning/scoring/gain_cells.h"

namespace vantage::planning {
namespace {

// Looked at together. Each may use this part of the work that is left, so that the result does not
// depend on which of them is first.
constexpr size_t kBoxesAtOnce = 16;
// Rays that a thread casts in a second, roughly; and by how much fewer than by all cells a search
// takes, since from one place little is visible: a fifth in furnished flats, more in halls.
constexpr double kRaysPerSecond = 5e6;
constexpr double kVisiblePart = 0.25;
// Draws that tell of a view which gains half of what is enough, by the inverse of the share of all
// cells that is enough and of the error allowed.
constexpr double kDraws = 1.5;

PatchTree TreeOf(const OrderedCells& cells, const CellArrays& gains, parallel::Parallel& parallel) {
  OrderedCells ordered = cells;
  static_cast<CellArrays&>(ordered) = gains;  // in the same order
  return PatchTree::Create(ordered, parallel).value();
}

}  // namespace

GainSearch::GainSearch(const PlanningProblem& problem, const OrderedCells& cells,
                       const CellArrays& gains, double most_gain_per_sample)
    : problem_(problem), cells_(cells), gains_(gains), per_sample_(most_gain_per_sample) {}

void GainSearch::Know(double gain_without_hidden, double model_gain) {
  gain_without_hidden_ = std::max(gain_without_hidden_, gain_without_hidden);
  model_gain_ = std::max(model_gain_, model_gain);
}

bool GainSearch::Enough() const {
  return gain_without_hidden_ >= problem_.config().terminate_below;
}

double GainSearch::MostOf(const ViewEstimate& view) const {
  return std::min(per_sample_ * view.upper, problem_.patches().area);
}

void GainSearch::ListBoxes() {
  if (!boxes_.empty()) return;
  const ViewBoxes boxes(problem_.scoring().scorer(), problem_.feasible());
  absl::flat_hash_map<ViewBoxes::Key, size_t> at;
  for (uint32_t i = 0; i < problem_.feasible().cells().size(); ++i) {
    const auto [box, added] = at.try_emplace(boxes.KeyOf(i), boxes_.size());
    if (added) boxes_.emplace_back();
    boxes_[box->second].views.push_back(i);
  }
}

std::vector<uint32_t> GainSearch::Order(const Evaluation& evaluation) const {
  std::vector<std::pair<double, uint32_t>> order;
  for (uint32_t b = 0; b < boxes_.size(); ++b) {
    if (boxes_[b].settled) continue;
    double best = -std::numeric_limits<double>::infinity();
    for (const uint32_t i : boxes_[b].views) best = std::max(best, evaluation.views[i].Rank());
    order.emplace_back(-best, b);
  }
  std::sort(order.begin(), order.end());
  std::vector<uint32_t> boxes;
  boxes.reserve(order.size());
  for (const auto& [rank, b] : order) boxes.push_back(b);
  return boxes;
}

FoundGains GainSearch::Look(const Box& box, const GainTarget& target, const PatchTree& tree,
                            const Evaluation& evaluation, uint64_t most_rays,
                            const parallel::Budget& budget) const {
  std::vector<uint32_t> left;  // that may gain enough
  double others = 0;           // what the others may gain at most, m2
  for (const uint32_t i : box.views) {
    const double most = MostOf(evaluation.views[i]);
    if (most >= target.enough) {
      left.push_back(i);
    } else {
      others = std::max(others, most);
    }
  }
  FoundGains found;
  if (left.empty()) {
    found.settled = true;
    found.upper = others;
    return found;
  }
  std::stable_sort(left.begin(), left.end(), [&](uint32_t a, uint32_t b) {
    return evaluation.views[a].Rank() > evaluation.views[b].Rank();
  });
  if (budget.Expired()) return found;
  // From all of its views, also from those that are told: who comes back draws the same samples.
  const CellArrays cells = CellsVisibleFrom(problem_, box.views, gains_, tree);
  found = BoxGains(target, cells, budget).Find(left, most_rays);
  found.upper = std::max(found.upper, others);
  return found;
}

// On samples of all cells: to find out what is visible from there takes longer, on a large site.
uint64_t GainSearch::LookAtBest(const GainTarget& target, const Evaluation& evaluation,
                                const parallel::Budget& budget) {
  uint32_t best = 0;
  for (uint32_t i = 1; i < evaluation.views.size(); ++i) {
    if (evaluation.views[i].Rank() > evaluation.views[best].Rank()) best = i;
  }
  BoxGains gains(target, gains_, budget);
  potential_ = gains.potential();
  looked_ = true;
  if (MostOf(evaluation.views[best]) < target.enough) return 0;
  const FoundGains found = gains.Find({&best, 1}, std::numeric_limits<uint64_t>::max());
  Know(found.lower, 0);
  return found.rays;
}

bool GainSearch::MayEnd(const GainTarget& target, const Evaluation& evaluation, uint64_t done,
                        const parallel::Budget& budget, int threads) const {
  size_t left = 0;  // views
  for (const Box& box : boxes_) {
    if (box.settled) continue;
    for (const uint32_t i : box.views) left += MostOf(evaluation.views[i]) >= target.enough ? 1 : 0;
  }
  const double draws = kDraws * target.log_inverse_error * potential_ / target.enough;
  const double each = std::min(static_cast<double>(gains_.size()), draws);
  const double rays = kVisiblePart * static_cast<double>(left) * each;
  if (budget.work_limit != std::numeric_limits<uint64_t>::max() &&
      rays > static_cast<double>(budget.work_limit - std::min(budget.work_limit, done))) {
    return false;
  }
  if (budget.deadline == parallel::Budget::Clock::time_point::max()) return true;
  const std::chrono::duration<double> seconds = budget.deadline - budget.now();
  return rays <= kRaysPerSecond * threads * seconds.count();
}

uint64_t GainSearch::Seek(const Evaluation& evaluation, uint64_t done,
                          const parallel::Budget& budget, parallel::Parallel& parallel) {
  if (Enough() || evaluation.views.empty() || gains_.size() == 0) return 0;
  // All bounds hold together: two sides of each view with each heading, after each sample; of the
  // best view twice, on samples of all cells, too.
  const size_t bounds = 2 * std::max<size_t>(1, GainSamples(gains_.size())) *
                        (evaluation.views.size() + 1) *
                        problem_.scoring().scorer().headings().size();
  const GainTarget target{
      problem_, problem_.config().terminate_below,
      std::log(static_cast<double>(bounds) / (1 - problem_.config().confidence))};
  uint64_t rays = looked_ ? 0 : LookAtBest(target, evaluation, budget);
  if (Enough() || budget.Expired()) return rays;
  ListBoxes();
  if (!MayEnd(target, evaluation, done + rays, budget, parallel.width())) return rays;
  const std::vector<uint32_t> order = Order(evaluation);
  if (order.empty()) return rays;
  const PatchTree tree = TreeOf(cells_, gains_, parallel);
  size_t count = kBoxesAtOnce;
  for (size_t begin = 0; begin < order.size() && !Enough(); begin += count) {
    if (budget.Expired() || done + rays >= budget.work_limit) break;
    count = std::min(count, order.size() - begin);
    const uint64_t each = (budget.work_limit - done - rays) / count;
    std::vector<FoundGains> found(count);
    parallel.For(count, [&](size_t k) {
      found[k] = Look(boxes_[order[begin + k]], target, tree, evaluation, each, budget);
    });
    for (size_t k = 0; k < count; ++k) {
      Box& box = boxes_[order[begin + k]];
      rays += found[k].rays;
      box.settled = found[k].settled;
      box.upper = std::min(box.upper, found[k].upper);
      gain_without_hidden_ = std::max(gain_without_hidden_, found[k].lower);
    }
  }
  return rays;
}

GainBounds GainSearch::Bounds(const Evaluation& evaluation) const {
  GainBounds bounds;
  bounds.lower = gain_without_hidden_;
  bounds.model_gain = model_gain_;
  const auto note = [&](std::span<const uint32_t> views, double most_of_all) {
    double most = 0;
    for (const uint32_t i : views) most = std::max(most, MostOf(evaluation.views[i]));
    bounds.upper = std::max(bounds.upper, std::min(most, most_of_all));
  };
  for (const Box& box : boxes_) note(box.views, box.upper);
  if (boxes_.empty()) {
    for (const ViewEstimate& view : evaluation.views) {
      bounds.upper = std::max(bounds.upper, MostOf(view));
    }
  }
  bounds.upper = std::max(bounds.lower, bounds.upper);
  return bounds;
}

GainBounds BoundGainWithoutHidden(const GainQuestion& question, uint64_t done,
                                  const parallel::Budget& budget, parallel::Parallel& parallel) {
  GainSearch search(question.problem, question.cells, question.gains,
                    MostGainPerSample(question.cells, question.gains));
  search.Know(question.known_gain_without_hidden, question.known_model_gain);
  const uint64_t rays = search.Seek(question.evaluation, done, budget, parallel);
  GainBounds bounds = search.Bounds(question.evaluation);
  bounds.rays = rays;
  return bounds;
}

}  // namespace vantage::planning

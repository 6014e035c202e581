#include "core/planning/ranking/box_gains.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/planning/evaluation/confidence_bounds.h"
#include "core/planning/evaluation/evaluation_run.h"
#include "core/planning/evaluation/shaft_classifier.h"
#include "core/planning/scoring/headings.h"

namespace vantage::planning {
namespace {

// Of the first sample; each next one is as large as all before it. A view that gains nothing where
// a sixteenth of what is visible would be enough is told by then.
constexpr size_t kFirstDraws = 256;
// A sample of more than a third of the cells costs nearly as much as all cells.
constexpr size_t kLeastCells = 3;  // for a draw

// Lists the cells of groups that any view of a box may gain anything from.
class VisibleCells {
 public:
  VisibleCells(const ShaftClassifier& classifier, const ViewBox& views, const CellArrays& gains,
               const PatchTree& tree)
      : classifier_(classifier), views_(views), gains_(gains), tree_(tree) {
    Add(tree.root(), 0);
  }

  const std::vector<uint32_t>& cells() const { return cells_; }

 private:
  // `satisfied`: by the group that this one is a part of.
  void Add(const PatchTree::Node& group, uint8_t satisfied) {
    if (!(group.potential > 0)) return;
    double score = 0;
    HierarchyCounts counts;
    if (classifier_.Classify(views_, group, gains_, satisfied, score, counts, {}) ==
        ShaftClassifier::Relation::kNothing) {
      return;
    }
    if (group.child != 0) {
      Add(tree_[group.child], satisfied);
      Add(tree_[group.child + 1], satisfied);
      return;
    }
    for (uint32_t i = group.begin; i < group.end; ++i) {
      if (gains_.factor[i] > 0) cells_.push_back(i);
    }
  }

  const ShaftClassifier& classifier_;
  const ViewBox& views_;
  const CellArrays& gains_;
  const PatchTree& tree_;
  std::vector<uint32_t> cells_;
};

}  // namespace

size_t GainSamples(size_t cells) {
  size_t samples = 0;
  for (size_t draws = kFirstDraws; draws * kLeastCells <= cells; draws *= 2) ++samples;
  return samples;
}

CellArrays CellsVisibleFrom(const PlanningProblem& problem, std::span<const uint32_t> views,
                            const CellArrays& gains, const PatchTree& tree) {
  // What is entirely visible is not told apart.
  constexpr uint32_t kNever = std::numeric_limits<uint32_t>::max();
  const ShaftClassifier classifier(problem.scoring().scorer(), problem.grid(), 0, kNever);
  Eigen::AlignedBox3d centres;
  for (const uint32_t i : views) centres.extend(problem.feasible().Centre(i));
  const VisibleCells visible(
      classifier, classifier.Of(centres, static_cast<uint32_t>(views.size())), gains, tree);
  std::vector<float> factors;
  factors.reserve(visible.cells().size());
  for (const uint32_t i : visible.cells()) factors.push_back(gains.factor[i]);
  return gains.Gather(visible.cells(), factors);
}

bool BoxGains::Score(uint32_t view, const CellArrays& cells) {
  const BruteForceScorer& scorer = target_.problem.scoring().scorer();
  scores_.assign(scorer.headings().size(), 0);
  const ViewScore score =
      scorer.ScoreHeadings(target_.problem.feasible().Centre(view), cells, budget_, scores_);
  found_.rays += score.rays;
  return score.finished;
}

bool BoxGains::Settle(uint32_t view) {
  const double potential = sampler_.potential();
  const double mean = target_.enough / potential;
  drawn_.assign(target_.problem.scoring().scorer().headings().size(), 0);
  size_t draws = kFirstDraws;
  for (size_t round = 0; draws * kLeastCells <= cells_.size(); ++round, draws *= 2) {
    if (round == samples_.size()) {
      const size_t own = round == 0 ? draws : draws / 2;
      samples_.push_back(sampler_.Draw(own, target_.problem.config().seed, round));
    }
    if (!Score(view, samples_[round].cells)) return false;
    for (size_t h = 0; h < drawn_.size(); ++h) drawn_[h] += scores_[h];
    const double average = std::clamp(BestOf(drawn_).score / static_cast<double>(draws), 0.0, 1.0);
    if (average < mean) {
      if (!RulesOutMean(draws, target_.log_inverse_error, average, mean - kRounding)) continue;
      RuledOut(round, draws, average);
      return true;
    }
    const double least = LowerMeanBound(draws, target_.log_inverse_error, average) - kRounding;
    if (least * potential < target_.enough) continue;
    found_.lower = std::max(found_.lower, least * potential);
    return true;
  }
  if (!Score(view, cells_)) return false;
  found_.lower = std::max(found_.lower, BestOf(scores_).score);
  return true;
}

// The bound grows with the average, so it is computed for the largest alone.
void BoxGains::RuledOut(size_t round, size_t draws, double average) {
  if (round >= largest_.size()) largest_.resize(round + 1, -1);
  if (average <= largest_[round]) return;
  largest_[round] = average;
  const double most = UpperMeanBound(draws, target_.log_inverse_error, average) + kRounding;
  // Bisection ends on the far side of the bound, by a millionth of the potential.
  others_ =
      std::max(others_, std::min(most * sampler_.potential(), std::nextafter(target_.enough, 0.0)));
}

FoundGains BoxGains::Find(std::span<const uint32_t> views, uint64_t most_rays) {
  found_.upper = sampler_.potential() * (1 + kRounding);
  if (found_.upper >= target_.enough) {
    for (const uint32_t i : views) {
      if (found_.rays >= most_rays || !Settle(i)) return found_;
      if (found_.lower >= target_.enough) return found_;
    }
    found_.upper = std::max(others_, found_.lower);
  }
  found_.settled = true;
  return found_;
}

}  // namespace vantage::planning

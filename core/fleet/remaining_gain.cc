#include "core/fleet/remaining_gain.h"

#include <algorithm>
#include <span>

namespace vantage::fleet {
namespace {

// A remainder within rounding counts as nothing.
constexpr float kSatisfied = 1 - 1e-5f;

}  // namespace

RemainingGain::RemainingGain(const planning::CellArrays& cells) : cells_(cells) { Compact(); }

void RemainingGain::Compact() {
  std::vector<uint32_t> indices;
  std::vector<float> factors;
  for (uint32_t i = 0; i < cells_.size(); ++i) {
    if (cells_.q[i] >= cells_.enough[i] * kSatisfied) continue;
    indices.push_back(i);
    factors.push_back(cells_.factor[i]);
  }
  left_ = cells_.Gather(indices, factors);
}

std::optional<double> RemainingGain::Take(const Eigen::Vector3d& view,
                                          const planning::BruteForceScorer& scorer,
                                          const parallel::Budget& budget, uint64_t& rays,
                                          std::optional<double> heading) {
  std::vector<float> cell_scores(cells_.size());
  const planning::ViewScore score = scorer.ScoreCells(view, cells_, budget, cell_scores);
  rays += score.rays;
  if (!score.finished) return std::nullopt;
  const planning::Sector sector(scorer.constraints().scanner(), heading);
  const double gained =
      sector.everything() ? score.score : planning::KeepSector(sector, view, cells_, cell_scores);
  Step step;
  std::vector<uint32_t> indices;
  std::vector<float> factors;
  for (uint32_t i = 0; i < cell_scores.size(); ++i) {
    if (cell_scores[i] <= 0) continue;
    indices.push_back(i);
    factors.push_back(cells_.factor[i]);
  }
  step.changed = cells_.Gather(indices, factors);
  const std::span<float> q = cells_.q.Mutable();
  for (const uint32_t i : indices) {
    q[i] = std::min(cells_.enough[i], q[i] + cell_scores[i] / cells_.factor[i]);
    step.after.push_back(q[i]);
  }
  steps_.push_back(std::move(step));
  Compact();
  return gained;
}

bool RemainingGain::TakeAll(std::span<const PledgedView> views,
                            const visibility::OcclusionScene& scene, double voxel,
                            const parallel::Budget& budget, uint64_t& rays) {
  for (const PledgedView& view : views) {
    const planning::SensingConstraints constraints(view.model);
    const planning::BruteForceScorer scorer(constraints, scene, voxel);
    if (!Take(view.position, scorer, budget, rays, view.heading)) return false;
  }
  return true;
}

std::optional<double> RemainingGain::Lowered(size_t k, const Eigen::Vector3d& view,
                                             const planning::BruteForceScorer& scorer,
                                             const parallel::Budget& budget, uint64_t& rays,
                                             std::optional<double> heading) const {
  const Step& step = steps_[k];
  std::vector<float> cell_scores(step.changed.size());
  const planning::ViewScore score = scorer.ScoreCells(view, step.changed, budget, cell_scores);
  rays += score.rays;
  if (!score.finished) return std::nullopt;
  const planning::Sector sector(scorer.constraints().scanner(), heading);
  if (!sector.everything()) planning::KeepSector(sector, view, step.changed, cell_scores);
  double lowered = 0;
  for (size_t i = 0; i < cell_scores.size(); ++i) {
    if (cell_scores[i] <= 0) continue;
    // The smaller of the view's gain before the step and all that the step took.
    const float taken = step.changed.factor[i] * (step.after[i] - step.changed.q[i]);
    lowered += static_cast<double>(std::min(cell_scores[i], taken));
  }
  return lowered;
}

}  // namespace vantage::fleet

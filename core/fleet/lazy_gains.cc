#include "core/fleet/lazy_gains.h"

#include <algorithm>

namespace vantage::fleet {

LazyGains::LazyGains(std::span<const Eigen::Vector3d> views,
                     const planning::BruteForceScorer& scorer, const RemainingGain& remaining,
                     const planning::Evaluation& evaluation)
    : views_(views), scorer_(scorer), remaining_(remaining), gains_(views.size()) {
  for (uint32_t i = 0; i < gains_.size(); ++i) {
    const planning::ViewEstimate& view = evaluation.views[i];
    gains_[i] = {view.exact ? view.score : view.Rank(), view.upper,
                 static_cast<uint32_t>(remaining.steps()), view.exact, view.scored};
  }
}

void LazyGains::Merge(const planning::Evaluation& evaluation) {
  for (uint32_t i = 0; i < gains_.size(); ++i) {
    const planning::ViewEstimate& view = evaluation.views[i];
    Gain& gain = gains_[i];
    gain.upper = std::min(gain.upper, view.upper);
    if (!view.scored || Fresh(i)) continue;
    if (gain.exact && !view.exact) continue;  // an old exact value is an upper bound already
    gain.value = view.exact ? view.score : view.Rank();
    gain.exact = view.exact;
    gain.ranked = true;
    gain.step = static_cast<uint32_t>(remaining_.steps());
    if (view.exact) gain.upper = gain.value;
  }
}

uint64_t LazyGains::MostRays(uint32_t view) const {
  const Gain& gain = gains_[view];
  if (!gain.exact || !scorer_.headings().all_around()) {
    return scorer_.MostRays(remaining_.left());
  }
  uint64_t rays = 0;
  for (size_t k = gain.step; k < remaining_.steps(); ++k)
    rays += remaining_.MostRays(k) * scorer_.RaysPerCell();
  return rays;
}

bool LazyGains::Update(uint32_t view, const parallel::Budget& budget, Gain& gain,
                       uint64_t& rays) const {
  if (!scorer_.headings().all_around()) {
    // What the steps took may make another heading the best one.
    std::vector<double> by_heading(scorer_.headings().size());
    const planning::ViewScore score =
        scorer_.ScoreHeadings(views_[view], remaining_.left(), budget, by_heading);
    rays += score.rays;
    if (!score.finished) return false;
    gain.value = score.score;
  } else if (!gain.exact) {
    const planning::ViewScore score = scorer_.Score(views_[view], remaining_.left(), budget);
    rays += score.rays;
    if (!score.finished) return false;
    gain.value = score.score;
  } else {
    for (size_t k = gain.step; k < remaining_.steps(); ++k) {
      const auto lowered = remaining_.Lowered(k, views_[view], scorer_, budget, rays);
      if (!lowered.has_value()) return false;
      gain.value = std::max(0.0, gain.value - *lowered);
    }
  }
  gain.upper = gain.value;
  gain.step = static_cast<uint32_t>(remaining_.steps());
  gain.exact = gain.ranked = true;
  return true;
}

bool LazyGains::Refresh(std::span<const uint32_t> views, const parallel::Budget& budget,
                        parallel::Parallel& parallel, uint64_t& rays) {
  struct Done {
    Gain gain;
    uint64_t rays = 0;
    bool finished = false;
  };
  std::vector<Done> done(views.size());
  parallel.For(views.size(), [&](size_t k) {
    done[k].gain = gains_[views[k]];
    done[k].finished = Update(views[k], budget, done[k].gain, done[k].rays);
  });
  bool all = true;
  for (size_t k = 0; k < views.size(); ++k) {
    rays += done[k].rays;
    all = all && done[k].finished;
    if (done[k].finished) gains_[views[k]] = done[k].gain;
  }
  return all;
}

}  // namespace vantage::fleet

// The gain of every view of one scanner model, with its best heading, beyond the views chosen so
// far. It is computed only where it may matter, since a view's earlier gain is an upper bound of
// its present one.
#ifndef VANTAGE_CORE_FLEET_LAZY_GAINS_H_
#define VANTAGE_CORE_FLEET_LAZY_GAINS_H_

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "core/fleet/remaining_gain.h"
#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/evaluation/evaluation.h"
#include "core/planning/scoring/brute_force.h"

namespace vantage::fleet {

// References are kept.
class LazyGains {
 public:
  // `evaluation` is that of `views` on RemainingGain::left() of `remaining` at its present step.
  LazyGains(std::span<const Eigen::Vector3d> views, const planning::BruteForceScorer& scorer,
            const RemainingGain& remaining, const planning::Evaluation& evaluation);

  // True when a value is known by which the view can be ranked.
  bool Ranked(uint32_t view) const { return gains_[view].ranked; }
  // The view's gain: exact when Fresh(), otherwise an estimate or its gain at an earlier step.
  double Value(uint32_t view) const { return gains_[view].value; }
  // An upper bound of its present gain, at the evaluations' confidence.
  double Upper(uint32_t view) const { return gains_[view].upper; }
  bool Fresh(uint32_t view) const { return gains_[view].exact && Current(view); }
  // True when Value() is of the present step, exact or not.
  bool Current(uint32_t view) const { return gains_[view].step == remaining_.steps(); }

  // Takes over another evaluation of what is left now, for views that are not known exactly.
  void Merge(const planning::Evaluation& evaluation);

  // Makes views fresh in parallel. False when the budget expired on the way: some are not fresh
  // then. Adds to `rays`; the result does not depend on the number of threads.
  bool Refresh(std::span<const uint32_t> views, const parallel::Budget& budget,
               parallel::Parallel& parallel, uint64_t& rays);
  // The most rays that making a view fresh can cost.
  uint64_t MostRays(uint32_t view) const;

 private:
  struct Gain {
    double value = 0;
    double upper = 0;
    uint32_t step = 0;  // the step of RemainingGain that `value` belongs to
    bool exact = false;
    bool ranked = false;
  };
  // False when the budget expired.
  bool Update(uint32_t view, const parallel::Budget& budget, Gain& gain, uint64_t& rays) const;

  std::span<const Eigen::Vector3d> views_;
  const planning::BruteForceScorer& scorer_;
  const RemainingGain& remaining_;
  std::vector<Gain> gains_;
};

}  // namespace vantage::fleet

#endif  // VANTAGE_CORE_FLEET_LAZY_GAINS_H_

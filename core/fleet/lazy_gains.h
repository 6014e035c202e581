// What every view of one scanner model gains beyond the views chosen so far, computed only where it
// may matter: what a view gained before bounds what it gains now.
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
  // `evaluation` is of `views` on what `remaining` leaves at its present step.
  LazyGains(std::span<const Eigen::Vector3d> views, const planning::BruteForceScorer& scorer,
            const RemainingGain& remaining, const planning::Evaluation& evaluation);

  // Something is known that a view can be ranked by.
  bool Ranked(uint32_t view) const { return gains_[view].ranked; }
  // Its gain now: exact where Fresh(), else the estimate or what it gained at an earlier step.
  double Value(uint32_t view) const { return gains_[view].value; }
  // No less than what it gains now, at the evaluations' confidence.
  double Upper(uint32_t view) const { return gains_[view].upper; }
  bool Fresh(uint32_t view) const { return gains_[view].exact && Current(view); }
  // Value() is of what is left now, exact or not: no value of an earlier step.
  bool Current(uint32_t view) const { return gains_[view].step == remaining_.steps(); }

  // Another evaluation, of what is left now: for views that are not known exactly.
  void Merge(const planning::Evaluation& evaluation);

  // Makes views fresh, together. False when the budget expired on the way: some are not. Adds to
  // `rays`; the result does not depend on the number of threads.
  bool Refresh(std::span<const uint32_t> views, const parallel::Budget& budget,
               parallel::Parallel& parallel, uint64_t& rays);
  // What making a view fresh can cost at most.
  uint64_t MostRays(uint32_t view) const;

 private:
  struct Gain {
    double value = 0;
    double upper = 0;
    uint32_t step = 0;  // of what remains, that an exact value is of
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

// Step F: predicts whether a scan from a view will register (algorithm.md section 9).
#ifndef VANTAGE_CORE_PLANNING_RANKING_REGISTRATION_CHECK_H_
#define VANTAGE_CORE_PLANNING_RANKING_REGISTRATION_CHECK_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/evaluation/evaluation.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/scoring/overlap_surface.h"
#include "core/registration/bound/verdict.h"

namespace vantage::planning {

// The most views that are tried around a doubtful candidate.
inline constexpr size_t kTriedAround = 16;

// So many of the best candidates are checked before views nearer to the stations: enough that it is
// no accident that all were refused, and a fifth of max_checked's default.
inline constexpr size_t kBestFirst = 12;

struct CheckedView {
  uint32_t view = 0;
  registration::RegistrationVerdict verdict;
  // Of a scanner that sees a sector: the heading that the verdict is of, and what it gains,
  // samples.
  std::optional<size_t> heading;
  double score = 0;
  // True: the verdict is of this view only. False: it also stands for the views within the
  // separation.
  bool alone = false;
};

// What was found out about views, so that nobody finds it out again: what leads while views are
// evaluated is checked then, and mostly leads in the end. A view that is known counts with the rays
// that it took, so that a plan with a work limit is the same whether it was known or not.
class KnownVerdicts {
 public:
  struct Known {
    CheckedView view;
    uint64_t rays = 0;  // that it took
  };
  const Known* Find(uint32_t view) const {
    const auto at = by_view_.find(view);
    return at == by_view_.end() ? nullptr : &at->second;
  }
  void Note(const Known& known) { by_view_.try_emplace(known.view.view, known); }
  // Of those that register the best by `evaluation`; null when none does.
  const Known* BestRegistrable(const Evaluation& evaluation) const;

 private:
  absl::flat_hash_map<uint32_t, Known> by_view_;
};

struct RegistrationCheck {
  std::vector<CheckedView> registrable;  // the best first, apart from each other
  std::vector<CheckedView> refused;      // candidates that do not register
  std::vector<uint32_t> refused_around;  // views that were tried instead of doubtful candidates
  // Of a scanner that sees a sector: all candidates that register, so that is known what they gain.
  std::vector<CheckedView> facing;
  size_t checked = 0;
  bool finished = false;  // false: the budget expired before k were found or all were checked
  uint64_t rays = 0;
};

// Checks `candidates` (of `evaluation`, best first, apart from each other) until `wanted` pass that
// gain as much as the next may, or all are checked. Where the best dozen are
// all refused, views nearer to the stations are checked before the rest. When time is left, the
// best views around doubtful candidates are checked, too (algorithm.md section 9, 'The check of
// candidates').
// `known`, where given, is asked before a view is checked, and told what was found.
RegistrationCheck CheckRegistration(const PlanningProblem& problem, const OverlapSurface& surface,
                                    const Evaluation& evaluation,
                                    std::span<const uint32_t> candidates, size_t wanted,
                                    const parallel::Budget& budget, parallel::Parallel& parallel,
                                    KnownVerdicts* known = nullptr);
// The same of `candidates` and no others: nothing is tried nearer to the stations or around
// doubtful ones.
RegistrationCheck CheckThese(const PlanningProblem& problem, const OverlapSurface& surface,
                             const Evaluation& evaluation, std::span<const uint32_t> candidates,
                             size_t wanted, const parallel::Budget& budget,
                             parallel::Parallel& parallel);
// The same with the problem's own overlap surface. The first candidate is checked whatever is left
// of the budget, unless that was cancelled: one prediction is little beside an evaluation, and a
// plan of which nothing was checked is worth little. While none registers, `until_one` holds
// instead of the budget. Where none of the candidates registers, PlanningConfig::max_checked others
// are checked, the best of those that are twice as far from each other and from all that were
// refused; and again, until one registers or there are no views so far apart. Where time ends
// before that, the best that is known to register is what passes. A plan that ends with nothing
// while some view registers helps nobody.
RegistrationCheck CheckUntilOneRegisters(const PlanningProblem& problem,
                                         const Evaluation& evaluation,
                                         std::span<const uint32_t> candidates, size_t wanted,
                                         const parallel::Budget& budget,
                                         const parallel::Budget& until_one,
                                         parallel::Parallel& parallel, KnownVerdicts& known);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_RANKING_REGISTRATION_CHECK_H_

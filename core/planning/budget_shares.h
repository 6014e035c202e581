// How the steps of a plan share its budget.
#ifndef VANTAGE_CORE_PLANNING_BUDGET_SHARES_H_
#define VANTAGE_CORE_PLANNING_BUDGET_SHARES_H_

#include <cstdint>

#include "core/parallel/budget.h"
#include "core/planning/problem/planning_problem.h"

namespace vantage::planning {

// What steps E and F and writing the answer take on `threads` threads when as many candidates are
// checked as may be, s: so that the time that is kept back for them follows the model. Of a flat it
// is some hundredths; of a hall with 16 million cells, seconds. By what these steps read: to half
// and double of it, as machines differ.
double AnswerSeconds(const PlanningProblem& problem, int threads);

// The part of the budget that step D may use; the rest is kept for ranking, the registration check
// and the answer, which takes about `answer_seconds`.
parallel::Budget EvaluationShare(const parallel::Budget& budget, double answer_seconds);

// What of step D's budget, of which `rays` are spent, may go into the question whether another scan
// is worth it, while no view is known that is: half. Where one is, next to nothing is needed.
parallel::Budget StopShare(const parallel::Budget& evaluating, uint64_t rays);

// What step D may use where the budget ended before any view was evaluated: a little work, until it
// is cancelled.
parallel::Budget LeastEvaluation(const parallel::Budget& budget);

// What step F may use when the evaluation cast `rays`: writing the answer takes time, too.
parallel::Budget CheckShare(const parallel::Budget& budget, uint64_t rays);

// Of a budget of which preparing took the time: a quarter of a second from now is left.
parallel::Budget WithTimeToAnswer(const parallel::Budget& budget);

// What may be used beyond a budget as long as a plan has nothing: a quarter of a second from now or
// from the budget's end, whichever is later.
parallel::Budget Overrun(const parallel::Budget& budget);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_BUDGET_SHARES_H_

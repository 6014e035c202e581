// The fewest positions that cover enough, by integer programming. Needs CBC ('cbc', Debian's
// coinor-cbc) or GLPK ('glpsol', glpk-utils) on PATH.
#ifndef VANTAGE_CLIENT_STUDY_COVER_PROGRAM_H_
#define VANTAGE_CLIENT_STUDY_COVER_PROGRAM_H_

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/simulation/ground_truth.h"

namespace vantage::study {

// The path of a solver; empty where there is none.
std::string FindCoverSolver();

struct CoverProblem {
  std::vector<simulation::SampleSet> sets;      // by candidate
  std::vector<std::vector<size_t>> neighbours;  // of a candidate: those it can be joined with
  std::optional<size_t> start;                  // chosen in any case; else any may be the first
  size_t goal = 0;                              // elements to cover at least
};

struct CoverAnswer {
  std::vector<size_t> route;  // the start, if any, first; each joined with one before it
  bool proven = false;        // none has fewer
};

// The fewest candidates that cover the goal and are connected. The solver is given `seconds` of
// wall time: CBC counts by itself what its processor did, and waits for others on a busy machine,
// so it is told to count elapsed time, and ended ten seconds later where it doesn't heed that. What
// it had found by then counts, unproven. `known`: a choice that is known to do, which it begins
// with where it can (CBC). DEADLINE_EXCEEDED: nothing that is connected was found.
// FAILED_PRECONDITION: no solver, or all candidates together miss the goal.
absl::StatusOr<CoverAnswer> SolveCover(const CoverProblem& problem, double seconds,
                                       const std::vector<size_t>& known = {});

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_COVER_PROGRAM_H_

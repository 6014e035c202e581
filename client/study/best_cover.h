// The fewest stations of a scene that is known: the lower line of a study, and a bound for it.
#ifndef VANTAGE_CLIENT_STUDY_BEST_COVER_H_
#define VANTAGE_CLIENT_STUDY_BEST_COVER_H_

#include <cstddef>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/study/visibility_table.h"
#include "core/cover/cover_problem.h"
#include "core/parallel/budget.h"

namespace vantage::study {

struct CoverSettings {
  double goal = 0.95;    // share of the table's samples
  double overlap = 0.1;  // two are linked where they share so much of what the larger one sees
  double seconds = 120;  // wall time, of all solvers together
};

struct BestCoverResult {
  std::vector<size_t>
      route;            // candidates, each linked with one before it; the start, if any, first
  double covered = 0;   // share of the samples that some candidate sees
  size_t least = 0;     // no choice has fewer
  bool proven = false;  // by the bound, or by the solver over all samples
  size_t greedy = 0;    // stations that greed alone takes
  std::string how;      // in words: who found it, on how many samples, what is proven
};

// The table as a problem of core/cover. With a start its surface is covered and what is linked with
// it anchored. A sample weighs 1.
cover::CoverProblem ProblemOf(const VisibilityTable& table, const CoverSettings& settings);

// Local search over all samples first. Where the bound does not prove it, an integer programme on a
// sample of 1,000, checked on all the others: where its solution falls short there, the sample is
// doubled; what it finds is completed and polished, and kept where it is smaller. Without a solver
// on PATH local search is all. FAILED_PRECONDITION: all candidates that hang together miss the
// goal.
absl::StatusOr<BestCoverResult> BestCover(const VisibilityTable& table,
                                          const CoverSettings& settings);

// What given stations cover.
struct StationScore {
  size_t stations = 0;
  double covered = 0;           // share of the samples
  std::vector<double> by_step;  // the same after each station, in their order
  size_t linked = 0;            // stations that hang together with the first, itself counted
  double farthest = 0;          // m, between a station and the candidate that stands for it
};
// Each station is taken for the nearest candidate. INVALID_ARGUMENT: one has none within
// `tolerance` (m).
absl::StatusOr<StationScore> ScoreStations(const VisibilityTable& table,
                                           const CoverSettings& settings,
                                           const std::vector<Eigen::Vector3d>& stations,
                                           double tolerance);

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_BEST_COVER_H_

// The fewest positions that cover enough, by integer programming: the lower line of a study. Needs
// CBC ('cbc', Debian's coinor-cbc) or GLPK ('glpsol', glpk-utils) on PATH.
#ifndef VANTAGE_CLIENT_STUDY_COVER_PROGRAM_H_
#define VANTAGE_CLIENT_STUDY_COVER_PROGRAM_H_

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/study/study_scene.h"

namespace vantage::study {

// The path of a solver; empty where there is none.
std::string FindCoverSolver();

struct CoverProblem {
  std::vector<simulation::SampleSet> sets;      // by candidate
  std::vector<std::vector<size_t>> neighbours;  // of a candidate: those it can be joined with
  size_t start = 0;                             // chosen in any case
  size_t goal = 0;                              // elements to cover at least
};

// The fewest candidates besides the start that together with it cover the goal and are connected
// with it: each can be joined with one before it. DEADLINE_EXCEEDED: not proved within `seconds`.
// FAILED_PRECONDITION: no solver, or all candidates together miss the goal.
absl::StatusOr<std::vector<size_t>> SolveCover(const CoverProblem& problem, double seconds);

// The same for a scene and a seed's start: allowed positions on a lattice of 0.6 m, at most 1,000
// of the truth's samples, joined where a tenth of the larger scan overlaps. Positions in m, scene
// frame.
absl::StatusOr<std::vector<Eigen::Vector3d>> BestCover(const StudyScene& scene, uint64_t seed,
                                                       double seconds);

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_COVER_PROGRAM_H_

// What is known of the views' scores (algorithm.md section 8).
#ifndef VANTAGE_CORE_PLANNING_EVALUATION_EVALUATION_H_
#define VANTAGE_CORE_PLANNING_EVALUATION_EVALUATION_H_

#include <cstddef>
#include <cstdint>
#include <vector>

namespace vantage::planning {

// Of a scanner that sees a sector, score and bounds are those of the view's best heading.
struct ViewEstimate {
  double score = 0;  // the best estimate so far, samples
  double lower = 0;  // bounds that hold together with the confidence asked for
  double upper = 0;
  bool scored = false;  // false: only the bounds are known
  bool exact = false;   // lower == score == upper, with certainty
  double error = 0;     // approximate standard error of `score`; not a bound
  size_t heading = 0;   // of Headings: the one that `score` is best with
  // The value by which views are ranked. Among hundreds of views with few draws some look good by
  // chance alone; taking off two standard errors ranks them behind views that are known to be good.
  double Rank() const { return score - 2 * error; }
};

struct Evaluation {
  std::vector<ViewEstimate> views;
  uint64_t rays = 0;
  size_t exact = 0;       // views
  bool complete = false;  // all of them
  bool decided = false;   // the leaders are exact
  // By deficient cell: whether some scored view gains something there. Final only when complete.
  std::vector<uint8_t> seen;
  bool any() const {
    for (const ViewEstimate& view : views) {
      if (view.scored) return true;
    }
    return false;
  }
};

// Scored views in descending order of rank, equal ones by index.
std::vector<uint32_t> ByScore(const Evaluation& evaluation);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EVALUATION_EVALUATION_H_

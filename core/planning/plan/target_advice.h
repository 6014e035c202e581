// Targets that would make a scan register (algorithm.md section 9, 'Advice on targets').
#ifndef VANTAGE_CORE_PLANNING_PLAN_TARGET_ADVICE_H_
#define VANTAGE_CORE_PLANNING_PLAN_TARGET_ADVICE_H_

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace vantage::planning {

// A scan in the model: what it would measure again is known as well as its pose.
struct ScannedFrom {
  std::string name;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // m, model frame, centre of projection
  double error_bound = 0;                              // m, of its pose, at 95 %
};

struct TargetPlace {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // m, model frame
  std::optional<Eigen::Vector3d> normal;  // unit, of the surface; absent of a known target
  std::string target;                     // that is known; empty: one is to be put up
  double distance = 0;                    // m, from the view
};

struct TargetAdvice {
  std::vector<TargetPlace> places;  // two to four, apart from each other, no three in a line
  double error_bound = 0;           // m, of the scan with them
  // Whose scan is to be made first, since it sees them all: an index into Plan::views.
  std::optional<size_t> first_view;
  // Scans (ScannedFrom::name) from whose places all of them are seen; empty with `first_view`, and
  // where all are known.
  std::vector<std::string> seen_from;
};

// All of it in a sentence; `origin` (m) is added to places.
std::string TargetAdviceWords(const TargetAdvice& advice, const Eigen::Vector3d& origin);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PLAN_TARGET_ADVICE_H_

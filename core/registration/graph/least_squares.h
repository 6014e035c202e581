// The poses that fit links and evidence best, by Ceres.
#ifndef VANTAGE_CORE_REGISTRATION_GRAPH_LEAST_SQUARES_H_
#define VANTAGE_CORE_REGISTRATION_GRAPH_LEAST_SQUARES_H_

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "core/registration/graph/residuals.h"

namespace vantage::registration {

struct FitOutcome {
  bool converged = false;
  int iterations = 0;
};

// Levenberg-Marquardt on one thread, from `poses`, which it moves, but for those held. Terms that
// touch no free pose are left out.
FitOutcome FitPoses(std::span<const PoseTerm> terms, const std::vector<bool>& held,
                    std::vector<Eigen::Isometry3d>& poses);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_GRAPH_LEAST_SQUARES_H_

#include "server/session/algorithms.h"

namespace vantage {

Algorithms Algorithms::Core() {
  return {LevelFirstScan,  Register,      MakePlan,    EvaluateView,
          MeasureCoverage, MakeJointPlan, MeasureCover};
}

}  // namespace vantage

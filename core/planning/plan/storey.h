// What people are told of a level of the site (algorithm.md section 7A, 'Storeys').
#ifndef VANTAGE_CORE_PLANNING_PLAN_STOREY_H_
#define VANTAGE_CORE_PLANNING_PLAN_STOREY_H_

#include <optional>

namespace vantage::planning {

struct Storey {
  int number = 0;                 // 0 is the lowest that is known
  std::optional<double> floor_z;  // m, model frame; absent where no level floor is known
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PLAN_STOREY_H_

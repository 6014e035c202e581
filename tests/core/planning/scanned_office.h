// A floor of rooms, for what depends on walls between views and surface.
#ifndef VANTAGE_TESTS_CORE_PLANNING_SCANNED_OFFICE_H_
#define VANTAGE_TESTS_CORE_PLANNING_SCANNED_OFFICE_H_

#include <memory>

#include "core/model/planning_view.h"

namespace vantage {

// An office floor after two scans, coarse enough for a test.
std::shared_ptr<const PlanningView> ScannedOffice();

}  // namespace vantage

#endif  // VANTAGE_TESTS_CORE_PLANNING_SCANNED_OFFICE_H_

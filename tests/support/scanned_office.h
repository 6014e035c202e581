// A storey of rooms, for tests that depend on walls between views and surface.
#ifndef VANTAGE_TESTS_SUPPORT_SCANNED_OFFICE_H_
#define VANTAGE_TESTS_SUPPORT_SCANNED_OFFICE_H_

#include <memory>

#include "core/model/view/planning_view.h"

namespace vantage::test_support {

// An office storey after two scans, coarse enough for a test.
std::shared_ptr<const model::PlanningView> ScannedOffice();

}  // namespace vantage::test_support

#endif  // VANTAGE_TESTS_SUPPORT_SCANNED_OFFICE_H_

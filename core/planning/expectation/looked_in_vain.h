// Surface that is expected and that scans looked at, and did not show (algorithm.md section 7E).
#ifndef VANTAGE_CORE_PLANNING_EXPECTATION_LOOKED_IN_VAIN_H_
#define VANTAGE_CORE_PLANNING_EXPECTATION_LOOKED_IN_VAIN_H_

#include <span>

#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/planning/expectation/brick_edit.h"
#include "core/sensor/scanner_model.h"

namespace vantage::planning {

// Gives up in `edit` the surface of `expected` of which `model` knows nothing although a station
// looks at it with nothing in between: it is glass, a mirror, or not there. `expected`: the model
// with what is expected, of which `changed` are the bricks that differ. `scanner`: whose scans the
// model is of; of one that sees a sector it is not known where it faced, and nothing is given up.
// False when that was cancelled on the way.
bool GiveUpLookedInVain(const model::PlanningView& model, const model::PlanningView& expected,
                        std::span<const model::BrickAt> changed,
                        const sensor::ScannerModel& scanner,
                        const parallel::Cancellation& cancelled, BrickEdit& edit);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EXPECTATION_LOOKED_IN_VAIN_H_

// What a plan promised of a scan's place, and what the scan brought.
#ifndef VANTAGE_SERVER_SESSION_GAIN_PROMISE_H_
#define VANTAGE_SERVER_SESSION_GAIN_PROMISE_H_

#include <optional>

#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "server/session/session_context.h"
#include "server/session/session_state.h"
#include "vantage/v1/scan.pb.h"

namespace vantage::session {

// The promise of the newest plan for the state's model that has a view at the scan's place, facing
// alike where the scanner sees a sector, and knows what it gains. Nothing where there is none: what
// a plan for an earlier model promised, other scans may have brought.
std::optional<v1::GainPromise> PromiseOf(const SessionState& state, const v1::Scan& scan);

// What came to density from one model to the next, as the session requires it now, m2. `before` is
// null for the first scan.
double ObtainedGain(const SessionContext& context, const model::PlanningView* before,
                    const model::PlanningView& after, parallel::Parallel& parallel);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_GAIN_PROMISE_H_

// How much of a session's site is covered, and what remains by its last plan.
#ifndef VANTAGE_SERVER_SESSION_COVERAGE_H_
#define VANTAGE_SERVER_SESSION_COVERAGE_H_

#include "absl/status/statusor.h"
#include "server/session/model_memory.h"
#include "server/session/plans.h"
#include "server/session/session_context.h"
#include "vantage/v1/model_service.pb.h"

namespace vantage::session {

// Before the first scan nothing is covered, and that is returned. Errors as of
// ModelMemory::WhyNone().
absl::StatusOr<v1::GetCoverageResponse> MeasureCoverage(const SessionContext& context,
                                                        ModelMemory& memory, const Plans& plans);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_COVERAGE_H_

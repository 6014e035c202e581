// Compares a session's scans with its model at each of their poses, for who has to decide between
// these.
#ifndef VANTAGE_SERVER_SESSION_POSE_COMPARISONS_H_
#define VANTAGE_SERVER_SESSION_POSE_COMPARISONS_H_

#include <functional>

#include "absl/status/statusor.h"
#include "server/session/journal.h"
#include "server/session/model_memory.h"
#include "server/session/session_context.h"
#include "vantage/v1/scan_service.pb.h"

namespace vantage::session {

// Thread safe: the locks of log and model are all that it needs.
class PoseComparisons {
 public:
  PoseComparisons(SessionContext& context, ModelMemory& model);

  // Takes a request that was checked. Runs on the planning pool; `done` is called exactly once,
  // there or (on refusal) here. NOT_FOUND: there is no such scan. FAILED_PRECONDITION (SCAN_STATE):
  // it has no alignment, or was withdrawn. RESOURCE_EXHAUSTED (TOO_MANY_EVALUATIONS, MEMORY_SHORT).
  // Else as ModelMemory::WhyNone() and LoadScan().
  void Compare(const v1::CompareScanPosesRequest& request,
               std::function<void(absl::StatusOr<v1::CompareScanPosesResponse>)> done);

 private:
  SessionContext& context_;
  Journal& journal_;
  const SessionDependencies& dependencies_;
  ModelMemory& model_;
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_POSE_COMPARISONS_H_

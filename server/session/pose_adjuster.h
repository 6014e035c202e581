// Brings the poses of a session's scans to where they belong by what ties them to each other
// (chained_poses.h), and merges anew what that moves, on the session's strand.
#ifndef VANTAGE_SERVER_SESSION_POSE_ADJUSTER_H_
#define VANTAGE_SERVER_SESSION_POSE_ADJUSTER_H_

#include <atomic>
#include <vector>

#include "absl/status/status.h"
#include "core/parallel/parallel.h"
#include "server/session/begun_work.h"
#include "server/session/chained_poses.h"
#include "server/session/model_memory.h"
#include "server/session/preparation.h"
#include "server/session/session_context.h"
#include "vantage/v1/pose_graph.pb.h"

namespace vantage::session {

// Thread safe, except for AdjustWhenDue().
class PoseAdjuster {
 public:
  PoseAdjuster(SessionContext& context, ModelMemory& model, Preparation& preparation);

  // Adjusts the poses where links have come or gone since that was done last, and shows the model
  // with them once all that moved is merged anew; plans go on with the one before until then. The
  // model is loaded. Work that cannot be done now is tried again later; what a crash cuts off is
  // done after the restart, since the log says that it is due. To be called on the strand.
  void AdjustWhenDue(parallel::Parallel& parallel);
  // The work that is under way is not counted as one that brought the server to its end.
  void GiveUp() { work_.EndAll(); }

  // What ties the scans to each other as it is now.
  absl::StatusOr<v1::PoseGraph> Describe() const;

 private:
  struct Move {
    v1::Scan scan;  // as it is, with the samples that are in the model
    ChainedPose to;
  };
  absl::Status Adjust(const std::string& work, parallel::Parallel& parallel);
  absl::Status MoveInModel(const std::vector<Move>& moves, parallel::Parallel& parallel);
  absl::Status Log(const std::vector<Move>& moves, double seconds);
  void RetryLater(const absl::Status& why);

  SessionContext& context_;
  ModelMemory& model_;
  Preparation& preparation_;
  BegunWork work_;
  std::atomic<bool> retries_{false};  // it is tried again by itself
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_POSE_ADJUSTER_H_

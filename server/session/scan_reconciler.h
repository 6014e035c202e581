// Brings each scan of a session to the state that its log entry asks for (aligned, judged, merged,
// or taken out again), on the session's strand.
#ifndef VANTAGE_SERVER_SESSION_SCAN_RECONCILER_H_
#define VANTAGE_SERVER_SESSION_SCAN_RECONCILER_H_

#include <map>
#include <mutex>
#include <span>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "core/registration/align/targets.h"
#include "core/sensor/scan.h"
#include "server/session/begun_work.h"
#include "server/session/claims.h"
#include "server/session/doubt_proposals.h"
#include "server/session/journal.h"
#include "server/session/model_memory.h"
#include "server/session/pose_adjuster.h"
#include "server/session/preparation.h"
#include "server/session/session_context.h"
#include "server/session/stations.h"
#include "vantage/v1/scan.pb.h"

namespace vantage::session {

// Thread safe, except for Reconcile().
class ScanReconciler {
 public:
  ScanReconciler(SessionContext& context, ModelMemory& model, Claims& claims, Stations& stations,
                 Preparation& preparation, PoseAdjuster& adjuster, DoubtProposals& proposals);

  // Reconciles a scan soon: its log entry changed.
  void Post(const std::string& scan);
  // Does what the scan's state in the log asks for; nothing when it is done already. Then poses are
  // adjusted where they have to be, and scans in doubt are tried again soon. Work that cannot be
  // done now is tried again later. Must be called on the strand.
  void Reconcile(const std::string& scan, parallel::Parallel& parallel);
  // Retries later all scans whose log entries ask for work.
  void PostUndecidedLater(const absl::Status& why);
  // The work that is under way is not counted as one that brought the server to its end.
  void GiveUp() { work_.EndAll(); }
  // Adds what the log does not have: what is being done now, or why nothing is.
  void AddProgress(v1::Scan& scan) const;

 private:
  void ReconcileScan(const std::string& name, parallel::Parallel& parallel);
  // Aligns and merges what is asked for, with memory reserved.
  void Work(const v1::Scan& scan, MemoryAccount::Reservation& reservation,
            parallel::Parallel& parallel);
  void Align(const v1::Scan& scan, sensor::Scan& data, MemoryAccount::Reservation& reservation,
             parallel::Parallel& parallel);
  // Determines the pose of the session's first scan and sets the prior in `data` to it. An error
  // says why it cannot have one.
  absl::Status PlaceFirst(sensor::Scan& data, std::span<const registration::TargetTie> targets,
                          v1::Scan& placed) const;
  void Merge(const v1::Scan& scan, const sensor::Scan& data,
             MemoryAccount::Reservation& reservation, parallel::Parallel& parallel);
  absl::Status RemoveFromModel(const v1::Scan& scan, parallel::Parallel& parallel);
  // Visits the scans in the model but for one, in the order of their creation; `apart` is how far
  // each stands from a pose, m.
  void ForEachInModel(const std::string& but, const Eigen::Isometry3d& T_model_scan,
                      absl::FunctionRef<void(const ScanRecord&, double apart)> visit) const;
  // The scan in the model that holds the same samples, by name; empty: there is none.
  std::string TwinOf(const v1::Scan& scan, const sensor::Scan& data,
                     const Eigen::Isometry3d& T_model_scan) const;
  // Whether the samples that came in place of a preview are those of another scan; then the preview
  // is put back, with the reason. Also true when that cannot be told now, and is tried again.
  bool PutBackPreview(const v1::Scan& scan, const sensor::Scan& data);
  // The preview that a scan replaces, while it does: its blob and its size.
  std::pair<std::string, int64_t> PreviewOf(const std::string& scan) const;
  // Its data are of no more use.
  void Release(const std::pair<std::string, int64_t>& preview);
  void Refuse(const v1::Scan& scan, v1::ScanState state, const std::string& message,
              const v1::Registration* registration, const v1::PoseReference* reference = nullptr);
  absl::Status Change(
      const v1::Scan& as_read,
      absl::FunctionRef<void(const SessionState&, v1::Scan&, Draft&)> change,
      absl::FunctionRef<void()> applied = [] {});
  // `waited`: what it had waited for before, which is not logged again.
  void RetryLater(const std::string& scan, const absl::Status& why, const std::string& waited = "");

  SessionContext& context_;
  Journal& journal_;
  const SessionDependencies& dependencies_;
  ModelMemory& model_;
  Claims& claims_;
  Stations& stations_;
  Preparation& preparation_;
  PoseAdjuster& adjuster_;
  DoubtProposals& proposals_;
  BegunWork work_;  // on scans, by name; used on the strand

  mutable std::mutex mutex_;
  std::string reconciling_ ABSL_GUARDED_BY(mutex_);  // scan that the strand works on
  // By name of scan: what it waits for until it is tried again.
  std::map<std::string, std::string> waits_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_SCAN_RECONCILER_H_

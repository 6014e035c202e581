// A session's model in memory. It is loaded when it is needed and evicted when it is not, within
// the server's memory account.
#ifndef VANTAGE_SERVER_SESSION_MODEL_MEMORY_H_
#define VANTAGE_SERVER_SESSION_MODEL_MEMORY_H_

#include <Eigen/Geometry>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "core/model/partial_model.h"
#include "core/model/view/algorithm_version.h"
#include "core/model/view/planning_view.h"
#include "server/session/begun_work.h"
#include "server/session/evaluations.h"
#include "server/session/link_surfaces.h"
#include "server/session/memory_account.h"
#include "server/session/prepared_problem.h"
#include "server/session/session_context.h"
#include "server/session/site_prior_use.h"
#include "server/session/stored_snapshots.h"
#include "server/session/tenant_memory.h"
#include "vantage/v1/scan.pb.h"

namespace vantage::session {

// The model at one moment.
struct ModelSnapshot {
  std::shared_ptr<const model::PlanningView> view;  // null while no scan is in the model
  uint64_t version = 0;
};

// Thread safe, except for the functions that must be called on the session's strand.
class ModelMemory {
 public:
  // Reconciles a scan with the log, on the strand.
  using Reconcile = std::function<void(const std::string& scan, parallel::Parallel&)>;
  // Adjusts poses where the log says that it is due, on the strand.
  using AdjustPoses = std::function<void(parallel::Parallel&)>;
  // True when the log has scans for the model, so that it has to be loaded before use.
  enum class Begin { kNew, kToBeLoaded };

  // `empty`: a model without scans, with the session's configuration.
  ModelMemory(SessionContext& context, StoredSnapshots& snapshots,
              std::unique_ptr<model::PartialModel> empty, Begin begin, Reconcile reconcile,
              AdjustPoses adjust_poses);

  ModelSnapshot Current() const;
  // Why Current() has no view. FAILED_PRECONDITION (MODEL_EMPTY): no scan has been merged.
  // DATA_LOSS (DATA_LOST): scans whose data are lost are missing in it (so also CheckWhole()).
  // UNAVAILABLE (MODEL_LOADING): after a restart, or after it was evicted, soon.
  // RESOURCE_EXHAUSTED (MEMORY_SHORT): there is no room for it now. FAILED_PRECONDITION
  // (WORK_SET_ASIDE): loading it has brought the server to its end, and is not tried any more.
  absl::Status WhyNone();
  absl::Status CheckWhole() const;
  bool loaded() const { return loaded_; }
  // Notes that the model is in use; it then stays in memory for a while.
  void Touch();
  absl::Duration LastTouched() const;  // by the time seen

  // Memory of the model, bytes: as counted when it last changed, or, before it was loaded,
  // estimated from its scans.
  int64_t Estimate() const;
  // Memory of decoding and aligning a scan, bytes; what its merge takes is known when it is decoded
  // (core/model/insert_estimate.h).
  static int64_t EstimateAlignment(const v1::Scan& scan);
  // Of the decoded scan, while it is merged.
  static int64_t DecodedBytes(const sensor::Scan& scan);
  // The server's memory, as the session's tenant has it.
  const TenantMemory& memory() const { return memory_; }
  // RESOURCE_EXHAUSTED (MEMORY_SHORT).
  absl::StatusOr<MemoryAccount::Reservation> Reserve(int64_t bytes) const {
    return memory_.Reserve(bytes);
  }
  // Makes a reservation that large. RESOURCE_EXHAUSTED: MEMORY_SHORT, as above; SCAN_TOO_LARGE:
  // that is more than the server has for all models and plans.
  absl::Status Enlarge(MemoryAccount::Reservation& reservation, int64_t bytes) const;
  const model::ModelConfig& config() const { return config_; }
  // Of the model as it is; goes with it.
  PreparedProblem& prepared() { return prepared_; }
  // What the session's prior of the site says of it.
  SitePriorUse& site_prior() { return site_prior_; }
  const SitePriorUse& site_prior() const { return site_prior_; }

  // Loading that is under way is not counted as one that brought the server to its end.
  void GiveUp() { work_.EndAll(); }

  // Begins an evaluation, which keeps the model in memory. Null when the session has reached its
  // limit of them.
  std::shared_ptr<Evaluation> BeginEvaluation();
  // The same of an export. False when the session has reached its limit of them; otherwise the
  // caller must end it.
  bool BeginExport();
  void EndExport() { --exports_; }
  bool InUse() const { return evaluations_.any() || exports_ > 0; }

  // Releases the snapshots of log entries before `sequence`, so that what was taken out of the
  // model by then is in none; false: some are still there, and to be asked for again. Where none is
  // left a new one is written in the background. Where the model could not be made from its scans
  // as it is (the data of one are lost, or older algorithms made it), that comes first.
  bool ReleaseSnapshotsBefore(uint64_t sequence);

  // The functions below must be called on the strand.

  // Loads the model that the log describes, from the newest usable snapshot and the scans after it;
  // then reconciles the scans that wait for it. RESOURCE_EXHAUSTED (MEMORY_SHORT).
  // FAILED_PRECONDITION (WORK_SET_ASIDE): loading it has brought the server to its end before.
  // UNAVAILABLE: the medium fails, or (DRAINING) the server shuts down; it is loaded after the next
  // start.
  absl::Status Load(parallel::Parallel& parallel);
  // Writes a snapshot and evicts the model; if the snapshot cannot be written, the model stays.
  // Views of it that are in use remain valid.
  void Evict(parallel::Parallel& parallel);
  // As in PartialModel. The changes become visible with Show(). When the system has no memory left
  // (std::bad_alloc, which they throw on), Forget() must follow.
  absl::StatusOr<model::MergeReport> Insert(const v1::Scan& scan, const sensor::Scan& data,
                                            const Eigen::Isometry3d& T_model_scan,
                                            parallel::Parallel& parallel, int64_t memory_limit);
  absl::StatusOr<model::MergeReport> Withdraw(const v1::Scan& scan, parallel::Parallel& parallel);
  // Moves scans in the model (PartialModel::Move()), each with the samples that the model has of
  // it. After an error Forget() must follow.
  struct PosedScan {
    v1::Scan scan;
    Eigen::Isometry3d T_model_scan = Eigen::Isometry3d::Identity();
  };
  absl::StatusOr<model::MergeReport> Move(const std::vector<PosedScan>& scans,
                                          parallel::Parallel& parallel, size_t at_once);
  // Of the scans in it; goes with it.
  LinkSurfaces& link_surfaces() { return link_surfaces_; }
  // True when the model holds the preview of a scan that is to come in its place; Insert() puts it
  // there.
  bool HoldsPreviewOf(const v1::Scan& scan) const { return !PreviewKeyOf(scan).empty(); }
  std::shared_ptr<const model::PlanningView> Publish() const { return model_->Publish(); }
  // Also called while the log's lock is held, so that a reader who sees a scan merged gets the
  // model with that scan.
  void Show(ModelSnapshot snapshot);
  // Leaves the model, which may be half changed; who needs it next has it loaded.
  void Forget();
  // Called after scans were added or removed and logged. Reserves the model's memory and writes a
  // snapshot when one is due.
  void Changed(size_t scans);

 private:
  // The name in the model of a scan's samples before those that it has now; empty: there are none.
  std::string PreviewKeyOf(const v1::Scan& scan) const;
  absl::Status BeginLoad();
  void TakeRoom();
  absl::Status Rebuild(parallel::Parallel& parallel);
  void LoadSnapshot(parallel::Parallel& parallel);
  void WriteSnapshot(parallel::Parallel& parallel);
  void RenewSnapshot(uint64_t sequence);
  bool FollowsFromScans() const;
  void PostSnapshot(size_t changes);

  SessionContext& context_;
  StoredSnapshots& snapshots_;
  const model::ModelConfig config_;
  const Reconcile reconcile_;
  const AdjustPoses adjust_poses_;
  const TenantMemory memory_;
  Evaluations evaluations_;
  std::atomic<int> exports_{0};
  std::atomic<bool> loaded_;  // changes on the strand only
  std::atomic<bool> loading_{false};
  std::atomic<int64_t> touched_{0};  // ms of the time seen
  std::atomic<int64_t> counted_{0};  // bytes of the model when it last changed; 0: not yet known

  // Used on the strand only.
  std::unique_ptr<model::PartialModel> model_;
  LinkSurfaces link_surfaces_;
  BegunWork work_;
  MemoryAccount::Reservation reservation_;
  uint32_t algorithm_version_ = model::kModelAlgorithmVersion;
  size_t unsaved_changes_ = 0;  // scans added or removed since the last snapshot

  PreparedProblem prepared_;
  SitePriorUse site_prior_;
  mutable std::mutex mutex_;
  ModelSnapshot current_ ABSL_GUARDED_BY(mutex_);
  // Scans that the log has in the model and that could not be put back: it is not shown then.
  std::vector<std::string> lacks_ ABSL_GUARDED_BY(mutex_);
  absl::Status set_aside_ ABSL_GUARDED_BY(mutex_);  // why it is not loaded any more
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_MODEL_MEMORY_H_

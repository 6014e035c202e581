// One scanning job: its log, its model, its uploads, scans and plans. Free of gRPC.
//
// Commands are checked, logged and answered at once; what they set off (alignment, merge, planning)
// runs on the planning pool, the model's changes on one strand.
#ifndef VANTAGE_SERVER_SESSION_SESSION_H_
#define VANTAGE_SERVER_SESSION_SESSION_H_

#include <Eigen/Core>
#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "core/fleet/claims.h"
#include "core/model/partial_model.h"
#include "core/model/view/algorithm_version.h"
#include "core/model/view/planning_view.h"
#include "server/contract/limits.h"
#include "server/execution/planning_pool.h"
#include "server/execution/strand.h"
#include "server/execution/timer.h"
#include "server/session/algorithms.h"
#include "server/session/journal.h"
#include "server/session/memory_account.h"
#include "server/session/plan_run.h"
#include "server/session/tenant_account.h"
#include "server/session/upload.h"
#include "server/store/store.h"
#include "server/telemetry/log.h"
#include "server/telemetry/metrics.h"
#include "vantage/v1/error.pb.h"
#include "vantage/v1/fleet_service.pb.h"
#include "vantage/v1/model_service.pb.h"
#include "vantage/v1/plan_service.pb.h"
#include "vantage/v1/scan_service.pb.h"
#include "vantage/v1/session_service.pb.h"

namespace vantage::session {

// What sessions live on; all of it outlives them.
struct SessionDependencies {
  store::Store& store;
  execution::PlanningPool& pool;
  execution::Timer& timer;
  telemetry::Log& log;
  contract::Limits limits;
  Algorithms algorithms;
  Journal::Clock clock;
  telemetry::Metrics* metrics = nullptr;  // may be null
  MemoryAccount* memory = nullptr;        // null: no limit
};

// The model at one moment.
struct ModelSnapshot {
  std::shared_ptr<const model::PlanningView> view;  // null while no scan is in the model
  uint64_t version = 0;
};

// Thread safe. Held by shared_ptr: what it set off keeps it.
class Session : public std::enable_shared_from_this<Session> {
 public:
  // Opens a new session of a tenant, who has an account. `session` is complete and checked.
  static absl::StatusOr<std::shared_ptr<Session>> Create(
      const std::string& id, const v1::Session& session, const RequestKey& key,
      const std::string& tenant, TenantAccounts& accounts, const SessionDependencies& dependencies);
  // Loads a session that the store has: folds its log and finds its open uploads. Resume()
  // follows.
  static absl::StatusOr<std::shared_ptr<Session>> Load(const std::string& id,
                                                       TenantAccounts& accounts,
                                                       const SessionDependencies& dependencies);

  // Builds the model and goes on with what was under way, on the strand.
  absl::Status Resume();
  // Adds what of the store it uses: blobs by SHA-256 with how often, and spools by name.
  void AddReferences(std::map<std::string, int>& blobs, std::set<std::string>& spools) const;

  const std::string& id() const { return id_; }
  // Whose it is. Empty: opened when callers were not told apart.
  const std::string& tenant() const { return tenant_; }
  bool BelongsTo(const std::optional<std::string>& tenant) const {
    return !tenant.has_value() || *tenant == tenant_;
  }
  const Eigen::Vector3d& origin() const { return origin_; }
  Journal& journal() { return journal_; }
  const SessionDependencies& dependencies() const { return dependencies_; }

  absl::Time created() const;
  v1::Session Describe() const;  // without its rejections
  v1::Session DescribeWithRejections() const;
  absl::StatusOr<v1::Session> Update(const v1::UpdateSessionRequest& request);

  // Uploads.
  absl::StatusOr<v1::Upload> CreateUpload(const v1::CreateUploadRequest& request);
  absl::StatusOr<v1::Upload> GetUpload(const std::string& name);
  // Takes a piece, a total, both or neither, durably; commits the scan when all of it is there,
  // which an earlier call may have been refused.
  absl::StatusOr<v1::Upload> AddToUpload(const std::string& name, const v1::Piece* piece,
                                         const v1::UploadTotal* total);
  // The same in two steps, so that many pieces share a sync: taken, and then durable. Each returns
  // the upload as far as it is durable.
  absl::StatusOr<v1::Upload> TakeForUpload(const std::string& name, const UnpackedPiece* piece,
                                           const v1::UploadTotal* total);
  absl::StatusOr<v1::Upload> SyncUpload(const std::string& name);
  // Taken and not durable yet.
  int64_t UnsyncedBytes(const std::string& name) const;
  // That is worth a sync.
  bool WindowFull(const std::string& name) const;

  // Scans.
  absl::StatusOr<v1::Scan> GetScan(const std::string& name) const;
  // Created after the one of the name `after` (empty: all), at most `limit`; `more` says whether
  // others follow. So in the other lists. INVALID_ARGUMENT naming `page_token` where there has
  // never been one of that name.
  absl::StatusOr<std::vector<v1::Scan>> ListScans(absl::string_view after, size_t limit,
                                                  bool& more) const;
  absl::StatusOr<v1::Scan> AcceptScan(const v1::AcceptScanRequest& request);
  absl::StatusOr<v1::Scan> SetScanPose(const v1::SetScanPoseRequest& request);
  absl::StatusOr<v1::WithdrawScanResponse> WithdrawScan(const v1::WithdrawScanRequest& request);
  // The range image of a scan. NOT_FOUND: there is no such scan. FAILED_PRECONDITION (SCAN_ERASED).
  // DATA_LOSS: its data are lost (SCAN_LOST) or damaged.
  absl::StatusOr<sensor::RangeImage> LoadImage(const std::string& scan) const;

  // Plans.
  absl::StatusOr<v1::Plan> CreatePlan(const v1::CreatePlanRequest& request);
  absl::StatusOr<v1::Plan> GetPlan(const std::string& name) const;
  // The result with patches and map of scores. FAILED_PRECONDITION (PLAN_DETAIL_RELEASED) when it
  // was let go.
  absl::StatusOr<v1::PlanResult> GetFullResult(const std::string& name) const;
  absl::StatusOr<std::vector<v1::Plan>> ListPlans(absl::string_view after, size_t limit,
                                                  bool& more) const;
  absl::StatusOr<v1::Plan> CancelPlan(const std::string& name);
  // Null when it does not run (any more).
  std::shared_ptr<PlanRun> FindRun(const std::string& name) const;
  absl::StatusOr<v1::Rejection> RejectView(const v1::RejectViewRequest& request);
  // The fleet.
  absl::StatusOr<v1::Scanner> CreateScanner(const v1::CreateScannerRequest& request);
  absl::StatusOr<std::vector<v1::Scanner>> ListScanners(absl::string_view after, size_t limit,
                                                        bool& more) const;
  // Runs on the planning pool; `done` is called exactly once, there or (on refusal) here.
  void ClaimView(const v1::ClaimViewRequest& request,
                 std::function<void(absl::StatusOr<v1::ClaimViewResponse>)> done);
  absl::StatusOr<v1::Claim> RenewClaim(const v1::RenewClaimRequest& request);
  absl::Status ReleaseClaim(const v1::ReleaseClaimRequest& request);
  // Those that are held.
  absl::StatusOr<std::vector<v1::Claim>> ListClaims(absl::string_view after, size_t limit,
                                                    bool& more);
  // Logs the end of claims that are past their time.
  void ExpireClaims();

  // Runs on the planning pool; `done` is called exactly once, there or (on refusal) here.
  void EvaluateView(const v1::EvaluateViewRequest& request,
                    std::function<void(absl::StatusOr<v1::EvaluateViewResponse>)> done);

  // The model.
  ModelSnapshot Model() const;
  // Why Model() has no view. FAILED_PRECONDITION (MODEL_EMPTY): no scan has been merged.
  // UNAVAILABLE (MODEL_LOADING): after a restart, or after it was evicted, soon.
  // RESOURCE_EXHAUSTED (MEMORY_SHORT): there is no room for it now.
  absl::Status WhyNoModel();
  absl::StatusOr<v1::GetCoverageResponse> MeasureCoverage();
  // Whether the model is in memory, and who uses it was last here when.
  bool loaded() const { return loaded_; }
  absl::Time LastTouched() const;
  // What the model takes, by what is known of its scans, bytes.
  int64_t EstimateModel() const;
  // Evicts the model, to its snapshot, if nobody uses it; soon. It comes back when it is needed.
  void PostEvict();
  // False when the session has as many exports under way as it may.
  bool BeginExport();
  void EndExport() { --exports_; }
  // Runs `job` on the planning pool for this session.
  void RunInteractive(execution::PlanningPool::Job job);

  // Ends uploads that were idle for too long.
  void ExpireUploads();
  // Of its last event, or of the last piece of an upload under way.
  absl::Time LastUsed() const;
  // Erases the data of scans that were withdrawn before; how many.
  absl::StatusOr<int> EraseWithdrawnScans(absl::Time before);

  size_t RunningPlans() const;
  size_t OpenUploads() const;
  int PendingScans() const;

  // Stops plans; they end soon.
  void StopPlans(PlanRun::StopReason reason);
  // No plan runs (one may wait until its end can be logged) and the strand rests.
  bool Rests() const;
  // For good: nothing of it is stored any more. Stops plans and drops queued operations.
  void Close();
  // Waits until the strand rests.
  void WaitUntilIdle() { strand_->WaitUntilIdle(); }

 private:
  Session(std::string id, const SessionDependencies& dependencies);
  absl::Status Begin(TenantAccounts& accounts);
  // Blobs that the session made itself: snapshots, plans' details.
  absl::StatusOr<std::string> PutOwnBlob(absl::string_view bytes);
  void ReleaseOwnBlob(const std::string& sha256);

  // Uploads, session_uploads.cc.
  void ResumeUploads();
  absl::Status CommitScan(const std::shared_ptr<Upload>& upload);
  absl::Status FailUpload(Upload& upload, const absl::Status& why);

  // Scans, session_scans.cc: bring a scan to where its log entry wants it.
  void PostReconcile(const std::string& scan);
  void Reconcile(const std::string& scan, parallel::Parallel& parallel);
  void Align(const v1::Scan& scan, sensor::Scan& data, parallel::Parallel& parallel);
  void Merge(const v1::Scan& scan, const sensor::Scan& data, parallel::Parallel& parallel);
  absl::Status RemoveFromModel(const v1::Scan& scan, parallel::Parallel& parallel);
  void Refuse(const v1::Scan& scan, v1::ScanState state, const std::string& message,
              const v1::Registration* registration);
  absl::StatusOr<sensor::Scan> LoadScan(const v1::Scan& scan) const;
  void Show(ModelSnapshot snapshot);
  absl::Status Change(
      const v1::Scan& as_read,
      absl::FunctionRef<void(const SessionState&, v1::Scan&, Draft&)> change,
      absl::FunctionRef<void()> applied = [] {});
  void RetryLater(const std::string& scan, const absl::Status& why);
  void AddProgress(v1::Scan& scan) const;

  // Whether the model is in memory, session_residence.cc.
  void Touch();
  static int64_t EstimateMerge(const v1::Scan& scan);
  absl::StatusOr<MemoryAccount::Reservation> ReserveMemory(int64_t bytes) const;
  absl::Status BeginLoad();
  // Whether there is work for the model, or somebody was here lately.
  bool NeededAtStart() const;
  // Scans on which the log wants something done come again.
  void ReconcileLater(const absl::Status& why);
  // On the strand.
  void ReserveModel();
  absl::Status Load(parallel::Parallel& parallel);
  void Evict(parallel::Parallel& parallel);

  // The model over restarts, session_snapshots.cc; on the strand.
  void Rebuild(parallel::Parallel& parallel);
  void LoadSnapshot(parallel::Parallel& parallel);
  void WriteSnapshot(parallel::Parallel& parallel);
  // So many scans came or went; writes a snapshot when one is due.
  void PostSnapshot(size_t changes);

  // Plans, session_plans.cc.
  struct PlanInputs;
  absl::StatusOr<PlanInputs> PlanInputsFor(const std::string& scanner_model_id,
                                           const v1::PlanningConfig& overrides,
                                           const std::string& prefix);
  // RESOURCE_EXHAUSTED (PLAN_TOO_LARGE), as the plan itself would be refused.
  static absl::Status CheckSize(const PlanInputs& inputs);
  // Takes the memory that a plan will need.
  absl::Status ReservePlan(PlanInputs& inputs) const;
  // Adds the scanners that are named and the claims that hold to what a plan is made of.
  absl::Status AddFleet(const v1::CreatePlanRequest& request, PlanInputs& inputs) const;
  void RunPlan(const std::shared_ptr<PlanRun>& run, const PlanInputs& inputs, absl::Time submitted,
               parallel::Parallel& parallel);
  void EndPlan(const std::shared_ptr<PlanRun>& run, v1::Plan plan,
               const std::shared_ptr<const v1::PlanResult>& full);
  void EndPlanLater(const std::shared_ptr<PlanRun>& run, v1::Plan plan,
                    const std::shared_ptr<const v1::PlanResult>& full, const absl::Status& why);

  // The fleet, session_fleet.cc.
  struct ClaimAttempt;
  absl::StatusOr<ClaimAttempt> MeasureClaim(const PlanInputs& inputs,
                                            const Eigen::Vector3d& position,
                                            parallel::Parallel& parallel) const;
  void AddAlternative(const v1::Scanner& scanner, PlanInputs inputs, parallel::Parallel& parallel,
                      v1::ClaimConflict& conflict) const;
  absl::StatusOr<v1::Claim> TakeClaim(const v1::ClaimViewRequest& request,
                                      const v1::Scanner& scanner, const PlanInputs& inputs,
                                      parallel::Parallel& parallel);
  absl::Status EndClaim(const std::string& name, fleet::ClaimEnd how, const std::string& scan,
                        const RequestKey& key);
  void WatchExpiry(const v1::Claim& claim);
  // The claim that a scan with a pose fulfils, by name; empty: none.
  std::string FulfilledClaim(const SessionState& state, const v1::Scan& scan) const;
  void ResumeClaims();

  const std::string id_;
  const std::string name_;
  const SessionDependencies dependencies_;
  Journal journal_;
  std::string tenant_;  // as its log begins; set once
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  std::shared_ptr<AccountShare> account_;
  const std::shared_ptr<execution::PlanningPool::Share> share_;
  const std::shared_ptr<execution::Strand> strand_;
  std::atomic<bool> closed_{false};
  std::atomic<int> evaluations_{0};
  std::atomic<int> exports_{0};
  std::atomic<bool> loaded_{true};  // changes on the strand only
  std::atomic<bool> loading_{false};
  std::atomic<int64_t> touched_{0};  // ms since 1970

  // Touched on the strand only.
  std::unique_ptr<model::PartialModel> model_;
  MemoryAccount::Reservation model_reservation_;
  uint32_t model_algorithm_version_ = model::kModelAlgorithmVersion;
  size_t unsaved_changes_ = 0;  // scans that came or went since the last snapshot

  mutable std::mutex snapshots_mutex_;  // held while they are written to the store
  std::vector<store::SnapshotRecord> snapshots_ ABSL_GUARDED_BY(snapshots_mutex_);  // newest first

  mutable std::mutex mutex_;
  ModelSnapshot snapshot_ ABSL_GUARDED_BY(mutex_);
  std::string reconciling_ ABSL_GUARDED_BY(mutex_);  // scan that the strand works on
  // What scans wait for, until they are tried again: by name.
  std::map<std::string, std::string> waits_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, std::shared_ptr<Upload>> uploads_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, std::shared_ptr<PlanRun>> runs_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::string> full_results_ ABSL_GUARDED_BY(mutex_);  // blobs held, oldest first
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_SESSION_H_

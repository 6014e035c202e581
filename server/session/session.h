// One scanning job: its tenant, its log and its parts (uploads, scans, plans, claims, the model in
// memory). It does not know gRPC.
//
// Commands are checked, logged and answered at once. The work that they start (alignment, merge,
// planning) runs on the planning pool; changes of the model run on one strand. The header of each
// part says what its lock guards; session_context.h has the order of the locks.
#ifndef VANTAGE_SERVER_SESSION_SESSION_H_
#define VANTAGE_SERVER_SESSION_SESSION_H_

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/model/partial_model.h"
#include "server/session/claims.h"
#include "server/session/doubt_proposals.h"
#include "server/session/journal.h"
#include "server/session/model_memory.h"
#include "server/session/plans.h"
#include "server/session/pose_adjuster.h"
#include "server/session/pose_comparisons.h"
#include "server/session/preparation.h"
#include "server/session/rejections.h"
#include "server/session/scan_reconciler.h"
#include "server/session/scanners.h"
#include "server/session/scans.h"
#include "server/session/session_context.h"
#include "server/session/site_priors.h"
#include "server/session/stations.h"
#include "server/session/stored_snapshots.h"
#include "server/session/tenant_account.h"
#include "server/session/tours.h"
#include "server/session/uploads.h"
#include "vantage/v1/model_service.pb.h"
#include "vantage/v1/session_service.pb.h"

namespace vantage::session {

// Thread safe. Held by shared_ptr, since the work that it started keeps it alive.
class Session final : public SessionContext {
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

  // Loads the model and resumes unfinished work, on the strand.
  absl::Status Resume();
  // Adds what the session uses of the store: blobs by SHA-256 with the number of uses, and spools
  // by name.
  void AddReferences(std::map<std::string, int>& blobs, std::set<std::string>& spools) const;

  bool BelongsTo(const std::optional<std::string>& other) const {
    return !other.has_value() || *other == tenant();
  }
  absl::Time created() const;
  // Whether the filter of a list lets it through.
  bool Matches(const v1::ListSessionsRequest& filter) const;
  v1::Session Describe() const;  // without its rejections
  v1::Session DescribeWithRejections() const;
  // Takes the request as it came: its mask names fields of the message that the log stores.
  absl::StatusOr<v1::Session> Update(const v1::UpdateSessionRequest& request);

  Uploads& uploads() { return uploads_; }
  Scans& scans() { return scans_; }
  PoseComparisons& pose_comparisons() { return pose_comparisons_; }
  Plans& plans() { return plans_; }
  Tours& tours() { return tours_; }
  Claims& claims() { return claims_; }
  Stations& stations() { return stations_; }
  Scanners& scanners() { return scanners_; }
  Rejections& rejections() { return rejections_; }
  SitePriors& site_priors() { return site_priors_; }
  const PoseAdjuster& adjuster() const { return adjuster_; }
  ModelMemory& model() { return model_; }
  const Preparation& preparation() const { return preparation_; }

  absl::StatusOr<v1::GetCoverageResponse> MeasureCoverage();
  // Calls `done` with what ties the scans in the model to each other, or with why that cannot be
  // told.
  void DescribePoseGraph(std::function<void(absl::StatusOr<v1::GetPoseGraphResponse>)> done);

  // Evicts the model soon, after a snapshot, if it is not in use. It is loaded again when it is
  // needed.
  void PostEvict();
  // When its last event was, or the last piece of an open upload, by the time seen.
  absl::Duration LastUsed() const;
  // True when no plan is running (one may wait until its end can be logged) or being prepared, the
  // model is not being read, and the strand is idle.
  bool Rests() const;
  // Waits until the strand is idle.
  void WaitUntilIdle() { strand().WaitUntilIdle(); }
  // The time of a shutdown is over: work that is under way is given up, for the next start.
  void GiveUp();
  // Closes the session for good: nothing more is stored. Stops plans and drops queued operations.
  void Close();

 private:
  static absl::StatusOr<std::shared_ptr<Session>> Make(const std::string& id,
                                                       std::unique_ptr<Journal> journal,
                                                       ModelMemory::Begin begin,
                                                       std::vector<store::SnapshotRecord> snapshots,
                                                       TenantAccounts& accounts,
                                                       const SessionDependencies& dependencies);
  Session(const std::string& id, std::unique_ptr<Journal> journal,
          std::unique_ptr<model::PartialModel> empty, ModelMemory::Begin begin,
          std::vector<store::SnapshotRecord> snapshots, TenantAccounts& accounts,
          const SessionDependencies& dependencies);

  // A part knows only parts above it, except that the model, once loaded, has scans reconciled.
  StoredSnapshots snapshots_;
  ModelMemory model_;
  Claims claims_;
  Stations stations_;
  Preparation preparation_;
  PoseAdjuster adjuster_;
  DoubtProposals proposals_;
  ScanReconciler reconciler_;
  Scans scans_;
  PoseComparisons pose_comparisons_;
  Uploads uploads_;
  Plans plans_;
  Tours tours_;
  Scanners scanners_;
  Rejections rejections_;
  SitePriors site_priors_;
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_SESSION_H_

// What the parts of a session share: tenant, log, account, and the strand, pool and timer for its
// work.
//
// Locks in the order in which they are taken. A thread that holds one must not take another of the
// same line or of a line above, nor call code that might:
//
//   SessionRegistry, collecting
//   SessionRegistry, creating or deleting
//   MemoryAccount, telling a shortage
//   SessionRegistry, its state
//   Upload, committing
//   Journal, compacting
//   Journal, writing
//   Journal, its state
//   Uploads | Plans | Tours | Preparation | ModelMemory | SitePriorUse | PreparedProblem |
//   ScanReconciler | StoredSnapshots | Upload, syncing
//   Upload | PlanRun TourRun AccountShare BegunWork | LostScans | Journal, watchers |
//   MemoryAccount, and those of what sessions live on:
//     store, pool, strand, timer, tenant's account, FileReadings
//
// FileReadings::Forget() waits for a reader that takes any of these below "SessionRegistry,
// creating or deleting": nobody who holds one may call it.
//
// Scans, Claims, Scanners, Rejections and SitePriors have no lock, since their state is in the
// journal. Members of ModelMemory that are used on the strand only need none.
#ifndef VANTAGE_SERVER_SESSION_SESSION_CONTEXT_H_
#define VANTAGE_SERVER_SESSION_SESSION_CONTEXT_H_

#include <Eigen/Core>
#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "server/contract/limits.h"
#include "server/execution/planning_pool.h"
#include "server/execution/seen_time.h"
#include "server/execution/strand.h"
#include "server/execution/timer.h"
#include "server/session/algorithms.h"
#include "server/session/file_readings.h"
#include "server/session/journal.h"
#include "server/session/lost_scans.h"
#include "server/session/memory_account.h"
#include "server/session/tenant_account.h"
#include "server/store/store.h"
#include "server/telemetry/log.h"
#include "server/telemetry/metrics.h"

namespace vantage::session {

// What all sessions share; all of it outlives them.
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
  // By which ages are counted. Null: from the start of the registry that gets these.
  std::shared_ptr<execution::SeenTime> seen = nullptr;
  // Who reads files. Null: the registry that gets these makes one.
  std::shared_ptr<FileReadings> files = nullptr;

  Journal::SeenClock SeenClock() const {
    return [seen = seen] { return seen->Now(); };
  }
};

// Thread safe: everything except `closed`, `draining`, `halted` and the origin is constant. It is
// the base of Session, so that work that a part starts keeps the whole session alive.
class SessionContext : public std::enable_shared_from_this<SessionContext> {
 public:
  SessionContext(const SessionContext&) = delete;
  SessionContext& operator=(const SessionContext&) = delete;

  const std::string& id() const { return id_; }
  const std::string& name() const { return name_; }
  // The tenant. Empty: the session was opened on a server that did not tell callers apart.
  const std::string& tenant() const { return tenant_; }
  // Origin of the model frame in the world frame, m. It changes at most once, before the first
  // scan.
  Eigen::Vector3d origin() const;
  // To be called when the log says another one.
  void ReadOrigin();
  Journal& journal() { return *journal_; }
  const Journal& journal() const { return *journal_; }
  const SessionDependencies& dependencies() const { return dependencies_; }
  const std::shared_ptr<AccountShare>& account() const { return account_; }
  LostScans& lost_scans() const { return lost_scans_; }
  // RESOURCE_EXHAUSTED (LOG_FULL): commands that add to the session are refused; those that take
  // away, and what the server does by itself, are not.
  absl::Status CheckLog() const;
  // Compacts the log, on the planning pool, where it has grown enough for that.
  void CompactLogWhenDue();
  // Closed for good: nothing new is started.
  bool closed() const { return closed_; }
  // The server shuts down: what can be done after the next start is put off.
  bool draining() const { return draining_; }
  void BeginDrain() { draining_ = true; }
  // The time of the shutdown is over: nothing is begun any more.
  bool halted() const { return halted_; }
  void Halt() { halted_ = true; }
  // Why work that somebody waits for is not done: ABORTED: the session was deleted. UNAVAILABLE
  // (DRAINING). RESOURCE_EXHAUSTED (MEMORY_SHORT), while an exception is under way.
  absl::Status Dropped() const;

  // Queues an operation on the strand, where all changes of the model run in order. False, without
  // effect, when the queue is full or the session is closed.
  [[nodiscard]] bool TryPost(execution::Strand::Operation operation);
  // Operations on the strand, waiting or running.
  size_t Operations() const { return strand_->Size(); }
  // Runs `job` on the planning pool for this session. `seconds`: that a plan is meant to take.
  // Returns the job's number in the pool.
  uint64_t Submit(execution::JobPriority priority, execution::PlanningPool::Job job,
                  double seconds = 0);
  void RunInteractive(execution::PlanningPool::Job job) {
    Submit(execution::JobPriority::kInteractive, std::move(job));
  }
  // Runs `call` on the timer's thread if the session still exists; it must be quick.
  void After(std::chrono::nanoseconds delay, std::function<void()> call);

  // Blobs that the session made itself: snapshots, plans' details. They count for its account.
  absl::StatusOr<std::string> PutOwnBlob(absl::string_view bytes);
  // The same of what somebody gave it. RESOURCE_EXHAUSTED (QUOTA_EXCEEDED).
  absl::StatusOr<std::string> PutGivenBlob(absl::string_view bytes);
  void ReleaseOwnBlob(const std::string& sha256);

 protected:
  // `journal` has the session's creation. Takes the account's room for what its scans keep.
  SessionContext(std::string id, std::unique_ptr<Journal> journal, TenantAccounts& accounts,
                 const SessionDependencies& dependencies);
  ~SessionContext() = default;

  execution::Strand& strand() { return *strand_; }
  // The first step of closing: the log accepts nothing more.
  void CloseLog();

 private:
  const std::string id_;
  const std::string name_;
  const SessionDependencies dependencies_;
  const std::unique_ptr<Journal> journal_;
  const std::string tenant_;
  mutable std::mutex origin_mutex_;
  Eigen::Vector3d origin_;  // guarded by origin_mutex_
  const std::shared_ptr<AccountShare> account_;
  mutable LostScans lost_scans_;  // it guards itself
  const std::shared_ptr<execution::PlanningPool::Share> share_;
  const std::shared_ptr<execution::Strand> strand_;
  std::atomic<bool> closed_{false};
  std::atomic<bool> draining_{false};
  std::atomic<bool> halted_{false};
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_SESSION_CONTEXT_H_

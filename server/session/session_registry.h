// The sessions of a server.
#ifndef VANTAGE_SERVER_SESSION_SESSION_REGISTRY_H_
#define VANTAGE_SERVER_SESSION_SESSION_REGISTRY_H_

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "server/session/imports.h"
#include "server/session/session.h"

namespace vantage::session {

// The result of a collection.
struct Collected {
  int sessions = 0;
  int scans = 0;
  bool operator==(const Collected&) const = default;
};

// Totals of all sessions.
struct SessionTotals {
  size_t sessions = 0;
  size_t left_out = 0;  // damaged
  size_t loaded = 0;    // with a model in memory
  size_t uploads = 0;
  size_t plans = 0;  // queued or running
  int pending_scans = 0;
};

// A position in the order of creation: behind the session with this id and this time of creation.
struct SessionPlace {
  std::string id;  // empty: before all of them
  absl::Time created = absl::InfinitePast();
};

// Thread safe.
class SessionRegistry {
 public:
  explicit SessionRegistry(const SessionDependencies& dependencies);
  ~SessionRegistry();

  // Loads every session that the store has. One that is damaged is left out and reported: its id
  // stays reserved, and nothing that is stored is removed until every session can be loaded.
  absl::Status LoadAll();

  // RESOURCE_EXHAUSTED (QUOTA_EXCEEDED): the tenant has no room left.
  absl::StatusOr<std::shared_ptr<Session>> Create(const v1::CreateSessionRequest& request,
                                                  const std::string& tenant = "");
  // Takes a piece of an archive; with the last one the session is there. Errors as of
  // Imports::Take(), and ALREADY_EXISTS (SESSION_EXISTS), TOO_MANY_SESSIONS.
  absl::StatusOr<v1::ImportSessionResponse> Import(const v1::ImportSessionRequest& request,
                                                   const std::string& tenant = "");
  // By id. NOT_FOUND, also for sessions of other tenants. DATA_LOSS (SESSION_DAMAGED): it was left
  // out.
  absl::StatusOr<std::shared_ptr<Session>> Find(
      const std::string& id, const std::optional<std::string>& tenant = {}) const;
  // Oldest first: those created after the one at `after`, of `tenant` where one is given, that
  // `filter` lets through.
  std::vector<std::shared_ptr<Session>> List(
      const SessionPlace& after, size_t limit, bool& more,
      const std::optional<std::string>& tenant = {},
      const v1::ListSessionsRequest& filter = v1::ListSessionsRequest()) const;
  // `request_id`: a request that is sent again is answered as before; empty: it has none. Gives up
  // a session that was left out. Returns when it was deleted. NOT_FOUND, also for sessions of other
  // tenants.
  absl::StatusOr<absl::Time> Delete(const std::string& id, const std::string& request_id = "",
                                    const std::optional<std::string>& tenant = {});
  // Removes uploads that were idle for too long, data of withdrawn scans, and sessions without
  // events; Limits has the times, which are of the time seen. Scans and sessions go at a later
  // call, `second_look` after the first that found them past their time. To be called regularly.
  Collected Collect();

  SessionTotals Totals() const;
  // Lets go of prepared problems, at once, and evicts models soon, the longest unused first, until
  // what lacks is free; a model that was used lately stays, unless its tenant has more than its
  // share and the one who lacks has not.
  void FreeMemory(const MemoryAccount::Shortage& shortage);

  // Bytes that a tenant's sessions store.
  int64_t UsedBy(const std::string& tenant) { return accounts_.Of(tenant)->used(); }

  // From now on new work is refused, running plans end with their best ranking, and watchers are
  // informed.
  void BeginDrain();
  bool draining() const;
  // UNAVAILABLE (DRAINING) with RetryInfo once draining, else OK.
  absl::Status CheckTakesWork() const;
  // Waits until no plan is running and every strand is idle. False when that took longer than
  // `patience`.
  bool WaitUntilIdle(std::chrono::milliseconds patience) const;
  // Nothing is begun any more, and what is under way is left to the next start.
  void GiveUp();

  // `call` runs when draining begins. It may still be running when Unwatch returns.
  uint64_t WatchDrain(std::function<void()> call);
  void UnwatchDrain(uint64_t id);

  const SessionDependencies& dependencies() const { return dependencies_; }

 private:
  // A session that the store has and that cannot be loaded.
  struct LeftOut {
    std::optional<std::string> tenant;  // nullopt: not known
    std::string why;
  };

  std::optional<std::string> TenantOf(const std::string& id) const;
  bool SaysDamaged(const std::string& id, const std::string& tenant) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  const LeftOut* FindLeftOut(const std::string& id, const std::optional<std::string>& tenant) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Drops a log, remembering the deletion where one is given.
  absl::Status Drop(const std::string& id, const store::DeletionRecord* deletion);
  // `deletion`: that asks for it; null: nobody does, its time is over.
  absl::Status Erase(const std::shared_ptr<Session>& session, const store::DeletionRecord* deletion)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(create_mutex_);
  absl::Status Sweep(const std::map<std::string, int>& blobs, const std::set<std::string>& spools);
  std::string FreshId() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // RESOURCE_EXHAUSTED (TOO_MANY_SESSIONS): there is no place for another one of the tenant.
  absl::Status CheckPlace(const std::string& tenant) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // ALREADY_EXISTS (SESSION_EXISTS).
  absl::Status CheckFree(const std::string& id, const std::string& tenant) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // The session that a request made; null: there is none.
  std::shared_ptr<Session> MadeBy(const std::string& request, const std::string& tenant) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::StatusOr<std::shared_ptr<Session>> Adopt(SessionImport& import, const std::string& tenant);

  const SessionDependencies dependencies_;
  TenantAccounts accounts_;
  Imports imports_;
  std::mutex collect_mutex_;
  // What was found past its time, by name, and when first.
  std::map<std::string, absl::Duration> past_ ABSL_GUARDED_BY(collect_mutex_);
  // Guards no member: one creation or deletion at a time, the store's part included.
  std::mutex create_mutex_ ABSL_ACQUIRED_BEFORE(mutex_);
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<Session>> sessions_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::string> order_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, LeftOut> left_out_ ABSL_GUARDED_BY(mutex_);  // by id
  // By tenant and request_id: session.
  std::map<std::pair<std::string, std::string>, std::string> creations_ ABSL_GUARDED_BY(mutex_);
  // The last deletions, so that a repeated deletion has the same answer. The store has them, too.
  std::deque<store::DeletionRecord> deletions_ ABSL_GUARDED_BY(mutex_);
  bool draining_ ABSL_GUARDED_BY(mutex_) = false;
  std::map<uint64_t, std::shared_ptr<std::function<void()>>> watchers_ ABSL_GUARDED_BY(mutex_);
  uint64_t next_watch_ ABSL_GUARDED_BY(mutex_) = 1;
  std::mt19937_64 random_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_SESSION_REGISTRY_H_

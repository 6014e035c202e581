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
#include "server/session/session.h"

namespace vantage::session {

// What a collection took away.
struct Collected {
  int sessions = 0;
  int scans = 0;
  bool operator==(const Collected&) const = default;
};

// What there is, all sessions together.
struct SessionTotals {
  size_t sessions = 0;
  size_t loaded = 0;  // with a model in memory
  size_t uploads = 0;
  size_t plans = 0;  // queued or running
  int pending_scans = 0;
};

// A place in the order of creation: behind the session of this id that was created then.
struct SessionPlace {
  std::string id;  // empty: before all of them
  absl::Time created = absl::InfinitePast();
};

// Thread safe.
class SessionRegistry {
 public:
  explicit SessionRegistry(const SessionDependencies& dependencies);
  ~SessionRegistry();

  // Loads every session that the store has.
  absl::Status LoadAll();

  // RESOURCE_EXHAUSTED (QUOTA_EXCEEDED): the tenant has no room left.
  absl::StatusOr<std::shared_ptr<Session>> Create(const v1::CreateSessionRequest& request,
                                                  const std::string& tenant = "");
  // By id. NOT_FOUND, also for those of others than `tenant`.
  absl::StatusOr<std::shared_ptr<Session>> Find(
      const std::string& id, const std::optional<std::string>& tenant = {}) const;
  // Oldest first: those created after the one at `after`, of `tenant` where one is given.
  std::vector<std::shared_ptr<Session>> List(const SessionPlace& after, size_t limit, bool& more,
                                             const std::optional<std::string>& tenant = {}) const;
  absl::Status Delete(const v1::DeleteSessionRequest& request,
                      const std::optional<std::string>& tenant = {});
  // Collects what is past its time: uploads that were idle for too long, data of withdrawn scans,
  // sessions without events (Limits says after how long). Called now and then.
  Collected Collect();

  SessionTotals Totals() const;
  // Evicts the models of sessions that nobody has used for longest and for a while, until so
  // many bytes are free; soon.
  void FreeMemory(int64_t bytes);

  // Bytes that a tenant's sessions keep.
  int64_t UsedBy(const std::string& tenant) { return accounts_.Of(tenant)->used(); }

  // From now on new work is refused, plans end with their best, and watchers are told.
  void BeginDrain();
  bool draining() const;
  // UNAVAILABLE (DRAINING) with RetryInfo once draining, else OK.
  absl::Status CheckTakesWork() const;
  // Waits until no plan runs and every strand rests; false when that took longer.
  bool WaitUntilIdle(std::chrono::milliseconds patience) const;

  // `call` runs when draining begins. It may still be running when Unwatch returns.
  uint64_t WatchDrain(std::function<void()> call);
  void UnwatchDrain(uint64_t id);

  const SessionDependencies& dependencies() const { return dependencies_; }

 private:
  // Under create_mutex_.
  absl::Status Erase(const std::shared_ptr<Session>& session);
  absl::Status Sweep(const std::map<std::string, int>& blobs, const std::set<std::string>& spools);
  std::string FreshId() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const SessionDependencies dependencies_;
  TenantAccounts accounts_;
  std::mutex create_mutex_;  // one creation or deletion at a time
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<Session>> sessions_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::string> order_ ABSL_GUARDED_BY(mutex_);
  // By tenant and request_id: session.
  std::map<std::pair<std::string, std::string>, std::string> creations_ ABSL_GUARDED_BY(mutex_);
  // The last deletions, so that repeating one is harmless.
  struct Deletion {
    std::string request;
    std::string session;
    std::string tenant;
  };
  std::deque<Deletion> deletions_ ABSL_GUARDED_BY(mutex_);
  bool draining_ ABSL_GUARDED_BY(mutex_) = false;
  std::map<uint64_t, std::shared_ptr<std::function<void()>>> watchers_ ABSL_GUARDED_BY(mutex_);
  uint64_t next_watch_ ABSL_GUARDED_BY(mutex_) = 1;
  std::mt19937_64 random_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_SESSION_REGISTRY_H_

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
#include <random>
#include <set>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "server/session/session.h"

namespace vantage {

// What a collection took away.
struct Collected {
  int sessions = 0;
  int scans = 0;
  bool operator==(const Collected&) const = default;
};

// Thread safe.
class SessionRegistry {
 public:
  explicit SessionRegistry(const SessionSurroundings& around);
  ~SessionRegistry();

  // Takes up every session that the store has.
  absl::Status LoadAll();

  // RESOURCE_EXHAUSTED (QUOTA_EXCEEDED): the tenant has no room left.
  absl::StatusOr<std::shared_ptr<Session>> Create(const v1::CreateSessionRequest& request,
                                                  const std::string& tenant = "");
  // By id. NOT_FOUND.
  absl::StatusOr<std::shared_ptr<Session>> Find(const std::string& id) const;
  // Oldest first: those created after the first `skip`.
  std::vector<std::shared_ptr<Session>> List(size_t skip, size_t limit, bool& more) const;
  absl::Status Delete(const v1::DeleteSessionRequest& request);
  // Collects what is past its time: uploads that were idle for too long, data of withdrawn scans,
  // sessions without events (Limits says after how long). Called now and then.
  Collected Collect();

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

  const SessionSurroundings& around() const { return around_; }

 private:
  // Under create_mutex_.
  absl::Status Erase(const std::shared_ptr<Session>& session);
  absl::Status Sweep(const std::map<std::string, int>& blobs, const std::set<std::string>& spools);
  std::string FreshId() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const SessionSurroundings around_;
  TenantAccounts accounts_;
  std::mutex create_mutex_;  // one creation or deletion at a time
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<Session>> sessions_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::string> order_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, std::string> creations_ ABSL_GUARDED_BY(mutex_);  // request_id: session
  // The last deletions, by request_id, so that repeating one is harmless.
  std::deque<std::pair<std::string, std::string>> deletions_ ABSL_GUARDED_BY(mutex_);
  bool draining_ ABSL_GUARDED_BY(mutex_) = false;
  std::map<uint64_t, std::shared_ptr<std::function<void()>>> watchers_ ABSL_GUARDED_BY(mutex_);
  uint64_t next_watch_ ABSL_GUARDED_BY(mutex_) = 1;
  std::mt19937_64 random_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage

#endif  // VANTAGE_SERVER_SESSION_SESSION_REGISTRY_H_

// Bytes that each tenant stores on the server, and its quota.
#ifndef VANTAGE_SERVER_SESSION_TENANT_ACCOUNT_H_
#define VANTAGE_SERVER_SESSION_TENANT_ACCOUNT_H_

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"

namespace vantage::session {

// Counts bytes of scans (open uploads with their announced size), snapshots and plans' details.
// Data that several sessions share count for each of them. Thread safe.
class TenantAccount {
 public:
  // `quota` in bytes; 0: none.
  TenantAccount(std::string tenant, int64_t quota) : tenant_(std::move(tenant)), quota_(quota) {}

  // Takes room. RESOURCE_EXHAUSTED (QUOTA_EXCEEDED): there is not enough, and nothing was taken.
  absl::Status Reserve(int64_t bytes);
  // For data that are stored already or that the server adds by itself; never refused.
  void Add(int64_t bytes);
  void GiveBack(int64_t bytes) { Add(-bytes); }
  int64_t used() const;

 private:
  const std::string tenant_;
  const int64_t quota_;
  mutable std::mutex mutex_;
  int64_t used_ ABSL_GUARDED_BY(mutex_) = 0;
};

// Thread safe. There is one account for each tenant with sessions.
class TenantAccounts {
 public:
  explicit TenantAccounts(int64_t quota) : quota_(quota) {}
  std::shared_ptr<TenantAccount> Of(const std::string& tenant);

 private:
  const int64_t quota_;
  std::mutex mutex_;
  std::map<std::string, std::weak_ptr<TenantAccount>> accounts_ ABSL_GUARDED_BY(mutex_);
};

// The share of a tenant's account that one session uses. When the session is closed, all of it is
// returned and no more can be taken. Thread safe.
class AccountShare {
 public:
  explicit AccountShare(std::shared_ptr<TenantAccount> account) : account_(std::move(account)) {}
  ~AccountShare() { Close(); }
  AccountShare(const AccountShare&) = delete;
  AccountShare& operator=(const AccountShare&) = delete;

  absl::Status Reserve(int64_t bytes);
  void Add(int64_t bytes);
  void GiveBack(int64_t bytes) { Add(-bytes); }
  // The bytes of the session's log, of which so many are free; the rest counts.
  static constexpr int64_t kFreeLogBytes = 1 << 20;
  void AddLog(int64_t bytes);
  void Close();

 private:
  const std::shared_ptr<TenantAccount> account_;
  std::mutex mutex_;
  int64_t held_ ABSL_GUARDED_BY(mutex_) = 0;
  int64_t log_ ABSL_GUARDED_BY(mutex_) = 0;  // bytes, those that are free included
  bool closed_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_TENANT_ACCOUNT_H_

// What each tenant keeps on the server, against its quota.
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

// Bytes of scans (those on their way with all that was announced), snapshots and plans' details.
// What several sessions share counts for each of them. Thread safe.
class TenantAccount {
 public:
  // `quota` in bytes; 0: none.
  TenantAccount(std::string tenant, int64_t quota) : tenant_(std::move(tenant)), quota_(quota) {}

  // Takes room. RESOURCE_EXHAUSTED (QUOTA_EXCEEDED): there is not so much, and nothing was taken.
  absl::Status Reserve(int64_t bytes);
  // What is there already, or what the server adds by itself: never refused.
  void Add(int64_t bytes);
  void GiveBack(int64_t bytes) { Add(-bytes); }
  int64_t used() const;

 private:
  const std::string tenant_;
  const int64_t quota_;
  mutable std::mutex mutex_;
  int64_t used_ ABSL_GUARDED_BY(mutex_) = 0;
};

// Thread safe. Accounts are as many as there are tenants with sessions.
class TenantAccounts {
 public:
  explicit TenantAccounts(int64_t quota) : quota_(quota) {}
  std::shared_ptr<TenantAccount> Of(const std::string& tenant);

 private:
  const int64_t quota_;
  std::mutex mutex_;
  std::map<std::string, std::weak_ptr<TenantAccount>> accounts_ ABSL_GUARDED_BY(mutex_);
};

// What one session has of its tenant's account. All of it goes back when the session is closed, and
// nothing is taken any more. Thread safe.
class AccountShare {
 public:
  explicit AccountShare(std::shared_ptr<TenantAccount> account) : account_(std::move(account)) {}
  ~AccountShare() { Close(); }
  AccountShare(const AccountShare&) = delete;
  AccountShare& operator=(const AccountShare&) = delete;

  absl::Status Reserve(int64_t bytes);
  void Add(int64_t bytes);
  void GiveBack(int64_t bytes) { Add(-bytes); }
  void Close();

 private:
  const std::shared_ptr<TenantAccount> account_;
  std::mutex mutex_;
  int64_t held_ ABSL_GUARDED_BY(mutex_) = 0;
  bool closed_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_TENANT_ACCOUNT_H_

#include "server/session/tenant_account.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "server/contract/error.h"

namespace vantage::session {
namespace {

std::string Mebibytes(int64_t bytes) {
  return absl::StrFormat("%.1f MiB", static_cast<double>(bytes) / (1 << 20));
}

}  // namespace

absl::Status TenantAccount::Reserve(int64_t bytes) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (quota_ == 0 || bytes <= quota_ - used_) {
    used_ += bytes;
    return absl::OkStatus();
  }
  const std::string who = tenant_.empty() ? "" : absl::StrCat(" of tenant '", tenant_, "'");
  return contract::ErrorWithReason(
      absl::StatusCode::kResourceExhausted, "QUOTA_EXCEEDED",
      absl::StrCat("the quota", who, " is ", Mebibytes(quota_), ", ", Mebibytes(used_),
                   " of it are used, and ", Mebibytes(bytes),
                   " more are needed; delete sessions, or have the operator raise quota-mib"),
      {{"quota_bytes", absl::StrCat(quota_)},
       {"used_bytes", absl::StrCat(used_)},
       {"needed_bytes", absl::StrCat(bytes)}});
}

void TenantAccount::Add(int64_t bytes) {
  std::lock_guard<std::mutex> lock(mutex_);
  used_ += bytes;
}

int64_t TenantAccount::used() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return used_;
}

std::shared_ptr<TenantAccount> TenantAccounts::Of(const std::string& tenant) {
  std::lock_guard<std::mutex> lock(mutex_);
  std::shared_ptr<TenantAccount> account = accounts_[tenant].lock();
  if (account == nullptr) {
    std::erase_if(accounts_, [](const auto& entry) { return entry.second.expired(); });
    account = std::make_shared<TenantAccount>(tenant, quota_);
    accounts_[tenant] = account;
  }
  return account;
}

absl::Status AccountShare::Reserve(int64_t bytes) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (closed_) return absl::OkStatus();
  absl::Status taken = account_->Reserve(bytes);
  if (taken.ok()) held_ += bytes;
  return taken;
}

void AccountShare::Add(int64_t bytes) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (closed_) return;
  account_->Add(bytes);
  held_ += bytes;
}

void AccountShare::AddLog(int64_t bytes) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (closed_) return;
  const int64_t counted = std::max<int64_t>(0, log_ - kFreeLogBytes);
  log_ += bytes;
  const int64_t more = std::max<int64_t>(0, log_ - kFreeLogBytes) - counted;
  account_->Add(more);
  held_ += more;
}

void AccountShare::Close() {
  std::lock_guard<std::mutex> lock(mutex_);
  account_->GiveBack(held_);
  held_ = 0;
  closed_ = true;
}

}  // namespace vantage::session

#include "server/session/memory_account.h"

#include <algorithm>
#include <chrono>

namespace vantage::session {
namespace {

// Of the budget: what a tenant beyond its share leaves to one who has nothing yet. A flat's model
// and plan take 100 MB; an eighth of the smallest server (1 GiB) is that.
constexpr int64_t kLeftPart = 8;

}  // namespace

MemoryAccount::Reservation& MemoryAccount::Reservation::operator=(Reservation&& other) noexcept {
  if (this == &other) return *this;
  Release();
  account_ = std::exchange(other.account_, nullptr);
  tenant_ = std::move(other.tenant_);
  bytes_ = std::exchange(other.bytes_, 0);
  return *this;
}

void MemoryAccount::Reservation::Set(int64_t bytes) {
  if (account_ == nullptr) return;
  account_->Change(tenant_, bytes - bytes_);
  bytes_ = bytes;
}

bool MemoryAccount::Reservation::Grow(int64_t bytes) {
  if (account_ == nullptr || bytes <= bytes_) return true;
  if (!account_->ChangeWithin(tenant_, bytes - bytes_, /*alone=*/false)) return false;
  bytes_ = bytes;
  return true;
}

std::optional<MemoryAccount::Reservation> MemoryAccount::Take(const std::string& tenant,
                                                              int64_t bytes) {
  if (bytes < 0) return std::nullopt;
  if (!ChangeWithin(tenant, bytes, /*alone=*/true)) return std::nullopt;
  return Reservation(this, tenant, bytes);
}

std::optional<MemoryAccount::Reservation> MemoryAccount::TakeSpare(const std::string& tenant,
                                                                   int64_t bytes) {
  if (bytes < 0) return std::nullopt;
  std::lock_guard<std::mutex> lock(mutex_);
  const int64_t left = std::max(LeftToOthers(tenant), budget_ / kLeftPart);
  if (budget_ > 0 && used_ + bytes + left > budget_) return std::nullopt;
  Add(tenant, bytes);
  return Reservation(this, tenant, bytes);
}

bool MemoryAccount::ChangeWithin(const std::string& tenant, int64_t by, bool alone) {
  Shortage shortage;
  if (TryChange(tenant, by, alone, shortage)) return true;
  {
    std::lock_guard<std::mutex> lock(shortage_mutex_);
    if (!shortage_) return false;
    shortage_(shortage);
  }
  return TryChange(tenant, by, alone, shortage);
}

bool MemoryAccount::TryChange(const std::string& tenant, int64_t by, bool alone,
                              Shortage& shortage) {
  std::lock_guard<std::mutex> lock(mutex_);
  const absl::Duration now = now_();
  std::erase_if(tenants_, [&](const auto& other) {
    return other.second.used == 0 && other.second.until <= now;
  });
  const auto of = tenants_.find(tenant);
  const int64_t after = by + (of != tenants_.end() ? of->second.used : 0);
  const bool within_share = after <= Share(tenant);
  const int64_t left = within_share ? 0 : LeftToOthers(tenant);
  if (budget_ <= 0 || (alone && used_ == 0) || used_ + by + left <= budget_) {
    if (of != tenants_.end()) of->second.waits_for = 0;
    Add(tenant, by);
    return true;
  }
  shortage = {used_ + by + left - budget_, tenant, within_share};
  if (within_share && !tenant.empty()) {
    Tenant& waiting = tenants_[tenant];
    waiting.waits_for = by;
    waiting.until = now + kWaits;
  }
  return false;
}

int64_t MemoryAccount::Share(const std::string& tenant) const {
  if (tenant.empty()) return budget_;
  const absl::Duration now = now_();
  int64_t others = 0;
  for (const auto& [name, other] : tenants_) {
    const bool counts = other.used > 0 || (other.waits_for > 0 && other.until > now);
    others += name != tenant && counts ? 1 : 0;
  }
  return std::min(budget_ / (others + 1), Most(tenant));
}

int64_t MemoryAccount::Most(const std::string& tenant) const {
  return tenant.empty() ? budget_ : budget_ - budget_ / kLeftPart;
}

int64_t MemoryAccount::LeftToOthers(const std::string& tenant) const {
  if (tenant.empty()) return 0;
  const absl::Duration now = now_();
  int64_t waited_for = 0;
  for (const auto& [name, other] : tenants_) {
    if (name != tenant && other.until > now) waited_for += other.waits_for;
  }
  return std::max(waited_for, budget_ / kLeftPart);
}

bool MemoryAccount::BeyondShare(const std::string& tenant) const {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto of = tenants_.find(tenant);
  return of != tenants_.end() && of->second.used > Share(tenant);
}

void MemoryAccount::OnShortage(std::function<void(const Shortage&)> call) {
  std::lock_guard<std::mutex> lock(shortage_mutex_);
  shortage_ = std::move(call);
}

int64_t MemoryAccount::used() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return used_;
}

void MemoryAccount::Change(const std::string& tenant, int64_t by) {
  std::lock_guard<std::mutex> lock(mutex_);
  Add(tenant, by);
}

void MemoryAccount::Add(const std::string& tenant, int64_t by) {
  used_ += by;
  Tenant& of = tenants_[tenant];
  of.used += by;
}

absl::Duration MemoryAccount::SteadyTime() {
  return absl::FromChrono(std::chrono::steady_clock::now().time_since_epoch());
}

}  // namespace vantage::session

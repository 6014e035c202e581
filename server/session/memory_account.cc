#include "server/session/memory_account.h"

namespace vantage::session {

MemoryAccount::Reservation& MemoryAccount::Reservation::operator=(Reservation&& other) noexcept {
  if (this == &other) return *this;
  Release();
  account_ = std::exchange(other.account_, nullptr);
  bytes_ = std::exchange(other.bytes_, 0);
  return *this;
}

void MemoryAccount::Reservation::Set(int64_t bytes) {
  if (account_ == nullptr) return;
  account_->Change(bytes - bytes_);
  bytes_ = bytes;
}

bool MemoryAccount::Reservation::Grow(int64_t bytes) {
  if (account_ == nullptr || bytes <= bytes_) return true;
  if (!account_->ChangeWithin(bytes - bytes_)) return false;
  bytes_ = bytes;
  return true;
}

bool MemoryAccount::ChangeWithin(int64_t by) {
  int64_t lacks = 0;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (budget_ <= 0 || used_ + by <= budget_) {
      used_ += by;
      return true;
    }
    lacks = used_ + by - budget_;
  }
  std::lock_guard<std::mutex> lock(shortage_mutex_);
  if (shortage_) shortage_(lacks);
  return false;
}

std::optional<MemoryAccount::Reservation> MemoryAccount::Take(int64_t bytes) {
  int64_t lacks = 0;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (budget_ <= 0 || used_ == 0 || used_ + bytes <= budget_) {
      used_ += bytes;
      return Reservation(this, bytes);
    }
    lacks = used_ + bytes - budget_;
  }
  std::lock_guard<std::mutex> lock(shortage_mutex_);
  if (shortage_) shortage_(lacks);
  return std::nullopt;
}

void MemoryAccount::OnShortage(std::function<void(int64_t)> call) {
  std::lock_guard<std::mutex> lock(shortage_mutex_);
  shortage_ = std::move(call);
}

int64_t MemoryAccount::used() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return used_;
}

void MemoryAccount::Change(int64_t by) {
  std::lock_guard<std::mutex> lock(mutex_);
  used_ += by;
}

}  // namespace vantage::session

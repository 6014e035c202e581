// The memory that the server may use, and its reservations. Reservations are estimates, made before
// the memory is allocated.
#ifndef VANTAGE_SERVER_SESSION_MEMORY_ACCOUNT_H_
#define VANTAGE_SERVER_SESSION_MEMORY_ACCOUNT_H_

#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <utility>

#include "absl/base/thread_annotations.h"

namespace vantage::session {

// Thread safe. Outlives its reservations.
class MemoryAccount {
 public:
  // A part of the account, given back at the end. Not thread safe.
  class Reservation {
   public:
    Reservation() = default;
    ~Reservation() { Release(); }
    Reservation(Reservation&& other) noexcept
        : account_(std::exchange(other.account_, nullptr)),
          bytes_(std::exchange(other.bytes_, 0)) {}
    Reservation& operator=(Reservation&& other) noexcept;

    int64_t bytes() const { return bytes_; }
    // Reserves memory that is in use already; never refused.
    void Set(int64_t bytes);
    // Makes it that large; false, without effect, when the account has no room for that.
    bool Grow(int64_t bytes);
    void Release() { Set(0); }

   private:
    friend class MemoryAccount;
    Reservation(MemoryAccount* account, int64_t bytes) : account_(account), bytes_(bytes) {}
    MemoryAccount* account_ = nullptr;
    int64_t bytes_ = 0;
  };

  // `budget` in bytes; 0: no limit.
  explicit MemoryAccount(int64_t budget) : budget_(budget) {}

  // Nothing when there is not enough. While nothing is reserved, a reservation may exceed the
  // budget, so that what needs more than the budget can be tried alone.
  std::optional<Reservation> Take(int64_t bytes);
  // An empty reservation, for Set() later.
  Reservation Empty() { return {this, 0}; }

  // Called on the thread whose reservation was refused, with the missing bytes.
  void OnShortage(std::function<void(int64_t)> call);
  void OnNoShortage() { OnShortage(nullptr); }

  int64_t used() const;
  int64_t budget() const { return budget_; }

 private:
  void Change(int64_t by);
  bool ChangeWithin(int64_t by);

  const int64_t budget_;
  mutable std::mutex mutex_;
  int64_t used_ ABSL_GUARDED_BY(mutex_) = 0;
  std::mutex shortage_mutex_;  // held while it is called
  std::function<void(int64_t)> shortage_ ABSL_GUARDED_BY(shortage_mutex_);
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_MEMORY_ACCOUNT_H_

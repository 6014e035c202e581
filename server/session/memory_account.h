// The memory that the server may use, and its reservations. Reservations are estimates, made before
// the memory is allocated. Each tenant has a share, which it gets whatever others ask for.
#ifndef VANTAGE_SERVER_SESSION_MEMORY_ACCOUNT_H_
#define VANTAGE_SERVER_SESSION_MEMORY_ACCOUNT_H_

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/time/time.h"

namespace vantage::session {

// The share is the budget over the tenants that have or wait for memory, seven eighths of it for
// one alone. Within it a tenant takes what is free. Beyond it a tenant leaves an eighth of the
// budget free, and what others were refused of their shares of late. Sessions of no tenant, on
// servers that do not tell callers apart, have no share: what is free is theirs. Thread safe.
// Outlives its reservations.
class MemoryAccount {
 public:
  // A reservation that was refused.
  struct Shortage {
    int64_t lacks = 0;   // bytes
    std::string tenant;  // whose it would be
    bool within_share = false;
  };
  // A part of the account, given back at the end. Not thread safe.
  class Reservation {
   public:
    Reservation() = default;
    ~Reservation() { Release(); }
    Reservation(Reservation&& other) noexcept
        : account_(std::exchange(other.account_, nullptr)),
          tenant_(std::move(other.tenant_)),
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
    Reservation(MemoryAccount* account, std::string tenant, int64_t bytes)
        : account_(account), tenant_(std::move(tenant)), bytes_(bytes) {}
    MemoryAccount* account_ = nullptr;
    std::string tenant_;
    int64_t bytes_ = 0;
  };

  // What is refused counts as waited for so long: people and programs are told to try again sooner.
  static constexpr absl::Duration kWaits = absl::Seconds(30);

  // `budget` in bytes; 0: no limit. `now`: of a clock that never goes back.
  explicit MemoryAccount(int64_t budget, std::function<absl::Duration()> now = SteadyTime)
      : budget_(budget), now_(std::move(now)) {}

  // Nothing when there is not enough for the tenant (empty: for sessions of none). While nothing is
  // reserved, a reservation may exceed the budget, so that what needs more than the budget can be
  // tried alone.
  std::optional<Reservation> Take(const std::string& tenant, int64_t bytes);
  // The same of what is free and beyond the eighth that is left to others. Where there is too
  // little nobody is told, and nobody waits.
  std::optional<Reservation> TakeSpare(const std::string& tenant, int64_t bytes);
  // An empty reservation, for Set() later.
  Reservation Empty(const std::string& tenant) { return {this, tenant, 0}; }

  // Called on the thread whose reservation does not fit. What it frees is there for that
  // reservation.
  void OnShortage(std::function<void(const Shortage&)> call);
  void OnNoShortage() { OnShortage(nullptr); }

  int64_t used() const;
  int64_t budget() const { return budget_; }
  // The most that a tenant can ever have beside something else, bytes.
  int64_t Most(const std::string& tenant) const;
  // Whether a tenant has more than its share.
  bool BeyondShare(const std::string& tenant) const;

 private:
  struct Tenant {
    int64_t used = 0;
    int64_t waits_for = 0;  // bytes that were refused within its share
    absl::Duration until;   // by now_
  };
  static absl::Duration SteadyTime();
  void Change(const std::string& tenant, int64_t by);
  // Adds `by` where it may be had; `alone`: also where nothing is reserved.
  bool ChangeWithin(const std::string& tenant, int64_t by, bool alone);
  // The same without telling of a shortage. Sets `shortage` where it returns false.
  bool TryChange(const std::string& tenant, int64_t by, bool alone, Shortage& shortage);
  void Add(const std::string& tenant, int64_t by) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  int64_t Share(const std::string& tenant) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // What one who takes beyond the share has to leave free.
  int64_t LeftToOthers(const std::string& tenant) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const int64_t budget_;
  const std::function<absl::Duration()> now_;
  mutable std::mutex mutex_;
  int64_t used_ ABSL_GUARDED_BY(mutex_) = 0;
  std::map<std::string, Tenant> tenants_ ABSL_GUARDED_BY(mutex_);  // those who have or wait
  std::mutex shortage_mutex_;                                      // held while it is called
  std::function<void(const Shortage&)> shortage_ ABSL_GUARDED_BY(shortage_mutex_);
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_MEMORY_ACCOUNT_H_

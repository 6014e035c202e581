#include "server/execution/steadied_clock.h"

#include <utility>

namespace vantage::execution {

SteadiedClock::SteadiedClock(Wall wall, SeenTime::Steady steady, OnJump on_jump)
    : wall_(std::move(wall)),
      steady_(std::move(steady)),
      on_jump_(std::move(on_jump)),
      epoch_(wall_() - steady_()) {}

absl::Time SteadiedClock::Now() {
  absl::Duration by;
  bool tell = false;
  bool followed = false;
  absl::Time now;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    const absl::Duration steady = steady_();
    const absl::Time epoch = wall_() - steady;
    if (absl::AbsDuration(epoch - epoch_) < kJump) {
      tell = jumped_;
      jumped_ = false;
      epoch_ = epoch;
    } else if (!jumped_ || absl::AbsDuration(epoch - other_) >= kJump) {
      tell = true;
      jumped_ = true;
      other_ = epoch;
      since_ = steady;
      by = epoch - epoch_;
    } else if (steady - since_ >= kBelieveAfter) {
      tell = true;
      followed = true;
      by = epoch - epoch_;
      jumped_ = false;
      epoch_ = epoch;
    }
    now = epoch_ + steady;
  }
  if (tell) on_jump_(by, followed);
  return now;
}

}  // namespace vantage::execution

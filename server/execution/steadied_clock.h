// The wall clock, which does not follow a jump at once: a clock that is wrong for a moment (a bad
// time server, a battery that is empty) changes nothing.
#ifndef VANTAGE_SERVER_EXECUTION_STEADIED_CLOCK_H_
#define VANTAGE_SERVER_EXECUTION_STEADIED_CLOCK_H_

#include <functional>
#include <mutex>

#include "absl/base/thread_annotations.h"
#include "absl/time/time.h"
#include "server/execution/seen_time.h"

namespace vantage::execution {

// Thread safe.
class SteadiedClock {
 public:
  using Wall = std::function<absl::Time()>;
  // What happened to the wall clock: it is `by` ahead (negative: behind) of what it should say.
  // `followed`: it has said so for kBelieveAfter, and is believed from now on. A `by` of zero: it
  // is right again.
  using OnJump = std::function<void(absl::Duration by, bool followed)>;

  // Smaller steps are followed at once.
  static constexpr absl::Duration kJump = absl::Seconds(5);
  // A jump is followed when the clock goes on from there for so long.
  static constexpr absl::Duration kBelieveAfter = absl::Minutes(1);

  SteadiedClock(Wall wall, SeenTime::Steady steady, OnJump on_jump);

  absl::Time Now();

 private:
  const Wall wall_;
  const SeenTime::Steady steady_;
  const OnJump on_jump_;
  std::mutex mutex_;
  absl::Time epoch_ ABSL_GUARDED_BY(mutex_);      // the believed time when the steady clock was 0
  bool jumped_ ABSL_GUARDED_BY(mutex_) = false;   // and is not believed yet
  absl::Time other_ ABSL_GUARDED_BY(mutex_);      // the same by the clock that jumped
  absl::Duration since_ ABSL_GUARDED_BY(mutex_);  // by the steady clock
};

}  // namespace vantage::execution

#endif  // VANTAGE_SERVER_EXECUTION_STEADIED_CLOCK_H_

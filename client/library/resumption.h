// Decides whether and when to continue after a link broke.
#ifndef VANTAGE_CLIENT_LIBRARY_RESUMPTION_H_
#define VANTAGE_CLIENT_LIBRARY_RESUMPTION_H_

#include "absl/status/status.h"
#include "client/library/backoff.h"
#include "client/library/wire.h"

namespace vantage::client {

class Resumption {
 public:
  // `give_up_after` in s, counted from the last progress.
  explicit Resumption(double give_up_after)
      : give_up_after_(give_up_after), backoff_(RandomSeed()), last_progress_(SteadyClock::now()) {}

  void Progress() {
    last_progress_ = SteadyClock::now();
    backoff_.Reset();
  }

  // Waits and returns OK when a new attempt makes sense, else returns the failure at once.
  absl::Status AfterBreak(const absl::Status& failure) {
    if (!IsTransient(failure) || SecondsSince(last_progress_) > give_up_after_) return failure;
    SleepSeconds(backoff_.Next(Explain(failure).retry_seconds));
    return absl::OkStatus();
  }

 private:
  double give_up_after_;
  Backoff backoff_;
  SteadyClock::time_point last_progress_;
};

}  // namespace vantage::client

#endif  // VANTAGE_CLIENT_LIBRARY_RESUMPTION_H_

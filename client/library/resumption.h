// Decides whether and when to continue after a link broke.
#ifndef VANTAGE_CLIENT_LIBRARY_RESUMPTION_H_
#define VANTAGE_CLIENT_LIBRARY_RESUMPTION_H_

#include "absl/status/status.h"
#include "client/library/backoff.h"
#include "client/library/wire.h"

namespace vantage::client {

class Resumption {
 public:
  // The wire outlives it.
  explicit Resumption(const Wire& wire)
      : wire_(wire), backoff_(RandomSeed()), last_progress_(SteadyClock::now()) {}

  void Progress() {
    last_progress_ = SteadyClock::now();
    backoff_.Reset();
  }

  // Waits and returns OK when a new attempt makes sense, else returns the failure at once: it is
  // not transient, or nothing came through for the wire's `give_up_after`.
  absl::Status AfterBreak(const absl::Status& failure) {
    if (!IsTransient(failure) || SecondsSince(last_progress_) > wire_.options.give_up_after) {
      return failure;
    }
    wire_.Wait(backoff_.Next(Explain(failure).retry_seconds));
    return absl::OkStatus();
  }

 private:
  const Wire& wire_;
  Backoff backoff_;
  SteadyClock::time_point last_progress_;
};

}  // namespace vantage::client

#endif  // VANTAGE_CLIENT_LIBRARY_RESUMPTION_H_

// Patience with a server that has to load the model of a job first.
#ifndef VANTAGE_CLIENT_LIBRARY_LOADING_WAIT_H_
#define VANTAGE_CLIENT_LIBRARY_LOADING_WAIT_H_

#include <algorithm>
#include <optional>

#include "absl/status/status.h"
#include "client/library/error.h"
#include "client/library/wire.h"

namespace vantage::client {

// Of one call, all its attempts.
class LoadingWait {
 public:
  explicit LoadingWait(const ClientOptions& options) : options_(options) {}
  ~LoadingWait() {
    if (since_ && options_.on_loading) options_.on_loading(std::nullopt);
  }
  LoadingWait(const LoadingWait&) = delete;
  LoadingWait& operator=(const LoadingWait&) = delete;

  // True, after a wait, where the failure says that the model is being loaded and there is patience
  // left: the call is to be tried again.
  bool After(const absl::Status& failure) {
    if (!absl::IsUnavailable(failure)) return false;
    const Explanation why = Explain(failure);
    if (why.reason != "MODEL_LOADING") return false;
    if (!since_) since_ = SteadyClock::now();
    const double waited = SecondsSince(*since_);
    if (waited > options_.loading_patience) return false;
    if (options_.on_loading) options_.on_loading(waited);
    SleepSeconds(std::clamp(why.retry_seconds.value_or(1), 0.05, 5.0));
    return true;
  }

 private:
  const ClientOptions& options_;
  std::optional<SteadyClock::time_point> since_;
};

}  // namespace vantage::client

#endif  // VANTAGE_CLIENT_LIBRARY_LOADING_WAIT_H_

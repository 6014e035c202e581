// How often each of many callers may call.
#ifndef VANTAGE_SERVER_AUTH_RATE_LIMITS_H_
#define VANTAGE_SERVER_AUTH_RATE_LIMITS_H_

#include <chrono>
#include <cstddef>
#include <map>
#include <mutex>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/time/time.h"

namespace vantage::auth {

// A token bucket for each key. Thread safe. Its memory is bounded for any keys.
class RateLimits {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // `per_second` in the long run, `at_once` (>= 1) after a rest. `per_second` 0: no limit.
  // Beyond `max_keys` that were seen lately, new ones share a bucket.
  RateLimits(double per_second, double at_once, size_t max_keys = 10'000)
      : per_second_(per_second), at_once_(at_once), max_keys_(max_keys) {}

  // Takes one call from `key`'s bucket. Zero: the call may go on; else the time to wait.
  absl::Duration Take(const std::string& key, Time now);

  // The same, but takes none.
  absl::Duration Wait(const std::string& key, Time now) const;

  size_t keys() const;

 private:
  struct Bucket {
    double left = 0;  // at `at`
    Time at;
  };

  absl::Duration UntilOne(double left) const;
  double LeftAt(const Bucket& bucket, Time now) const;
  Bucket& BucketOf(const std::string& key, Time now) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const double per_second_;
  const double at_once_;
  const size_t max_keys_;
  mutable std::mutex mutex_;
  std::map<std::string, Bucket> buckets_ ABSL_GUARDED_BY(mutex_);
  Bucket others_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage::auth

#endif  // VANTAGE_SERVER_AUTH_RATE_LIMITS_H_

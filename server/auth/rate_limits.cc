#include "server/auth/rate_limits.h"

#include <algorithm>

namespace vantage::auth {

// Zero would mean that the call may go on, so a wait is at least the clock's resolution.
absl::Duration RateLimits::UntilOne(double left) const {
  if (left >= 1) return absl::ZeroDuration();
  return std::max(absl::Seconds((1 - left) / per_second_), absl::Microseconds(1));
}

double RateLimits::LeftAt(const Bucket& bucket, Time now) const {
  const double rested = std::chrono::duration<double>(now - bucket.at).count();
  return std::min(at_once_, bucket.left + std::max(0.0, rested) * per_second_);
}

RateLimits::Bucket& RateLimits::BucketOf(const std::string& key, Time now) {
  const auto known = buckets_.find(key);
  if (known != buckets_.end()) return known->second;
  if (buckets_.size() >= max_keys_) {
    // A full bucket equals a new one, so it can go.
    std::erase_if(buckets_, [&](const auto& b) { return LeftAt(b.second, now) >= at_once_; });
    if (buckets_.size() >= max_keys_) return others_;
  }
  return buckets_.emplace(key, Bucket{at_once_, now}).first->second;
}

absl::Duration RateLimits::Take(const std::string& key, Time now) {
  if (per_second_ <= 0) return absl::ZeroDuration();
  std::lock_guard<std::mutex> lock(mutex_);
  Bucket& bucket = BucketOf(key, now);
  bucket.left = LeftAt(bucket, now);
  bucket.at = now;
  if (bucket.left < 1) return UntilOne(bucket.left);
  bucket.left -= 1;
  return absl::ZeroDuration();
}

absl::Duration RateLimits::Wait(const std::string& key, Time now) const {
  if (per_second_ <= 0) return absl::ZeroDuration();
  std::lock_guard<std::mutex> lock(mutex_);
  const auto known = buckets_.find(key);
  if (known != buckets_.end()) return UntilOne(LeftAt(known->second, now));
  return buckets_.size() < max_keys_ ? absl::ZeroDuration() : UntilOne(LeftAt(others_, now));
}

size_t RateLimits::keys() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return buckets_.size();
}

}  // namespace vantage::auth

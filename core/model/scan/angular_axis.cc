#include "core/model/scan/angular_axis.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace vantage::model {

namespace {
constexpr double kTurn = 2 * std::numbers::pi;
}

AngularAxis::AngularAxis(std::vector<double> angles, bool closed)
    : angles_(std::move(angles)), closed_(closed) {
  for (size_t i = 1; i < angles_.size(); ++i) {
    widest_step_ = std::max(widest_step_, angles_[i] - angles_[i - 1]);
  }
  if (closed_) widest_step_ = std::max(widest_step_, first() + kTurn - last());
  mean_step_ = closed_ ? kTurn / static_cast<double>(angles_.size())
                       : (last() - first()) / static_cast<double>(angles_.size() - 1);
  steps_per_rad_ = 1 / mean_step_;
  even_ = true;
  for (size_t i = 0; i < angles_.size(); ++i) {
    const double even = first() + static_cast<double>(i) * mean_step_;
    if (std::abs(angles_[i] - even) > 1e-6 * mean_step_) even_ = false;
  }
  lower_limit_ = first() - (angles_[1] - angles_[0]) / 2;
  upper_limit_ = last() + (last() - angles_[angles_.size() - 2]) / 2;

  const double extent = closed_ ? kTurn : last() - first();
  const size_t buckets = 2 * angles_.size();
  buckets_per_rad_ = static_cast<double>(buckets) / extent;
  bucket_.resize(buckets + 1);
  size_t index = 0;
  for (size_t b = 0; b <= buckets; ++b) {
    const double start = first() + static_cast<double>(b) / buckets_per_rad_;
    while (index + 1 < angles_.size() && angles_[index + 1] <= start) ++index;
    bucket_[b] = static_cast<int32_t>(index);
  }
}

double AngularAxis::Wrapped(double angle) const {
  double turned = angle - first();
  if (turned < 0 || turned >= kTurn) {
    turned -= kTurn * std::floor(turned / kTurn);
    if (turned >= kTurn) turned = 0;  // a tiny negative number rounds up to a whole turn
  }
  return first() + turned;
}

int AngularAxis::LowerIndex(double angle) const {
  const size_t b =
      std::min(static_cast<size_t>((angle - first()) * buckets_per_rad_), bucket_.size() - 1);
  int index = bucket_[b];
  while (index > 0 && angles_[static_cast<size_t>(index)] > angle) --index;
  while (index + 1 < size() && angles_[static_cast<size_t>(index) + 1] <= angle) ++index;
  return index;
}

AngularAxis::Position AngularAxis::LocateAny(double angle) const {
  Position at;
  if (closed_) {
    const double a = Wrapped(angle);
    at.inside = true;
    at.lower = LowerIndex(a);
    const bool wraps = at.lower + 1 == size();
    at.upper = wraps ? 0 : at.lower + 1;
    const double low = angles_[static_cast<size_t>(at.lower)];
    const double high = wraps ? first() + kTurn : angles_[static_cast<size_t>(at.upper)];
    at.fraction = static_cast<float>((a - low) / (high - low));
    return at;
  }
  at.inside = angle >= lower_limit_ && angle <= upper_limit_;
  if (!at.inside) return at;
  if (angle <= first()) {
    at.lower = at.upper = 0;
  } else if (angle >= last()) {
    at.lower = at.upper = size() - 1;
  } else {
    at.lower = LowerIndex(angle);
    at.upper = at.lower + 1;
    const double low = angles_[static_cast<size_t>(at.lower)];
    at.fraction =
        static_cast<float>((angle - low) / (angles_[static_cast<size_t>(at.upper)] - low));
  }
  return at;
}

AngularAxis::Span AngularAxis::Cover(double low, double high) const {
  Span span;
  if (closed_) {
    if (high - low >= kTurn) {
      span.count = 1;
      span.last[0] = size() - 1;
      return span;
    }
    const int from = LowerIndex(Wrapped(low));
    const Position end = Locate(high);
    const int to = end.upper;
    // A span that comes back to where it began covers the whole turn.
    if (high - low > kTurn - 2 * widest_step_) {
      span.count = 1;
      span.last[0] = size() - 1;
    } else if (from <= to) {
      span.count = 1;
      span.first[0] = from;
      span.last[0] = to;
    } else {
      span.count = 2;
      span.first[0] = from;
      span.last[0] = size() - 1;
      span.first[1] = 0;
      span.last[1] = to;
    }
    return span;
  }
  if (high < lower_limit_ || low > upper_limit_) {
    span.cut = true;
    return span;
  }
  span.cut = low < lower_limit_ || high > upper_limit_;
  span.count = 1;
  span.first[0] = low <= first() ? 0 : LowerIndex(std::min(low, last()));
  span.last[0] = high <= first() ? 0 : std::min(LowerIndex(std::min(high, last())) + 1, size() - 1);
  return span;
}

}  // namespace vantage::model

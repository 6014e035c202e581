// How much of a budget is spent. A unit of work is one candidate looked at for one element, in
// whatever step: about a nanosecond.
#ifndef VANTAGE_CORE_COVER_METER_H_
#define VANTAGE_CORE_COVER_METER_H_

#include <cstdint>

#include "core/parallel/budget.h"

namespace vantage::cover {

class Meter {
 public:
  explicit Meter(parallel::Budget budget) : budget_(std::move(budget)) {}

  void Add(uint64_t work) { done_ += work; }
  uint64_t done() const { return done_; }
  bool Over() const { return done_ >= budget_.work_limit || budget_.Expired(); }
  // Nobody waits for an answer, not even a poor one.
  bool Cancelled() const { return budget_.cancelled.stop_requested(); }

  // A meter for a share of what is left, which has done what this one has; Resume() takes over what
  // it did.
  Meter Part(double share) const {
    Meter part(budget_.Part(share, done_));
    part.done_ = done_;
    return part;
  }
  void Resume(const Meter& part) { done_ = part.done_; }

 private:
  parallel::Budget budget_;
  uint64_t done_ = 0;
};

}  // namespace vantage::cover

#endif  // VANTAGE_CORE_COVER_METER_H_

// Whether work is still wanted.
#ifndef VANTAGE_CORE_PARALLEL_CANCELLATION_H_
#define VANTAGE_CORE_PARALLEL_CANCELLATION_H_

#include <stop_token>
#include <utility>

#include "core/parallel/budget.h"

namespace vantage::parallel {

// Asked between bounded pieces of work, from any thread. Work that makes an object has no deadline
// of its own: it is done, or nobody wants it any more.
class Cancellation {
 public:
  // Never requested.
  Cancellation() = default;
  explicit Cancellation(std::stop_token token) : token_(std::move(token)) {}
  // For work that is a part of something with a budget: requested when that has expired. Keeps the
  // reference.
  Cancellation(const Budget& budget) : budget_(&budget) {}  // NOLINT(google-explicit-constructor)

  bool Requested() const {
    return token_.stop_requested() || (budget_ != nullptr && budget_->Expired());
  }

 private:
  std::stop_token token_;
  const Budget* budget_ = nullptr;
};

}  // namespace vantage::parallel

#endif  // VANTAGE_CORE_PARALLEL_CANCELLATION_H_

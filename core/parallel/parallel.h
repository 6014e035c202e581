// The interface behind which parallel work runs. Core code never starts threads of its own: it is
// handed a Parallel, so that a server can keep every thread inside one fair-shared pool and a test
// can run serially.
#ifndef VANTAGE_CORE_PARALLEL_PARALLEL_H_
#define VANTAGE_CORE_PARALLEL_PARALLEL_H_

#include <cstddef>

#include "absl/functional/function_ref.h"

namespace vantage::parallel {

class Parallel {
 public:
  virtual ~Parallel() = default;

  // The number of bodies that may run at the same time, at least 1.
  virtual int width() const = 0;

  // Calls body(i) for every i in [0, count), in any order and on any thread, and returns when all
  // calls have returned. The calling thread takes part. Bodies must not depend on one another. They
  // throw nothing but std::bad_alloc, which a server's pool hands to the caller (others end there).
  // Results must not depend on the order: write to slot i, reduce afterwards.
  virtual void For(size_t count, absl::FunctionRef<void(size_t)> body) = 0;
};

// Runs everything on the calling thread.
class Serial final : public Parallel {
 public:
  int width() const override { return 1; }
  void For(size_t count, absl::FunctionRef<void(size_t)> body) override {
    for (size_t i = 0; i < count; ++i) body(i);
  }
};

}  // namespace vantage::parallel

#endif  // VANTAGE_CORE_PARALLEL_PARALLEL_H_

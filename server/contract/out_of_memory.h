// What becomes of work for which there is no memory: it ends with an error, and nothing else does.
#ifndef VANTAGE_SERVER_CONTRACT_OUT_OF_MEMORY_H_
#define VANTAGE_SERVER_CONTRACT_OUT_OF_MEMORY_H_

#include <new>

#include "absl/status/status.h"

namespace vantage::contract {

// RESOURCE_EXHAUSTED (MEMORY_SHORT).
absl::Status OutOfMemory();

// What `work` returns, an absl::Status or absl::StatusOr, or OutOfMemory() when the system had no
// memory for it (std::bad_alloc). What it changed until then stays changed.
template <typename Work>
auto UnlessOutOfMemory(Work&& work) -> decltype(work()) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return OutOfMemory();
  }
}

}  // namespace vantage::contract

#endif  // VANTAGE_SERVER_CONTRACT_OUT_OF_MEMORY_H_

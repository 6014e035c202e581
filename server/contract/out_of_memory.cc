#include "server/contract/out_of_memory.h"

#include "server/contract/error.h"

namespace vantage::contract {

absl::Status OutOfMemory() {
  return Retryable(absl::StatusCode::kResourceExhausted, "MEMORY_SHORT",
                   "the server had no memory left for this; try again, or ask for less",
                   absl::Seconds(5));
}

}  // namespace vantage::contract

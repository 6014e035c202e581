// The calls that are under way, so that nobody takes all the places there are.
#ifndef VANTAGE_SERVER_RPC_CALL_CALL_COUNTS_H_
#define VANTAGE_SERVER_RPC_CALL_CALL_COUNTS_H_

#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"

namespace vantage::rpc {

// Thread safe.
class CallCounts {
 public:
  // Takes a place for a call of a tenant (nullopt: callers are not told apart). At most `most`
  // calls are under way at a time, streams being three quarters of them; of both, a tenant has no
  // more than what is left for all others. RESOURCE_EXHAUSTED (SERVER_BUSY, TENANT_BUSY).
  absl::Status Take(const std::optional<std::string>& tenant, bool stream, int most);
  // Of a call that got one.
  void GiveBack(const std::optional<std::string>& tenant, bool stream);

  int total() const;

 private:
  struct Count {
    int calls = 0;
    int streams = 0;  // of them
  };
  mutable std::mutex mutex_;
  Count all_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, Count> by_tenant_ ABSL_GUARDED_BY(mutex_);  // of those that have any
};

}  // namespace vantage::rpc

#endif  // VANTAGE_SERVER_RPC_CALL_CALL_COUNTS_H_

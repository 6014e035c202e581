// Counts durably how often work was begun, so that work that keeps bringing the server down is set
// aside.
#ifndef VANTAGE_SERVER_SESSION_BEGUN_WORK_H_
#define VANTAGE_SERVER_SESSION_BEGUN_WORK_H_

#include <mutex>
#include <set>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "server/session/session_context.h"

namespace vantage::session {

// Thread safe; one work is begun and ended on one thread.
class BegunWork {
 public:
  explicit BegunWork(SessionContext& context) : context_(context) {}

  // Notes durably that the work begins. FAILED_PRECONDITION (WORK_SET_ASIDE): it has brought the
  // server to its end Limits::tries times; it is not to be begun. Other errors are the store's.
  absl::Status Begin(const std::string& work);
  // It has ended, whatever came of it.
  void End(const std::string& work);
  // The process ends in order before the work does, which is not the work's fault.
  void EndAll();

 private:
  SessionContext& context_;
  std::mutex mutex_;
  // By this process; more than one only if the store failed.
  std::set<std::string> noted_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_BEGUN_WORK_H_

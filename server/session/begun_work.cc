#include "server/session/begun_work.h"

#include "absl/strings/str_cat.h"
#include "server/contract/error.h"

namespace vantage::session {

absl::Status BegunWork::Begin(const std::string& work) {
  // Another session may have the id by now.
  if (context_.closed()) return absl::AbortedError("the session was deleted");
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (noted_.count(work) != 0) return absl::OkStatus();
  }
  const absl::StatusOr<int> times = context_.dependencies().store.BeginWork(context_.id(), work);
  if (!times.ok()) return times.status();
  const int tries = context_.dependencies().limits.tries;
  if (tries > 0 && *times > tries) {
    return contract::ErrorWithReason(
        absl::StatusCode::kFailedPrecondition, "WORK_SET_ASIDE",
        absl::StrCat("the server came to its end ", *times - 1,
                     " times while it worked on this, probably for lack of memory; it is set "
                     "aside"));
  }
  std::lock_guard<std::mutex> lock(mutex_);
  noted_.insert(work);
  return absl::OkStatus();
}

void BegunWork::End(const std::string& work) {
  if (context_.closed()) return;
  const absl::Status ended = context_.dependencies().store.EndWork(context_.id(), work);
  // What stays noted is not counted again by this process.
  std::lock_guard<std::mutex> lock(mutex_);
  if (ended.ok()) noted_.erase(work);
}

void BegunWork::EndAll() {
  std::set<std::string> noted;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    noted = noted_;
  }
  for (const std::string& work : noted) End(work);
}

}  // namespace vantage::session

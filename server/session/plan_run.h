// A running plan: its latest ranking, for any number of watchers, and a way to stop it.
#ifndef VANTAGE_SERVER_SESSION_PLAN_RUN_H_
#define VANTAGE_SERVER_SESSION_PLAN_RUN_H_

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/time/time.h"
#include "server/execution/planning_pool.h"
#include "server/session/journal.h"
#include "vantage/v1/plan.pb.h"

namespace vantage::session {

// Thread safe.
class PlanRun {
 public:
  using WatchId = uint64_t;
  enum class StopReason { kNone, kCancelled, kDrain, kSessionDeleted };

  explicit PlanRun(v1::Plan plan);

  // The plan as it is now (basic view); only the latest is kept.
  v1::Plan Describe() const;
  bool Ended() const;

  // It is a job of the pool, which outlives this: while that waits its description says when its
  // turn comes, and when it is stopped it waits for none.
  void Queue(execution::PlanningPool& pool, uint64_t job, Journal::Clock clock);
  void Start(absl::Time now);
  // Sets a better ranking (basic view).
  void Improve(v1::PlanResult result);
  // The plan ended as `plan`, which cannot be logged yet. Shows its result and why it is not
  // logged.
  void AwaitLog(const v1::Plan& plan, std::string why);
  bool AwaitsLog() const;
  // The plan ended; `plan` is what was logged.
  void End(v1::Plan plan);

  // Stops the plan; the first reason counts, with the request that gave it. A drain only asks it to
  // end early.
  void Stop(StopReason reason, const RequestKey& by = {});
  StopReason stop_reason() const;
  RequestKey cancelled_by() const;
  std::stop_token cancelled() const { return cancel_.get_token(); }
  std::stop_token hurried() const { return hurry_.get_token(); }

  // `call` runs after every change; it must be quick. It may still be running when Unwatch returns.
  WatchId Watch(std::function<void()> call);
  void Unwatch(WatchId id);

 private:
  void Notify();

  mutable std::mutex mutex_;
  v1::Plan plan_ ABSL_GUARDED_BY(mutex_);
  execution::PlanningPool* pool_ ABSL_GUARDED_BY(mutex_) = nullptr;  // null: not queued yet
  uint64_t job_ ABSL_GUARDED_BY(mutex_) = 0;
  Journal::Clock clock_ ABSL_GUARDED_BY(mutex_);
  bool awaits_log_ ABSL_GUARDED_BY(mutex_) = false;
  bool ended_ ABSL_GUARDED_BY(mutex_) = false;
  StopReason stop_reason_ ABSL_GUARDED_BY(mutex_) = StopReason::kNone;
  RequestKey cancelled_by_ ABSL_GUARDED_BY(mutex_);
  std::map<WatchId, std::shared_ptr<std::function<void()>>> watchers_ ABSL_GUARDED_BY(mutex_);
  WatchId next_watch_ ABSL_GUARDED_BY(mutex_) = 1;
  std::stop_source cancel_;
  std::stop_source hurry_;
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_PLAN_RUN_H_

#include "server/session/plan_run.h"

#include <utility>
#include <vector>

#include "server/conversion/to_proto.h"

namespace vantage::session {

PlanRun::PlanRun(v1::Plan plan) : plan_(std::move(plan)) {}

v1::Plan PlanRun::Describe() const {
  std::lock_guard<std::mutex> lock(mutex_);
  v1::Plan plan = plan_;
  if (plan.state() != v1::PLAN_STATE_QUEUED || pool_ == nullptr) return plan;
  if (const auto place = pool_->PlaceOf(job_); place.has_value()) {
    plan.set_plans_ahead_count(static_cast<int32_t>(place->ahead));
    *plan.mutable_expected_start_time() =
        conversion::WriteTime(clock_() + absl::Seconds(place->seconds));
  }
  return plan;
}

void PlanRun::Queue(execution::PlanningPool& pool, uint64_t job, Journal::Clock clock) {
  std::lock_guard<std::mutex> lock(mutex_);
  pool_ = &pool;
  job_ = job;
  clock_ = std::move(clock);
  if (stop_reason_ != StopReason::kNone) pool_->Hurry(job_);
}

bool PlanRun::Ended() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return ended_;
}

void PlanRun::Start(absl::Time now) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    plan_.set_state(v1::PLAN_STATE_RUNNING);
    *plan_.mutable_start_time() = conversion::WriteTime(now);
  }
  Notify();
}

void PlanRun::Improve(v1::PlanResult result) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    *plan_.mutable_result() = std::move(result);
    plan_.set_revision(plan_.revision() + 1);
  }
  Notify();
}

void PlanRun::AwaitLog(const v1::Plan& plan, std::string why) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (plan.has_result()) *plan_.mutable_result() = plan.result();
    plan_.set_revision(plan.revision());
    plan_.set_state_message(std::move(why));
    awaits_log_ = true;
  }
  Notify();
}

bool PlanRun::AwaitsLog() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return awaits_log_;
}

void PlanRun::End(v1::Plan plan) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    plan_ = std::move(plan);
    ended_ = true;
  }
  Notify();
}

void PlanRun::Stop(StopReason reason, const RequestKey& by) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (stop_reason_ == StopReason::kNone) {
      stop_reason_ = reason;
      cancelled_by_ = by;
    }
    if (pool_ != nullptr) pool_->Hurry(job_);
  }
  (reason == StopReason::kDrain ? hurry_ : cancel_).request_stop();
}

PlanRun::StopReason PlanRun::stop_reason() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return stop_reason_;
}

RequestKey PlanRun::cancelled_by() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return cancelled_by_;
}

PlanRun::WatchId PlanRun::Watch(std::function<void()> call) {
  std::lock_guard<std::mutex> lock(mutex_);
  const WatchId id = next_watch_++;
  watchers_[id] = std::make_shared<std::function<void()>>(std::move(call));
  return id;
}

void PlanRun::Unwatch(WatchId id) {
  std::lock_guard<std::mutex> lock(mutex_);
  watchers_.erase(id);
}

void PlanRun::Notify() {
  std::vector<std::shared_ptr<std::function<void()>>> watchers;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    watchers.reserve(watchers_.size());
    for (const auto& [id, call] : watchers_) watchers.push_back(call);
  }
  for (const auto& call : watchers) (*call)();
}

}  // namespace vantage::session

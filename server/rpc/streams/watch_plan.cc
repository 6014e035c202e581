#include <algorithm>
#include <atomic>
#include <chrono>
#include <limits>
#include <utility>

#include "server/contract/error.h"
#include "server/rpc/handlers/lookup.h"
#include "server/rpc/streams/pumped_writer.h"
#include "server/rpc/streams/streams.h"

namespace vantage::rpc {
namespace {

using SystemClock = std::chrono::system_clock;

class PlanWatch final : public PumpedWriter<v1::WatchPlanResponse> {
 public:
  // `run` is null for a plan that has ended.
  PlanWatch(const RpcDependencies& dependencies, std::shared_ptr<RpcCall> call,
            grpc::CallbackServerContext* context, std::shared_ptr<session::Session> session,
            std::shared_ptr<session::PlanRun> run, const v1::WatchPlanRequest& request)
      : PumpedWriter(dependencies, std::move(call), context),
        session_(std::move(session)),
        run_(std::move(run)),
        name_(request.name()),
        seen_(request.after_revision()) {}

 protected:
  Step Produce(v1::WatchPlanResponse& message, absl::Status& status) override {
    const bool ended = run_ == nullptr || run_->Ended();
    const bool last = ended || deadline_near_;
    if (run_ != nullptr) {
      *message.mutable_plan() = run_->Describe();
    } else {
      absl::StatusOr<v1::Plan> plan = session_->plans().Get(name_);
      if (!plan.ok()) {
        status = plan.status();
        return Step::kFinish;
      }
      *message.mutable_plan() = *std::move(plan);
    }
    message.set_last(last);
    if (last) return Step::kWriteLast;
    const v1::Plan& plan = message.plan();
    if (plan.revision() <= seen_ && plan.state() == state_) return Step::kIdle;
    seen_ = std::max(seen_, plan.revision());
    state_ = plan.state();
    return Step::kWrite;
  }

  void Started() override {
    const std::weak_ptr<PumpedWriter> self = weak_from_this();
    if (run_ != nullptr) {
      watch_ = run_->Watch([self] {
        if (const auto stream = self.lock()) stream->Notify();
      });
      const SystemClock::time_point deadline = context_->deadline();
      if (deadline < SystemClock::time_point::max()) {
        // The margin: a tenth of the time, at least 50 ms.
        const auto left =
            std::chrono::duration_cast<std::chrono::milliseconds>(deadline - SystemClock::now());
        const auto margin = std::max(left / 10, std::chrono::milliseconds(50));
        timer_ = dependencies_.timer.After(
            std::max(left - margin, std::chrono::milliseconds(0)), [self] {
              if (const auto stream = self.lock()) {
                static_cast<PlanWatch&>(*stream).deadline_near_ = true;
                stream->Notify();
              }
            });
      }
    }
  }

  void Stopped() override {
    if (run_ != nullptr) run_->Unwatch(watch_);
    dependencies_.timer.Cancel(timer_);
  }

 private:
  const std::shared_ptr<session::Session> session_;
  const std::shared_ptr<session::PlanRun> run_;
  const std::string name_;
  uint64_t seen_;  // newest revision sent
  v1::PlanState state_ = v1::PLAN_STATE_UNSPECIFIED;
  std::atomic<bool> deadline_near_{false};
  session::PlanRun::WatchId watch_ = 0;
  execution::Timer::Id timer_ = 0;
};

}  // namespace

grpc::ServerWriteReactor<v1::WatchPlanResponse>* WatchPlan(const RpcDependencies& dependencies,
                                                           const std::shared_ptr<RpcCall>& call,
                                                           grpc::CallbackServerContext* context,
                                                           const v1::WatchPlanRequest& request) {
  using Refused = RefusedStream<grpc::ServerWriteReactor<v1::WatchPlanResponse>>;
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindParent(call->sessions(), request.name(), "plans", "name");
  if (!session.ok()) return new Refused(*call, session.status(), context);
  std::shared_ptr<session::PlanRun> run = (*session)->plans().FindRun(request.name());
  if (run == nullptr) {
    absl::StatusOr<v1::Plan> plan = (*session)->plans().Get(request.name());
    if (!plan.ok()) return new Refused(*call, plan.status(), context);
  }
  return BeginStream<PlanWatch>(dependencies, call, context, *session, std::move(run), request);
}

}  // namespace vantage::rpc

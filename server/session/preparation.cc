#include "server/session/preparation.h"

#include <utility>

#include "absl/time/clock.h"
#include "server/contract/out_of_memory.h"

namespace vantage::session {

Preparation::Preparation(SessionContext& context, ModelMemory& model)
    : context_(context), model_(model) {}

void Preparation::Expect(const v1::CreatePlanRequest& request) {
  std::lock_guard<std::mutex> lock(mutex_);
  expected_ = request;
}

std::optional<PlanInputs> Preparation::ReadInputs() {
  if (context_.closed() || context_.draining()) return std::nullopt;
  // What somebody asked for goes first; the plan that is expected then prepares for itself.
  if (context_.dependencies().pool.load().queued > 0) return std::nullopt;
  bool changes_again = false;
  context_.journal().Read(
      [&](const SessionState& state) { changes_again = !state.UndecidedScans().empty(); });
  if (changes_again || model_.Current().view == nullptr) return std::nullopt;
  v1::CreatePlanRequest expected;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    expected = expected_;
  }
  absl::StatusOr<PlanInputs> inputs = ReadInputsOfPlan(context_, model_, expected);
  if (!inputs.ok() || inputs->joint || !inputs->settings.empty()) return std::nullopt;
  if (!ReserveSpareMemory(model_, *inputs)) return std::nullopt;
  return *std::move(inputs);
}

void Preparation::Begin() {
  std::optional<PlanInputs> inputs = ReadInputs();
  if (!inputs.has_value()) return;
  const auto own = std::make_shared<UnderWay>();
  own->told = QuestionOf(*inputs).Told();
  own->view = inputs->model.view;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    again_ = under_way_ != nullptr;
    if (again_) return;
    under_way_ = own;
  }
  // Whoever ends the session or the server may have asked for that just before.
  if (context_.closed() || context_.draining()) own->stop.request_stop();
  // It takes no plan's turn.
  const absl::Status begun = contract::UnlessOutOfMemory([&] {
    context_.Submit(execution::JobPriority::kModel,
                    [this, own, in = *std::move(inputs)](parallel::Parallel& parallel) {
                      Run(own, in, parallel);
                    });
    return absl::OkStatus();
  });
  if (!begun.ok()) End(*own);
}

void Preparation::Run(const std::shared_ptr<UnderWay>& own, const PlanInputs& inputs,
                      parallel::Parallel& parallel) {
  const absl::Time began = absl::Now();
  const parallel::Cancellation cancelled(own->stop.get_token());
  // Whoever plans next finds out about errors.
  const absl::Status prepared = contract::UnlessOutOfMemory(
      [&] { return TaskOf(model_, inputs).prepare(parallel, cancelled).status(); });
  if (prepared.ok()) {
    telemetry::ObserveStage(context_.dependencies().metrics, "prepare a plan ahead",
                            absl::ToDoubleSeconds(absl::Now() - began));
  }
  End(*own);
}

void Preparation::End(UnderWay& own) {
  std::vector<std::function<void()>> waiting;
  bool again = false;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    waiting.swap(own.waiting);
    under_way_ = nullptr;
    again = std::exchange(again_, false);
  }
  for (const std::function<void()>& submit : waiting) submit();
  if (again) Begin();
}

void Preparation::Stop() {
  std::lock_guard<std::mutex> lock(mutex_);
  if (under_way_ != nullptr) under_way_->stop.request_stop();
}

bool Preparation::Rests() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return under_way_ == nullptr;
}

void Preparation::WhenPrepared(const PlanInputs& inputs, std::function<void()> submit) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (under_way_ != nullptr) {
      if (under_way_->view == inputs.model.view && under_way_->told == QuestionOf(inputs).Told() &&
          !inputs.joint && inputs.settings.empty()) {
        under_way_->waiting.push_back(std::move(submit));
        return;
      }
      under_way_->stop.request_stop();
    }
  }
  submit();
}

}  // namespace vantage::session

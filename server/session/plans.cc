#include "server/session/plans.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "server/contract/error.h"
#include "server/contract/out_of_memory.h"
#include "server/contract/resource_names.h"
#include "server/conversion/check_request.h"
#include "server/conversion/fleet_proto.h"
#include "server/conversion/from_proto.h"
#include "server/conversion/to_proto.h"
#include "server/session/asked_evaluation.h"
#include "server/session/list_filter.h"
#include "server/store/upgrade.h"

namespace vantage::session {
namespace {

constexpr char kPlanType[] = "vantage/Plan";
constexpr absl::Duration kRetryPlanAfter = absl::Seconds(1);
// The end of a plan that could not be logged is tried again after this time.
constexpr std::chrono::seconds kLogAgainAfter(2);
// Progress is shown at most this often, since people and links cannot follow faster.
constexpr absl::Duration kProgressInterval = absl::Milliseconds(50);

}  // namespace

Plans::Plans(SessionContext& context, ModelMemory& model, Claims& claims, Preparation& preparation)
    : context_(context),
      journal_(context.journal()),
      dependencies_(context.dependencies()),
      model_(model),
      claims_(claims),
      preparation_(preparation) {
  journal_.Read([&](const SessionState& state) {
    for (const std::string& name : state.plan_order) {
      const PlanRecord& record = state.plans.at(name);
      if (!record.blob.empty()) full_results_.push_back(record.blob);
    }
  });
  const size_t kept = std::min(full_results_.size(), dependencies_.limits.full_plans_per_session);
  full_results_.erase(full_results_.begin(),
                      full_results_.end() - static_cast<std::ptrdiff_t>(kept));
  for (const std::string& blob : full_results_) {
    context_.account()->Add(dependencies_.store.BlobSize(blob).value_or(0));
  }
}

absl::StatusOr<v1::Plan> Plans::Create(const v1::CreatePlanRequest& request) {
  const v1::Plan& asked = request.plan();
  const conversion::PlanBudget budget = conversion::ReadPlanBudget(asked);
  claims_.Expire();

  // An error of the inputs must not hide the answer to a repeated request.
  absl::StatusOr<PlanInputs> inputs = ReadInputsOfPlan(context_, model_, request);
  if (inputs.ok()) {
    if (absl::Status room = ReserveMemory(model_, *inputs); !room.ok()) inputs = room;
  }
  std::shared_ptr<PlanRun> run;
  absl::StatusOr<std::string> name = journal_.Execute(
      RequestKey::Of(request.request_id(), "CreatePlan", request),
      [&](const SessionState& state) -> absl::StatusOr<Draft> {
        if (!inputs.ok()) return inputs.status();
        if (absl::Status room = context_.CheckLog(); !room.ok()) return room;
        std::lock_guard<std::mutex> lock(mutex_);
        if (runs_.size() >= dependencies_.limits.running_plans_per_session) {
          return contract::Retryable(absl::StatusCode::kResourceExhausted, "TOO_MANY_PLANS",
                                     absl::StrCat(runs_.size(),
                                                  " plans are under way, the most a session "
                                                  "may have; cancel one or wait"),
                                     kRetryPlanAfter);
        }
        if (state.plan_order.size() >= dependencies_.limits.plans_per_session) {
          return contract::ErrorWithReason(absl::StatusCode::kResourceExhausted, "PLANS_FULL",
                                           absl::StrCat("the session has ", state.plan_order.size(),
                                                        " plans, the most it may; delete some"));
        }
        Draft draft;
        v1::Plan& plan = *draft.event.mutable_plan_created()->mutable_plan();
        plan.set_name(contract::ChildName(context_.id(), "plans",
                                          absl::StrCat("plan-", state.plan_count + 1)));
        plan.set_scanner_model_id(inputs->scanner_id);
        for (const std::string& scanner : inputs->scanners) plan.add_scanners(scanner);
        plan.set_ranking(asked.ranking() == v1::RANKING_UNSPECIFIED ? v1::RANKING_SCORE
                                                                    : asked.ranking());
        if (asked.has_work_limit_rays()) {
          plan.set_work_limit_rays(budget.work_limit);
        } else {
          plan.mutable_time_budget()->set_seconds(static_cast<int64_t>(budget.seconds));
          plan.mutable_time_budget()->set_nanos(
              static_cast<int32_t>((budget.seconds - std::floor(budget.seconds)) * 1e9));
        }
        plan.set_preset(asked.preset());
        plan.set_setting(asked.setting());
        plan.set_choose_setting(asked.choose_setting());
        plan.set_seed(inputs->config.seed);
        *plan.mutable_tour_stations() = asked.tour_stations();
        if (asked.has_config_overrides()) {
          *plan.mutable_config_overrides() = asked.config_overrides();
        }
        plan.set_state(v1::PLAN_STATE_QUEUED);
        *plan.mutable_create_time() = conversion::WriteTime(journal_.Now());
        run = std::make_shared<PlanRun>(plan);
        runs_[plan.name()] = run;
        return draft;
      });
  if (!name.ok()) {
    if (run != nullptr) {
      std::lock_guard<std::mutex> lock(mutex_);
      runs_.erase(run->Describe().name());
    }
    return name.status();
  }
  if (run != nullptr) {
    preparation_.Expect(request);
    preparation_.WhenPrepared(*inputs, [this, run, in = *inputs, submitted = absl::Now()] {
      Submit(run, in, submitted);
    });
  }
  return Get(*name);
}

absl::StatusOr<v1::Plan> Plans::Get(const std::string& name) const {
  if (const std::shared_ptr<PlanRun> run = FindRun(name)) return run->Describe();
  absl::StatusOr<v1::Plan> found = contract::ResourceNotFound(kPlanType, name);
  journal_.Read([&](const SessionState& state) {
    const auto it = state.plans.find(name);
    if (it != state.plans.end()) found = it->second.plan;
  });
  return found;
}

absl::StatusOr<v1::PlanResult> Plans::GetFullResult(const std::string& name) const {
  std::string blob;
  journal_.Read([&](const SessionState& state) {
    const auto it = state.plans.find(name);
    if (it != state.plans.end()) blob = it->second.blob;
  });
  absl::StatusOr<std::string> bytes = absl::NotFoundError("");
  if (!blob.empty()) bytes = dependencies_.store.GetBlob(blob);
  v1::PlanResult result;
  if (!bytes.ok() || !result.ParseFromString(*bytes)) {
    return contract::ErrorWithReason(
        absl::StatusCode::kFailedPrecondition, "PLAN_DETAIL_RELEASED",
        absl::StrCat(name, ": patches and map of scores are kept for the last ",
                     dependencies_.limits.full_plans_per_session,
                     " plans that ended; ask for the basic view"));
  }
  store::Upgrade(result);
  return result;
}

absl::StatusOr<std::vector<v1::Plan>> Plans::List(absl::string_view after, size_t limit, bool& more,
                                                  const v1::ListPlansRequest& filter) const {
  std::vector<std::string> names;
  absl::StatusOr<int64_t> last = 0;
  journal_.Read([&](const SessionState& state) {
    last = NumberAfter(after, state.plan_count);
    if (!last.ok()) return;
    for (const std::string& name : state.plan_order) {
      if (contract::NumberOf(name) > *last) names.push_back(name);
    }
  });
  if (!last.ok()) return last.status();
  std::vector<v1::Plan> plans;
  more = false;
  for (const std::string& name : names) {
    absl::StatusOr<v1::Plan> plan = Get(name);  // one that runs has come farther than the log says
    if (!plan.ok() || !LetsThrough(filter.states(), plan->state())) continue;
    if (plans.size() == limit) {
      more = true;
      break;
    }
    plans.push_back(*std::move(plan));
  }
  return plans;
}

absl::StatusOr<v1::Plan> Plans::Cancel(const std::string& name, const RequestKey& key) {
  if (absl::Status known = journal_.CheckRequest(key); !known.ok()) return known;
  if (const std::shared_ptr<PlanRun> run = FindRun(name)) {
    run->Stop(PlanRun::StopReason::kCancelled, key);
    // It may wait for a problem that is being prepared.
    if (run->Describe().state() == v1::PLAN_STATE_QUEUED) preparation_.Stop();
  }
  return Get(name);
}

absl::Status Plans::Delete(const std::string& name, const RequestKey& key) {
  std::string blob;
  absl::Status deleted = journal_
                             .Execute(key,
                                      [&](const SessionState& state) -> absl::StatusOr<Draft> {
                                        const auto it = state.plans.find(name);
                                        if (it == state.plans.end()) {
                                          return contract::ResourceNotFound(kPlanType, name);
                                        }
                                        if (FindRun(name) != nullptr) {
                                          return contract::ErrorWithReason(
                                              absl::StatusCode::kFailedPrecondition, "PLAN_RUNNING",
                                              absl::StrCat(name, " is under way; cancel it first"));
                                        }
                                        blob = it->second.blob;
                                        Draft draft;
                                        draft.event.mutable_plan_deleted()->set_plan(name);
                                        return draft;
                                      })
                             .status();
  if (!deleted.ok() || blob.empty()) return deleted;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    const auto held = std::find(full_results_.begin(), full_results_.end(), blob);
    if (held == full_results_.end()) return absl::OkStatus();  // it was released before
    full_results_.erase(held);
  }
  context_.ReleaseOwnBlob(blob);
  return absl::OkStatus();
}

std::shared_ptr<PlanRun> Plans::FindRun(const std::string& name) const {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto it = runs_.find(name);
  return it == runs_.end() ? nullptr : it->second;
}

void Plans::EvaluateView(const v1::EvaluateViewRequest& request,
                         std::function<void(absl::StatusOr<v1::EvaluateViewResponse>)> done,
                         const std::stop_token& gone) {
  const Eigen::Vector3d world = conversion::ReadOwnVector(request.position());
  std::optional<double> heading;
  if (request.has_heading_rad()) heading = request.heading_rad();
  absl::StatusOr<PlanInputs> inputs =
      ReadPlanInputs(context_, model_, request.scanner_model_id(), request.config_overrides(), "");
  if (!inputs.ok()) return done(inputs.status());
  if (request.has_orientation() && !inputs->scanner.TurnsAllAround()) {
    contract::Violations violations;
    const double turned = conversion::ReadUpright(request.orientation(), "orientation", violations);
    absl::Status upright = violations.ToStatus();
    if (!upright.ok()) return done(upright);
    if (!heading.has_value()) heading = turned;
  }
  if (absl::Status room = ReserveMemory(model_, *inputs); !room.ok()) return done(room);
  std::shared_ptr<Evaluation> held = model_.BeginEvaluation();
  if (held == nullptr) {
    return done(contract::Retryable(absl::StatusCode::kResourceExhausted, "TOO_MANY_EVALUATIONS",
                                    "too many positions of this session are being evaluated",
                                    kRetryPlanAfter));
  }
  // Copied twice: whoever waits for a problem keeps what it needs, and a job may be copied.
  const auto evaluate =
      [this, in = *inputs, world, heading,
       gone](parallel::Parallel& parallel) -> absl::StatusOr<v1::EvaluateViewResponse> {
    const absl::Time started = absl::Now();
    PlanningTask task = TaskOf(model_, in);
    // The evaluation itself is short; what it waits for need not be.
    task.prepare = [prepare = std::move(task.prepare), &gone](parallel::Parallel& loops,
                                                              const parallel::Cancellation&) {
      return prepare(loops, parallel::Cancellation(gone));
    };
    const absl::StatusOr<planning::ViewEvaluation> evaluation =
        dependencies_.algorithms.evaluate_view(task, world - context_.origin(), parallel, heading);
    if (!evaluation.ok()) return evaluation.status();
    v1::EvaluateViewResponse response = conversion::WriteEvaluation(*evaluation, context_.origin());
    conversion::NameLastStation(in.last_scan, *response.mutable_view());
    response.set_model_version(in.model.version);
    *response.mutable_duration() =
        conversion::WriteDuration(absl::ToDoubleSeconds(absl::Now() - started));
    return response;
  };
  const auto asked = std::make_shared<AskedEvaluation<v1::EvaluateViewResponse>>(
      context_, std::move(held), std::move(done));
  preparation_.WhenPrepared(*inputs, [this, asked, evaluate] {
    context_.RunInteractive([asked, evaluate](parallel::Parallel& parallel) {
      asked->Answer([&] { return evaluate(parallel); });
    });
  });
}

void Plans::EndInterrupted() {
  std::vector<v1::Plan> interrupted;
  journal_.Read([&](const SessionState& state) {
    for (const std::string& name : state.plan_order) {
      const PlanRecord& record = state.plans.at(name);
      if (record.plan.state() == v1::PLAN_STATE_QUEUED) interrupted.push_back(record.plan);
    }
  });
  for (v1::Plan& plan : interrupted) {
    const auto run = std::make_shared<PlanRun>(plan);
    plan.set_state(v1::PLAN_STATE_FAILED);
    plan.set_state_message("the server stopped while it ran; create it again");
    End(run, plan, nullptr);
  }
}

void Plans::Stop(PlanRun::StopReason reason) {
  preparation_.Stop();
  std::lock_guard<std::mutex> lock(mutex_);
  for (const auto& [name, run] : runs_) run->Stop(reason);
}

size_t Plans::Running() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return runs_.size();
}

bool Plans::Rest() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return std::all_of(runs_.begin(), runs_.end(),
                     [](const auto& entry) { return entry.second->AwaitsLog(); });
}

std::vector<std::string> Plans::Blobs() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return full_results_;
}

std::vector<std::string> Plans::TakeBlobs() {
  std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(full_results_, {});
}

void Plans::Submit(const std::shared_ptr<PlanRun>& run, const PlanInputs& inputs,
                   absl::Time submitted) {
  const uint64_t job = context_.Submit(
      execution::JobPriority::kPlan,
      [this, run, in = inputs, submitted](parallel::Parallel& parallel) {
        const absl::Status ended = contract::UnlessOutOfMemory([&] {
          Run(run, in, submitted, parallel);
          return absl::OkStatus();
        });
        if (ended.ok() || run->Ended()) return;
        v1::Plan plan = run->Describe();
        plan.set_state(v1::PLAN_STATE_FAILED);
        plan.set_state_message(std::string(ended.message()));
        *plan.mutable_end_time() = conversion::WriteTime(journal_.Now());
        End(run, std::move(plan), nullptr);
      },
      inputs.seconds);
  run->Queue(dependencies_.pool, job, dependencies_.clock);
}

void Plans::Run(const std::shared_ptr<PlanRun>& run, const PlanInputs& inputs, absl::Time submitted,
                parallel::Parallel& parallel) {
  run->Start(journal_.Now());
  const absl::Time began = absl::Now();
  telemetry::ObserveStage(dependencies_.metrics, "wait for a plan to begin",
                          absl::ToDoubleSeconds(began - submitted));
  parallel::Budget budget = inputs.budget;
  if (inputs.seconds > 0) budget.deadline = parallel::Budget::Seconds(inputs.seconds).deadline;
  budget.cancelled = run->cancelled();
  budget.hurried = run->hurried();

  absl::Time shown = absl::InfinitePast();
  const auto progress = [&](const planning::Plan& plan) {
    const absl::Time now = absl::Now();
    if (now - shown < kProgressInterval) return;
    shown = now;
    v1::PlanResult result =
        conversion::WritePlanResult(plan, inputs.written, false, context_.origin());
    conversion::NameLastStation(inputs.last_scan, result);
    result.set_model_version(inputs.model.version);
    run->Improve(std::move(result));
  };
  absl::StatusOr<planning::Plan> made = planning::Plan();
  fleet::JointPlan joint;  // the assignments, without the plan itself
  // Plans of one scanner and setting come to it when their problem is prepared.
  absl::StatusOr<SiteOfPlan> prior = SiteOfPlan();
  if (inputs.joint || !inputs.settings.empty()) {
    prior = SiteOf(model_, inputs, parallel::Cancellation(budget.cancelled));
    // A plan that was cancelled says so itself.
    if (absl::IsCancelled(prior.status())) prior = SiteOfPlan();
  }
  if (!prior.ok()) {
    made = prior.status();
  } else if (inputs.joint) {
    fleet::FleetRequest request = inputs.fleet;
    request.site = prior->site;
    absl::StatusOr<fleet::JointPlan> together = dependencies_.algorithms.make_joint_plan(
        *inputs.model.view, request, inputs.config, budget, parallel, progress);
    if (together.ok()) {
      joint = *std::move(together);
      made = std::move(joint.plan);
    } else {
      made = together.status();
    }
  } else if (!inputs.settings.empty()) {
    made = dependencies_.algorithms.make_plan_choosing_setting(*inputs.model.view, inputs.settings,
                                                               inputs.config, budget, parallel,
                                                               progress, prior->site);
  } else {
    made = dependencies_.algorithms.make_plan(TaskOf(model_, inputs), budget, parallel, progress);
  }

  const double took = absl::ToDoubleSeconds(absl::Now() - began);
  telemetry::ObserveStage(dependencies_.metrics, "plan", took);
  if (inputs.seconds > 0) {
    telemetry::ObserveStage(dependencies_.metrics, "plan beyond its budget",
                            std::max(0.0, took - inputs.seconds));
  }
  if (made.ok()) {
    for (size_t stage = 0; stage < made->seconds.size(); ++stage) {
      telemetry::ObserveStage(dependencies_.metrics, planning::kPlanStageNames[stage],
                              made->seconds[stage]);
    }
  }
  v1::Plan plan = run->Describe();
  *plan.mutable_end_time() = conversion::WriteTime(journal_.Now());
  if (!made.ok()) {
    plan.set_state(v1::PLAN_STATE_FAILED);
    plan.set_state_message(std::string(made.status().message()));
    return End(run, std::move(plan), nullptr);
  }
  switch (run->stop_reason()) {
    case PlanRun::StopReason::kCancelled:
    case PlanRun::StopReason::kSessionDeleted:
      plan.set_state(v1::PLAN_STATE_CANCELLED);
      break;
    case PlanRun::StopReason::kDrain:
      plan.set_state(v1::PLAN_STATE_SUCCEEDED);
      plan.set_state_message("ended early with its best answer: the server shuts down");
      break;
    case PlanRun::StopReason::kNone:
      plan.set_state(v1::PLAN_STATE_SUCCEEDED);
      break;
  }
  const auto full = std::make_shared<v1::PlanResult>(
      conversion::WritePlanResult(*made, inputs.written, true, context_.origin()));
  if (inputs.joint) {
    conversion::WriteJointPlan(joint, inputs.scanners, inputs.claims, inputs.stations, *full);
  }
  conversion::NameLastStation(inputs.last_scan, *full);
  full->set_model_version(inputs.model.version);
  *plan.mutable_result() = *full;
  conversion::StripToBasic(*plan.mutable_result());
  plan.set_revision(plan.revision() + 1);
  End(run, std::move(plan), full);
}

void Plans::End(const std::shared_ptr<PlanRun>& run, v1::Plan plan,
                const std::shared_ptr<const v1::PlanResult>& full) {
  std::string blob;
  if (full != nullptr && !context_.closed()) {
    absl::StatusOr<std::string> kept = context_.PutOwnBlob(full->SerializeAsString());
    if (kept.ok()) blob = *kept;  // without room in the account only the basic view is kept
  }
  // With the request that cancelled it, unless that came again after it was used for another.
  const RequestKey cancelled_by = run->cancelled_by();
  const RequestKey key = journal_.Knows(cancelled_by) ? RequestKey() : cancelled_by;
  absl::StatusOr<std::string> logged =
      journal_.Execute(key, [&](const SessionState&) -> absl::StatusOr<Draft> {
        if (context_.closed()) return absl::AbortedError("the session was deleted");
        Draft draft;
        *draft.event.mutable_plan_ended()->mutable_plan() = plan;
        draft.blob = blob;
        return draft;
      });
  if (!logged.ok() && !absl::IsAborted(logged.status())) {
    if (!blob.empty()) context_.ReleaseOwnBlob(blob);
    return EndLater(run, plan, full, logged.status());
  }
  std::vector<std::string> released;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    runs_.erase(plan.name());
    if (!blob.empty()) full_results_.push_back(blob);
    while (full_results_.size() > dependencies_.limits.full_plans_per_session ||
           context_.closed()) {
      if (full_results_.empty()) break;
      released.push_back(full_results_.front());
      full_results_.erase(full_results_.begin());
    }
  }
  for (const std::string& old : released) context_.ReleaseOwnBlob(old);
  double seconds = 0;
  for (const v1::StageDuration& stage : plan.result().stage_durations()) {
    seconds += conversion::ReadDuration(stage.duration());
  }
  dependencies_.log.Info("plan ended", {{"plan", plan.name()},
                                        {"seconds", seconds},
                                        {"state", v1::PlanState_Name(plan.state())},
                                        {"outcome", v1::PlanOutcome_Name(plan.result().outcome())},
                                        {"rays", plan.result().ray_count()},
                                        {"gap", plan.result().optimality_gap()}});
  run->End(std::move(plan));
}

// An end is announced only when it is logged, since a restart would not know of it otherwise.
void Plans::EndLater(const std::shared_ptr<PlanRun>& run, const v1::Plan& plan,
                     const std::shared_ptr<const v1::PlanResult>& full, const absl::Status& why) {
  dependencies_.log.Warning("the end of a plan waits",
                            {{"plan", plan.name()}, {"error", why.ToString()}});
  {
    std::lock_guard<std::mutex> lock(mutex_);
    runs_[plan.name()] = run;
  }
  run->AwaitLog(plan, absl::StrCat("done, and waits to be logged: ", std::string(why.message())));
  context_.After(kLogAgainAfter, [this, run, plan, full] {
    context_.RunInteractive([this, run, plan, full](parallel::Parallel&) { End(run, plan, full); });
  });
}

}  // namespace vantage::session

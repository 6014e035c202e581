// A session's plans: begun, improved, ended, kept; and the what-ifs beside them.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "server/contract/error.h"
#include "server/contract/resource_names.h"
#include "server/conversion/fleet_proto.h"
#include "server/conversion/from_proto.h"
#include "server/conversion/to_proto.h"
#include "server/session/given_up.h"
#include "server/session/plan_inputs.h"
#include "server/session/session.h"
#include "server/store/upgrade.h"

namespace vantage::session {
namespace {

constexpr char kPlanType[] = "vantage/Plan";
constexpr double kDefaultBudget = 1.0;  // s
constexpr double kMinBudget = 0.01;
constexpr double kMaxBudget = 3600;
constexpr double kDefaultRejectionRadius = 0.5;  // m
constexpr size_t kMaxReason = 500;
constexpr int kCoveragePatches = 100;
constexpr absl::Duration kRetryPlanAfter = absl::Seconds(1);
// An end that could not be logged is tried again after this time.
constexpr std::chrono::seconds kLogAgainAfter(2);
// Progress is shown at most this often: people and links don't follow faster.
constexpr absl::Duration kProgressInterval = absl::Milliseconds(50);

// One that ran out of time before it evaluated a view, or found nowhere to stand, does not.
bool SaysWhatRemains(const v1::Plan& plan) {
  if (plan.state() != v1::PLAN_STATE_SUCCEEDED) return false;
  switch (plan.result().outcome()) {
    case v1::PLAN_OUTCOME_VIEWS:
    case v1::PLAN_OUTCOME_NO_REGISTRABLE_VIEW:
    case v1::PLAN_OUTCOME_NOTHING_TO_GAIN:
      return true;
    case v1::PLAN_OUTCOME_SEARCH_UNFINISHED:
      return plan.result().termination().has_best_score_upper();
    default:
      return false;
  }
}

}  // namespace

absl::StatusOr<Session::PlanInputs> Session::PlanInputsFor(const std::string& scanner_model_id,
                                                           const v1::PlanningConfig& overrides,
                                                           const std::string& prefix) {
  PlanInputs inputs;
  v1::SiteRules rules;
  v1::ScannerModel scanner;
  double voxel_size = 0;
  bool known = false;
  std::vector<planning::RejectedPlace> rejected;
  v1::Session described;
  const google::protobuf::Timestamp now = conversion::WriteTime(journal_.Now());
  journal_.Read([&](const SessionState& state) {
    described = state.session;
    for (const v1::Rejection* rejection : state.RejectionsAt(now)) {
      rejected.push_back(
          {conversion::ReadOwnVector(rejection->position()) - origin_, rejection->radius_m()});
    }
  });
  inputs.written = described.planning_config();
  rules = described.site_rules();
  voxel_size = described.model_config().voxel_size_m();
  for (const v1::ScannerModel& candidate : described.scanner_models()) {
    if (!known && (scanner_model_id.empty() || candidate.id() == scanner_model_id)) {
      scanner = candidate;
      known = true;
    }
  }
  contract::Violations violations;
  if (!known) {
    violations.Add(
        prefix + "scanner_model_id",
        absl::StrCat("'", scanner_model_id, "' is none of the session's scanner models"));
  }
  conversion::Override(overrides, inputs.written);
  inputs.config =
      conversion::ReadPlanningConfig(inputs.written, rules, origin_, voxel_size,
                                     prefix + "config_overrides", "session.site_rules", violations);
  inputs.scanner = conversion::ReadScannerModel(scanner, "scanner_model", violations);
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return valid;
  inputs.config.rejected = std::move(rejected);
  absl::Status possible = inputs.config.Validate(inputs.scanner);
  if (!possible.ok())
    return contract::InvalidField(prefix + "config_overrides", possible.message());
  inputs.scanner_id = scanner.id();
  inputs.model = Model();
  if (inputs.model.view == nullptr) return WhyNoModel();
  Touch();
  return inputs;
}

absl::StatusOr<v1::Plan> Session::CreatePlan(const v1::CreatePlanRequest& request) {
  const v1::Plan& asked = request.plan();
  contract::Violations violations;
  conversion::CheckRequestId(request.request_id(), violations);
  double seconds = 0;
  uint64_t work_limit = 0;
  if (asked.has_work_limit_rays()) {
    work_limit = asked.work_limit_rays();
    if (work_limit == 0) violations.Add("plan.work_limit_rays", "must be above 0 rays");
  } else {
    seconds =
        asked.has_time_budget() ? conversion::ReadDuration(asked.time_budget()) : kDefaultBudget;
    if (!(seconds >= kMinBudget && seconds <= kMaxBudget)) {
      violations.Add("plan.time_budget", absl::StrCat("is ", seconds, " s, must be in [",
                                                      kMinBudget, ", ", kMaxBudget, "]"));
    }
  }
  if (!v1::Ranking_IsValid(asked.ranking())) {
    violations.Add("plan.ranking", "must be RANKING_SCORE or RANKING_SCORE_PER_MINUTE");
  }
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return valid;
  ExpireClaims();

  // An error of the inputs must not hide the answer to a repeated request.
  std::string model = asked.scanner_model_id();
  if (asked.scanners_size() > 0 && model.empty()) {
    journal_.Read([&](const SessionState& state) {
      const auto it = state.scanners.find(asked.scanners(0));
      if (it != state.scanners.end()) model = conversion::ModelOf(it->second, state.session).id();
    });
  }
  absl::StatusOr<PlanInputs> inputs = PlanInputsFor(model, asked.config_overrides(), "plan.");
  if (inputs.ok()) {
    absl::Status possible = AddFleet(request, *inputs);
    if (possible.ok()) possible = CheckSize(*inputs);
    if (possible.ok()) possible = ReservePlan(*inputs);
    if (!possible.ok()) inputs = possible;
  }
  if (inputs.ok()) {
    inputs->seconds = seconds;
    if (work_limit > 0) inputs->budget.work_limit = work_limit;
    if (asked.has_seed()) inputs->config.seed = asked.seed();
  }
  std::shared_ptr<PlanRun> run;
  absl::StatusOr<std::string> name = journal_.Execute(
      RequestKey::Of(request.request_id(), "CreatePlan", request),
      [&](const SessionState& state) -> absl::StatusOr<Draft> {
        if (!inputs.ok()) return inputs.status();
        std::lock_guard<std::mutex> lock(mutex_);
        if (runs_.size() >= dependencies_.limits.running_plans_per_session) {
          return contract::Retryable(absl::StatusCode::kResourceExhausted, "TOO_MANY_PLANS",
                                     absl::StrCat(runs_.size(),
                                                  " plans are under way, the most a session "
                                                  "may have; cancel one or wait"),
                                     kRetryPlanAfter);
        }
        if (state.plan_order.size() >= dependencies_.limits.plans_per_session) {
          return contract::ErrorWithReason(
              absl::StatusCode::kResourceExhausted, "PLANS_FULL",
              absl::StrCat("the session has ", state.plan_order.size(),
                           " plans, the most it may; open another session"));
        }
        Draft draft;
        v1::Plan& plan = *draft.event.mutable_plan_created()->mutable_plan();
        plan.set_name(
            contract::ChildName(id_, "plans", absl::StrCat("plan-", state.plan_order.size() + 1)));
        plan.set_scanner_model_id(inputs->scanner_id);
        for (const std::string& scanner : inputs->scanners) plan.add_scanners(scanner);
        plan.set_ranking(asked.ranking() == v1::RANKING_UNSPECIFIED ? v1::RANKING_SCORE
                                                                    : asked.ranking());
        if (asked.has_work_limit_rays()) {
          plan.set_work_limit_rays(work_limit);
        } else {
          plan.mutable_time_budget()->set_seconds(static_cast<int64_t>(seconds));
          plan.mutable_time_budget()->set_nanos(
              static_cast<int32_t>((seconds - std::floor(seconds)) * 1e9));
        }
        plan.set_seed(inputs->config.seed);
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
    dependencies_.pool.Submit(
        share_, execution::JobPriority::kPlan,
        [self = shared_from_this(), run, in = *inputs, submitted = absl::Now()](
            parallel::Parallel& parallel) { self->RunPlan(run, in, submitted, parallel); });
  }
  return GetPlan(*name);
}

void Session::RunPlan(const std::shared_ptr<PlanRun>& run, const PlanInputs& inputs,
                      absl::Time submitted, parallel::Parallel& parallel) {
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
    v1::PlanResult result = conversion::WritePlanResult(plan, inputs.written, false, origin_);
    result.set_model_version(inputs.model.version);
    run->Improve(std::move(result));
  };
  absl::StatusOr<planning::Plan> made = planning::Plan();
  fleet::JointPlan joint;  // who goes where, without its plan
  if (inputs.joint) {
    absl::StatusOr<fleet::JointPlan> together = dependencies_.algorithms.make_joint_plan(
        *inputs.model.view, inputs.fleet, inputs.config, budget, parallel, progress);
    if (together.ok()) {
      joint = *std::move(together);
      made = std::move(joint.plan);
    } else {
      made = together.status();
    }
  } else {
    made = dependencies_.algorithms.make_plan(*inputs.model.view, inputs.scanner, inputs.config,
                                              budget, parallel, progress);
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
    return EndPlan(run, std::move(plan), nullptr);
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
      conversion::WritePlanResult(*made, inputs.written, true, origin_));
  if (inputs.joint) {
    conversion::WriteJointPlan(joint, inputs.scanners, inputs.claims,
                               inputs.written.required_density_per_m2(), *full);
  }
  full->set_model_version(inputs.model.version);
  *plan.mutable_result() = *full;
  conversion::StripToBasic(*plan.mutable_result());
  plan.set_revision(plan.revision() + 1);
  EndPlan(run, std::move(plan), full);
}

void Session::EndPlan(const std::shared_ptr<PlanRun>& run, v1::Plan plan,
                      const std::shared_ptr<const v1::PlanResult>& full) {
  std::string blob;
  if (full != nullptr && !closed_) {
    absl::StatusOr<std::string> kept = PutOwnBlob(full->SerializeAsString());
    if (kept.ok()) blob = *kept;  // without room only the basic view is kept
  }
  absl::StatusOr<std::string> logged =
      journal_.Execute({}, [&](const SessionState&) -> absl::StatusOr<Draft> {
        if (closed_) return absl::AbortedError("the session was deleted");
        Draft draft;
        *draft.event.mutable_plan_ended()->mutable_plan() = plan;
        draft.blob = blob;
        return draft;
      });
  if (!logged.ok() && !absl::IsAborted(logged.status())) {
    if (!blob.empty()) ReleaseOwnBlob(blob);
    return EndPlanLater(run, std::move(plan), full, logged.status());
  }
  std::vector<std::string> released;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    runs_.erase(plan.name());
    if (!blob.empty()) full_results_.push_back(blob);
    while (full_results_.size() > dependencies_.limits.full_plans_per_session || closed_) {
      if (full_results_.empty()) break;
      released.push_back(full_results_.front());
      full_results_.erase(full_results_.begin());
    }
  }
  for (const std::string& old : released) ReleaseOwnBlob(old);
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

// Nobody is told of an end that a restart would not know of.
void Session::EndPlanLater(const std::shared_ptr<PlanRun>& run, v1::Plan plan,
                           const std::shared_ptr<const v1::PlanResult>& full,
                           const absl::Status& why) {
  dependencies_.log.Warning("the end of a plan waits",
                            {{"plan", plan.name()}, {"error", why.ToString()}});
  {
    std::lock_guard<std::mutex> lock(mutex_);
    runs_[plan.name()] = run;
  }
  run->AwaitLog(plan, absl::StrCat("done, and waits to be logged: ", std::string(why.message())));
  dependencies_.timer.After(kLogAgainAfter, [self = weak_from_this(), run, plan, full] {
    const std::shared_ptr<Session> session = self.lock();
    if (session == nullptr) return;
    session->RunInteractive(
        [session, run, plan, full](parallel::Parallel&) { session->EndPlan(run, plan, full); });
  });
}

std::shared_ptr<PlanRun> Session::FindRun(const std::string& name) const {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto it = runs_.find(name);
  return it == runs_.end() ? nullptr : it->second;
}

absl::StatusOr<v1::Plan> Session::GetPlan(const std::string& name) const {
  if (const std::shared_ptr<PlanRun> run = FindRun(name)) return run->Describe();
  absl::StatusOr<v1::Plan> found = contract::ResourceNotFound(kPlanType, name);
  journal_.Read([&](const SessionState& state) {
    const auto it = state.plans.find(name);
    if (it != state.plans.end()) found = it->second.plan;
  });
  return found;
}

absl::StatusOr<v1::PlanResult> Session::GetFullResult(const std::string& name) const {
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

absl::StatusOr<std::vector<v1::Plan>> Session::ListPlans(absl::string_view after, size_t limit,
                                                         bool& more) const {
  std::vector<std::string> names;
  absl::StatusOr<size_t> begin = 0;
  journal_.Read([&](const SessionState& state) {
    begin = PlaceAfter(state.plan_order, after);
    if (!begin.ok()) return;
    for (size_t i = *begin; i < state.plan_order.size() && names.size() < limit; ++i) {
      names.push_back(state.plan_order[i]);
    }
    more = *begin + names.size() < state.plan_order.size();
  });
  if (!begin.ok()) return begin.status();
  std::vector<v1::Plan> plans;
  for (const std::string& name : names) {
    absl::StatusOr<v1::Plan> plan = GetPlan(name);
    if (plan.ok()) plans.push_back(*std::move(plan));
  }
  return plans;
}

absl::StatusOr<v1::Plan> Session::CancelPlan(const std::string& name) {
  if (const std::shared_ptr<PlanRun> run = FindRun(name)) {
    run->Stop(PlanRun::StopReason::kCancelled);
  }
  return GetPlan(name);
}

void Session::StopPlans(PlanRun::StopReason reason) {
  std::lock_guard<std::mutex> lock(mutex_);
  for (const auto& [name, run] : runs_) run->Stop(reason);
}

bool Session::Rests() const {
  if (strand_->Size() != 0 || evaluations_ > 0 || exports_ > 0) return false;
  std::lock_guard<std::mutex> lock(mutex_);
  return std::all_of(runs_.begin(), runs_.end(),
                     [](const auto& entry) { return entry.second->AwaitsLog(); });
}

absl::StatusOr<v1::Rejection> Session::RejectView(const v1::RejectViewRequest& request) {
  contract::Violations violations;
  conversion::CheckRequestId(request.request_id(), violations);
  if (!request.has_position()) violations.Add("position", "is required");
  conversion::ReadVector(request.position(), "position", violations);
  const double radius = request.has_radius_m() ? request.radius_m() : kDefaultRejectionRadius;
  if (!(radius > 0 && radius <= 100)) {
    violations.Add("radius_m", absl::StrCat("is ", radius, " m, must be in (0, 100]"));
  }
  conversion::CheckText(request.reason(), kMaxReason, "reason", violations);
  constexpr double kTenYears = 10 * 366 * 86400.0;
  const double ttl = conversion::ReadDuration(request.ttl());
  if (request.has_ttl() && !(ttl >= 1 && ttl <= kTenYears)) {
    violations.Add("ttl", absl::StrCat("is ", ttl, " s, must be 1 s to 10 years"));
  }
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return valid;
  absl::StatusOr<std::string> name = journal_.Execute(
      RequestKey::Of(request.request_id(), "RejectView", request),
      [&](const SessionState& state) -> absl::StatusOr<Draft> {
        constexpr size_t kMaxRejections = 10'000;
        const absl::Time now = journal_.Now();
        if (state.RejectionsAt(conversion::WriteTime(now)).size() >= kMaxRejections) {
          return contract::ErrorWithReason(
              absl::StatusCode::kResourceExhausted, "TOO_MANY_REJECTIONS",
              "the session has too many refused places; use keep-out boxes");
        }
        Draft draft;
        v1::Rejection& rejection = *draft.event.mutable_view_rejected()->mutable_rejection();
        rejection.set_name(contract::ChildName(
            id_, "rejections", absl::StrCat("rejection-", state.rejection_count + 1)));
        *rejection.mutable_position() = request.position();
        rejection.set_radius_m(radius);
        rejection.set_reason(request.reason());
        *rejection.mutable_create_time() = conversion::WriteTime(now);
        if (request.has_ttl())
          *rejection.mutable_expire_time() = conversion::WriteTime(now + absl::Seconds(ttl));
        return draft;
      });
  if (!name.ok()) return name.status();
  v1::Rejection made;
  journal_.Read([&](const SessionState& state) {
    for (const v1::Rejection& rejection : state.rejections) {
      if (rejection.name() == *name) made = rejection;
    }
  });
  return made;
}

void Session::EvaluateView(const v1::EvaluateViewRequest& request,
                           std::function<void(absl::StatusOr<v1::EvaluateViewResponse>)> done) {
  contract::Violations violations;
  if (!request.has_position()) violations.Add("position", "is required");
  const Eigen::Vector3d world = conversion::ReadVector(request.position(), "position", violations);
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return done(valid);
  absl::StatusOr<PlanInputs> inputs =
      PlanInputsFor(request.scanner_model_id(), request.config_overrides(), "");
  if (!inputs.ok()) return done(inputs.status());
  if (absl::Status room = ReservePlan(*inputs); !room.ok()) return done(room);
  if (evaluations_.fetch_add(1) >= static_cast<int>(dependencies_.limits.evaluations)) {
    evaluations_.fetch_sub(1);
    return done(contract::Retryable(absl::StatusCode::kResourceExhausted, "TOO_MANY_EVALUATIONS",
                                    "too many positions of this session are being evaluated",
                                    kRetryPlanAfter));
  }
  RunInteractive([self = shared_from_this(), in = *std::move(inputs), world,
                  done = std::move(done)](parallel::Parallel& parallel) {
    const absl::Time started = absl::Now();
    absl::StatusOr<planning::ViewEvaluation> evaluation =
        self->dependencies_.algorithms.evaluate_view(*in.model.view, in.scanner, in.config,
                                                     world - self->origin_, parallel);
    self->evaluations_.fetch_sub(1);
    if (!evaluation.ok()) return done(evaluation.status());
    v1::EvaluateViewResponse response =
        conversion::WriteEvaluation(*evaluation, in.config.required_density, self->origin_);
    response.set_model_version(in.model.version);
    *response.mutable_duration() =
        conversion::WriteDuration(absl::ToDoubleSeconds(absl::Now() - started));
    done(std::move(response));
  });
}

absl::StatusOr<v1::GetCoverageResponse> Session::MeasureCoverage() {
  v1::GetCoverageResponse response;
  const v1::Session described = Describe();
  const ModelSnapshot model = Model();
  if (model.view == nullptr) {
    // Before the first scan nothing is covered, which is an answer.
    absl::Status why = WhyNoModel();
    if (absl::IsUnavailable(why) || absl::IsResourceExhausted(why)) return why;
  }
  response.set_model_version(model.version);
  response.mutable_coverage()->set_required_density_per_m2(
      described.planning_config().required_density_per_m2());
  if (model.view != nullptr) {
    contract::Violations violations;
    const planning::PlanningConfig config = conversion::ReadPlanningConfig(
        described.planning_config(), described.site_rules(), origin_, model.view->voxel_size(),
        "planning_config", "site_rules", violations);
    *response.mutable_coverage() = conversion::WriteCoverage(
        dependencies_.algorithms.measure_coverage(*model.view, config), config.required_density);
    FindGivenUp(*model.view, origin_, response);
  }
  v1::Plan last;
  journal_.Read([&](const SessionState& state) {
    for (auto it = state.plan_order.rbegin(); it != state.plan_order.rend(); ++it) {
      const v1::Plan& plan = state.plans.at(*it).plan;
      if (!SaysWhatRemains(plan)) continue;
      last = plan;
      return;
    }
  });
  if (!last.name().empty()) {
    response.set_plan(last.name());
    response.set_best_remaining_model_gain_m2(
        last.result().termination().best_model_gain_upper_m2());
    absl::StatusOr<v1::PlanResult> full = GetFullResult(last.name());
    if (full.ok()) {
      const int count = std::min(full->patches_size(), kCoveragePatches);
      for (int i = 0; i < count; ++i) *response.add_patches() = full->patches(i);
    }
  }
  return response;
}

}  // namespace vantage::session

#include "server/session/tours.h"

#include <algorithm>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "server/contract/error.h"
#include "server/conversion/check_request.h"
#include "server/conversion/fleet_proto.h"
#include "server/conversion/from_proto.h"
#include "server/conversion/tour_proto.h"
#include "server/session/asked_evaluation.h"

namespace vantage::session {
namespace {

constexpr absl::Duration kRetryTourAfter = absl::Seconds(5);

// The same error with a reason that programs can tell.
absl::Status WithReason(const absl::Status& status, bool draining) {
  if (!contract::ReasonOf(status).empty()) return status;
  switch (status.code()) {
    case absl::StatusCode::kFailedPrecondition:
      return contract::ErrorWithReason(status.code(), "NOWHERE_TO_STAND", status.message());
    case absl::StatusCode::kResourceExhausted:
      return contract::ErrorWithReason(status.code(), "PLAN_TOO_LARGE", status.message());
    case absl::StatusCode::kCancelled:
      if (!draining) return status;
      return contract::Retryable(absl::StatusCode::kUnavailable, "DRAINING",
                                 "the server shuts down; ask again after its next start",
                                 kRetryTourAfter);
    default:
      return status;
  }
}

}  // namespace

// A tour on its way, with what it takes.
struct Tours::Making {
  Making(SessionContext& context, Inputs in, std::shared_ptr<Evaluation> evaluation,
         const std::shared_ptr<TourRun>& run)
      : inputs(std::move(in)),
        end(context, std::move(evaluation),
            [run](const absl::StatusOr<Made>& made) { run->End(made.status()); }) {}

  const Inputs inputs;
  AskedEvaluation<Made> end;
};

TourRun::News TourRun::Take() {
  std::lock_guard<std::mutex> lock(mutex_);
  News news{std::move(tour_), ended_, status_};
  tour_.reset();
  return news;
}

bool TourRun::Ended() {
  std::lock_guard<std::mutex> lock(mutex_);
  return ended_;
}

void TourRun::Tell(std::function<void()> call) {
  std::lock_guard<std::mutex> lock(mutex_);
  call_ = std::move(call);
}

void TourRun::Improve(v1::Tour tour) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    tour.set_revision(++revision_);
    tour_ = std::move(tour);
  }
  Notify();
}

void TourRun::End(absl::Status status) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    ended_ = true;
    status_ = std::move(status);
  }
  Notify();
}

void TourRun::Notify() {
  std::function<void()> call;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    call = call_;
  }
  if (call) call();
}

Tours::Tours(SessionContext& context, ModelMemory& model, Preparation& preparation)
    : context_(context),
      dependencies_(context.dependencies()),
      model_(model),
      preparation_(preparation) {}

absl::StatusOr<Tours::Inputs> Tours::Read(const v1::TourWish& wish) {
  // A plan of the same scanners says what is wrong with them.
  std::string scanner_model = wish.scanner_model_id();
  std::vector<fleet::FleetMember> members;
  std::vector<std::string> names;
  contract::Violations violations;
  const v1::ScannerModel* first = nullptr;
  v1::Session described;
  context_.journal().Read([&](const SessionState& state) {
    described = state.session;
    for (int i = 0; i < wish.scanners_size(); ++i) {
      const std::string field = absl::StrCat("wish.scanners[", i, "]");
      const auto it = state.scanners.find(wish.scanners(i));
      if (it == state.scanners.end()) {
        violations.Add(field,
                       absl::StrCat("'", wish.scanners(i), "' is no scanner of this session"));
        continue;
      }
      if (std::count(names.begin(), names.end(), wish.scanners(i)) > 0) {
        violations.Add(field, absl::StrCat("'", wish.scanners(i), "' is named twice"));
        continue;
      }
      const v1::ScannerModel& model = conversion::ModelOf(it->second, described);
      if (first == nullptr) first = &model;
      if (model.id() != first->id()) {
        violations.Add(field,
                       "is of another model than the first; a tour is made for scanners of "
                       "one model");
      }
      names.push_back(wish.scanners(i));
      members.push_back(conversion::ReadFleetMember(it->second, described, context_.origin()));
    }
  });
  if (first != nullptr) scanner_model = first->id();
  absl::Status known = violations.ToStatus();
  if (!known.ok()) return known;
  absl::StatusOr<PlanInputs> plan =
      ReadPlanInputs(context_, model_, scanner_model, wish.config_overrides(), "wish.");
  if (!plan.ok()) return plan.status();
  Inputs inputs{*std::move(plan), {}, nullptr};
  contract::Violations rooms;
  inputs.request =
      conversion::ReadTourWish(wish, inputs.plan.config.regions, context_.origin(), rooms);
  known = rooms.ToStatus();
  if (!known.ok()) return known;
  if (members.empty()) {
    v1::Scanner alone;
    alone.set_scanner_model_id(inputs.plan.scanner_id);
    conversion::FillDefaults(alone, described);
    members.push_back(conversion::ReadFleetMember(alone, described, context_.origin()));
  }
  for (fleet::FleetMember& member : members) member.model = inputs.plan.scanner;
  if (!inputs.request.previous.empty() && !inputs.plan.scanner.TurnsAllAround()) {
    return contract::InvalidField(
        "wish.previous_stations",
        "goes with scanners that turn all around; it does not say where others face");
  }
  inputs.request.scanners = std::move(members);
  inputs.plan.scanners = std::move(names);
  if (absl::Status fits = CheckSize(inputs.plan); !fits.ok()) return fits;
  const conversion::PlanBudget budget = conversion::ReadTourBudget(wish);
  inputs.plan.seconds = budget.seconds;
  if (budget.work_limit > 0) inputs.plan.budget.work_limit = budget.work_limit;
  if (absl::Status room = ReserveMemory(model_, inputs.plan); !room.ok()) return room;
  const auto own = static_cast<int64_t>(tour::EstimateTourMemory(inputs.request));
  if (absl::Status fits = CheckEverFits(
          model_, own + inputs.plan.certain_memory, "with the model and its problem the tour",
          "set a smaller wish.max_candidate_count, use larger viewcells");
      !fits.ok()) {
    return fits;
  }
  absl::StatusOr<MemoryAccount::Reservation> room = model_.Reserve(own);
  if (!room.ok()) return room.status();
  inputs.memory = std::make_shared<MemoryAccount::Reservation>(*std::move(room));
  return inputs;
}

absl::StatusOr<std::shared_ptr<TourRun>> Tours::Create(const v1::CreateTourRequest& request) {
  const auto run = std::make_shared<TourRun>();
  std::shared_ptr<Evaluation> evaluation;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    // One that has ended is still held by whoever reads its last tour.
    std::erase_if(runs_, [](const std::weak_ptr<TourRun>& weak) {
      const std::shared_ptr<TourRun> other = weak.lock();
      return other == nullptr || other->Ended();
    });
    if (runs_.size() >= dependencies_.limits.running_plans_per_session) {
      return contract::Retryable(absl::StatusCode::kResourceExhausted, "TOO_MANY_TOURS",
                                 absl::StrCat(runs_.size(),
                                              " tours are being made, the most a session may; end "
                                              "one or wait"),
                                 kRetryTourAfter);
    }
    // The model stays in memory, and counts as in use.
    evaluation = model_.BeginEvaluation();
    if (evaluation == nullptr) {
      return contract::Retryable(absl::StatusCode::kResourceExhausted, "TOO_MANY_EVALUATIONS",
                                 "too many positions of this session are being evaluated",
                                 kRetryTourAfter);
    }
    runs_.push_back(run);
    // Who came after all were told to stop is told here.
    if (context_.closed() || context_.draining()) run->Stop();
  }
  // Memory for it is looked for once there is a place, since others' models may have to go for it.
  absl::StatusOr<Inputs> inputs = Read(request.wish());
  if (!inputs.ok()) return inputs.status();
  // However it ends, who waits for it is told.
  const auto making =
      std::make_shared<Making>(context_, *std::move(inputs), std::move(evaluation), run);
  preparation_.WhenPrepared(making->inputs.plan, [this, making, run] {
    context_.Submit(
        execution::JobPriority::kPlan,
        [this, making, run](parallel::Parallel& parallel) {
          making->end.Answer([&] { return Run(*run, making->inputs, parallel); });
        },
        making->inputs.plan.seconds);
  });
  return run;
}

absl::StatusOr<Tours::Made> Tours::Run(TourRun& run, const Inputs& inputs,
                                       parallel::Parallel& parallel) {
  const absl::Time began = absl::Now();
  parallel::Budget budget = inputs.plan.budget;
  if (inputs.plan.seconds > 0) {
    budget.deadline = parallel::Budget::Seconds(inputs.plan.seconds).deadline;
  }
  budget.cancelled = run.stop_.get_token();
  const auto show = [&](const tour::Tour& tour) {
    v1::Tour written = conversion::WriteTour(
        tour, inputs.plan.scanners, inputs.plan.config.required_density, context_.origin());
    written.set_model_version(inputs.plan.model.version);
    run.Improve(std::move(written));
  };
  const absl::StatusOr<tour::Tour> made = dependencies_.algorithms.make_tour(
      TaskOf(model_, inputs.plan), inputs.request, budget, parallel, show);
  telemetry::ObserveStage(dependencies_.metrics, "tour",
                          absl::ToDoubleSeconds(absl::Now() - began));
  if (!made.ok()) return WithReason(made.status(), context_.draining());
  return Made();
}

void Tours::Stop() {
  std::lock_guard<std::mutex> lock(mutex_);
  for (const std::weak_ptr<TourRun>& weak : runs_) {
    if (const auto run = weak.lock()) run->Stop();
  }
}

}  // namespace vantage::session

#include "server/session/plan_inputs.h"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/fleet/joint_plan_estimate.h"
#include "core/planning/problem/planning_estimate.h"
#include "core/sensor/presets.h"
#include "server/contract/error.h"
#include "server/conversion/check_request.h"
#include "server/conversion/fleet_proto.h"
#include "server/conversion/from_proto.h"
#include "server/conversion/to_proto.h"
#include "server/session/instrument.h"
#include "server/session/pledged_views.h"
#include "server/session/sightings.h"

namespace vantage::session {
namespace {

using PreparedOr = absl::StatusOr<std::shared_ptr<const planning::PlanningProblem>>;

// Bytes that what a prior shows adds to a plan, which has a problem for each scanner model, or the
// one before beside the one of a setting.
int64_t MemoryOfPrior(const SitePriorUse::Use& use, const PlanInputs& inputs) {
  if (use.site == nullptr) return 0;
  const size_t problems =
      std::max(inputs.scanner_models, inputs.settings.size() > 1 ? size_t{2} : size_t{1});
  return static_cast<int64_t>(problems *
                              planning::EstimatePlanningMemory(use.site->view(), inputs.config));
}

// Bytes that the plan will need at most. What a prior adds is known from its last use on; before
// that it is counted as the model is, and as what it is once it is made (WithPrior()).
int64_t MemoryOf(const ModelMemory& model, PlanInputs& inputs) {
  inputs.certain_memory = 0;
  const auto known = static_cast<int64_t>(
      fleet::EstimateJointPlanMemory(*inputs.model.view, inputs.config, inputs.scanner_models));
  if (inputs.prior.has_value()) {
    const auto use = model.site_prior().Last(*inputs.prior);
    inputs.memory_of_prior = use == nullptr ? known : MemoryOfPrior(*use, inputs);
    if (use != nullptr) inputs.certain_memory = inputs.memory_of_prior;
  }
  inputs.certain_memory += known;
  return known + inputs.memory_of_prior;
}

// `inputs.memory`, and what the prior takes beyond what was counted. RESOURCE_EXHAUSTED
// (MEMORY_SHORT, PLAN_TOO_LARGE).
absl::StatusOr<std::shared_ptr<MemoryAccount::Reservation>> WithPrior(
    const ModelMemory& model, const PlanInputs& inputs, const SitePriorUse::Use& use) {
  const int64_t more = MemoryOfPrior(use, inputs) - inputs.memory_of_prior;
  if (more <= 0 || inputs.memory == nullptr) return inputs.memory;
  struct Both {
    std::shared_ptr<MemoryAccount::Reservation> plan;
    MemoryAccount::Reservation prior;
  };
  if (absl::Status fits =
          CheckEverFits(model, more + inputs.memory->bytes(), "with the prior of the site the plan",
                        "use larger viewcells, or a prior of the part that is to be scanned");
      !fits.ok()) {
    return fits;
  }
  std::optional<MemoryAccount::Reservation> reserved;
  if (inputs.wanted == SitePriorUse::Wanted::kAhead) {
    reserved = model.memory().ReserveSpare(more);
    if (!reserved.has_value()) return MemoryShort(more);
  } else {
    absl::StatusOr<MemoryAccount::Reservation> asked = model.Reserve(more);
    if (!asked.ok()) return asked.status();
    reserved = *std::move(asked);
  }
  const auto both = std::make_shared<Both>(Both{inputs.memory, *std::move(reserved)});
  return std::shared_ptr<MemoryAccount::Reservation>(both, both->plan.get());
}

// The id of the scan that entered the model last; empty where the log has other scans in it than
// the model, which follows.
std::string LastScanOf(SessionContext& context, const ModelSnapshot& model) {
  std::string last;
  size_t count = 0;
  context.journal().Read([&](const SessionState& state) {
    uint64_t latest = 0;
    for (const std::string& name : state.scan_order) {
      const ScanRecord& record = state.scans.at(name);
      if (!record.in_model || record.entered > model.version) continue;
      ++count;
      if (record.entered < latest) continue;
      latest = record.entered;
      last = name.substr(name.rfind('/') + 1);
    }
  });
  return count == model.view->stations().size() ? last : "";
}

}  // namespace

absl::StatusOr<PlanInputs> ReadPlanInputs(SessionContext& context, ModelMemory& model,
                                          const std::string& scanner_model_id,
                                          const v1::PlanningConfig& overrides,
                                          const std::string& prefix) {
  PlanInputs inputs;
  v1::SiteRules rules;
  v1::ScannerModel scanner;
  double voxel_size = 0;
  bool known = false;
  std::vector<planning::RejectedPlace> rejected;
  v1::Session described;
  const google::protobuf::Timestamp now = conversion::WriteTime(context.journal().Now());
  context.journal().Read([&](const SessionState& state) {
    described = state.session;
    for (const v1::Rejection* rejection : state.RejectionsAt(now)) {
      rejected.push_back({conversion::ReadOwnVector(rejection->position()) - context.origin(),
                          rejection->radius_m()});
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
  registration::InstrumentResiduals instrument;
  std::vector<registration::KnownTarget> targets;
  std::vector<planning::ScannedFrom> scanned_from;
  if (known) {
    context.journal().Read([&](const SessionState& state) {
      instrument = InstrumentShown(state, scanner);
      targets = KnownTargetsOf(state, context.origin());
      scanned_from = ScannedFromOf(state, context.origin());
    });
  }
  contract::Violations violations;
  if (!known) {
    violations.Add(
        prefix + "scanner_model_id",
        absl::StrCat("'", scanner_model_id, "' is none of the session's scanner models"));
  }
  conversion::Override(overrides, inputs.written);
  inputs.config =
      conversion::ReadPlanningConfig(inputs.written, rules, context.origin(), voxel_size,
                                     prefix + "config_overrides", "session.site_rules", violations);
  inputs.scanner = conversion::ReadScannerModel(scanner, "scanner_model", violations);
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return valid;
  inputs.read_from = absl::StrCat(inputs.written.SerializeAsString(), "\n",
                                  rules.SerializeAsString(), "\n", Told(instrument));
  inputs.config.registration.instrument = instrument;
  const auto tell = [&](const std::string& name, const Eigen::Vector3d& at, double figure) {
    absl::StrAppendFormat(&inputs.read_from, "%s %a %a %a %a\n", name, at.x(), at.y(), at.z(),
                          figure);
  };
  for (const auto& target : targets) tell(target.name, target.in_world, target.sigma);
  for (const auto& scan : scanned_from) tell(scan.name, scan.position, scan.error_bound);
  inputs.config.targets = std::move(targets);
  inputs.config.scanned_from = std::move(scanned_from);
  for (const planning::RejectedPlace& place : rejected) {
    absl::StrAppendFormat(&inputs.read_from, "%a %a %a %a\n", place.position.x(),
                          place.position.y(), place.position.z(), place.radius);
  }
  inputs.config.rejected = std::move(rejected);
  absl::Status possible = inputs.config.Validate(inputs.scanner);
  if (!possible.ok())
    return contract::InvalidField(prefix + "config_overrides", possible.message());
  inputs.scanner_id = scanner.id();
  inputs.preset = scanner.preset();
  inputs.setting = scanner.setting();
  bool any_in_model = false;
  context.journal().Read([&](const SessionState& state) {
    inputs.prior = SitePriorOf(state, context.origin(), context.dependencies().store);
    any_in_model = state.AnyInModel();
  });
  if (inputs.prior.has_value()) absl::StrAppend(&inputs.read_from, "prior ", inputs.prior->set);
  inputs.model = model.Current();
  if (inputs.model.view == nullptr) {
    // Before the first scan a prior of the site is all that there is.
    if (!inputs.prior.has_value() || any_in_model) return model.WhyNone();
    inputs.model.view = std::make_shared<model::PlanningView>(
        voxel_size, 0, std::vector<model::BrickAt>(), std::vector<model::Station>());
    return inputs;
  }
  inputs.last_scan = LastScanOf(context, inputs.model);
  model.Touch();
  return inputs;
}

absl::StatusOr<PlanInputs> ReadInputsOfPlan(SessionContext& context, ModelMemory& model,
                                            const v1::CreatePlanRequest& request) {
  const v1::Plan& asked = request.plan();
  std::string scanner_model = asked.scanner_model_id();
  if (asked.scanners_size() > 0 && scanner_model.empty()) {
    context.journal().Read([&](const SessionState& state) {
      const auto it = state.scanners.find(asked.scanners(0));
      if (it != state.scanners.end()) {
        scanner_model = conversion::ModelOf(it->second, state.session).id();
      }
    });
  }
  absl::StatusOr<PlanInputs> inputs =
      ReadPlanInputs(context, model, scanner_model, asked.config_overrides(), "plan.");
  if (!inputs.ok()) return inputs;
  absl::Status possible = AddFleet(context, request, *inputs);
  if (possible.ok()) possible = UseSetting(asked, *inputs);
  if (possible.ok()) possible = UseTour(asked, context.origin(), *inputs);
  if (possible.ok()) possible = CheckSize(*inputs);
  if (!possible.ok()) return possible;
  const conversion::PlanBudget budget = conversion::ReadPlanBudget(asked);
  inputs->seconds = budget.seconds;
  if (budget.work_limit > 0) inputs->budget.work_limit = budget.work_limit;
  if (asked.has_seed()) inputs->config.seed = asked.seed();
  return inputs;
}

absl::Status AddFleet(const SessionContext& context, const v1::CreatePlanRequest& request,
                      PlanInputs& inputs) {
  constexpr int kMostScanners = 16;
  const auto& scanners = request.plan().scanners();
  contract::Violations violations;
  if (scanners.size() > kMostScanners) {
    violations.Add("plan.scanners", absl::StrCat("names ", scanners.size(), ", at most ",
                                                 kMostScanners, " can be planned for together"));
  }
  if (scanners.size() > 0 && !request.plan().scanner_model_id().empty()) {
    violations.Add("plan.scanner_model_id",
                   "must be empty where scanners are named: each has its own");
  }
  std::set<std::string> models;
  const absl::Time now = context.journal().Now();
  context.journal().Read([&](const SessionState& state) {
    for (int i = 0; i < scanners.size(); ++i) {
      const std::string& name = scanners[i];
      const std::string field = absl::StrCat("plan.scanners[", i, "]");
      const auto it = state.scanners.find(name);
      if (it == state.scanners.end()) {
        violations.Add(field, absl::StrCat("'", name, "' is no scanner of this session"));
      } else if (std::count(inputs.scanners.begin(), inputs.scanners.end(), name) > 0) {
        violations.Add(field, absl::StrCat("'", name, "' is named twice"));
      } else {
        inputs.scanners.push_back(name);
        inputs.fleet.scanners.push_back(
            conversion::ReadFleetMember(it->second, state.session, context.origin()));
        v1::ScannerModel model = conversion::ModelOf(it->second, state.session);
        model.clear_id();  // compared by what it can do
        models.insert(model.SerializeAsString());
      }
    }
    const fleet::Claims claims = conversion::ReadClaims(state.HeldClaims(), context.origin());
    for (const fleet::ViewClaim& claim : claims.held()) {
      const bool own =
          std::count(inputs.scanners.begin(), inputs.scanners.end(), claim.scanner) > 0;
      if (own || !claims.IsActive(claim, now)) continue;
      inputs.claims.push_back(claim.id);
      inputs.fleet.pledged.push_back({claim.position,
                                      conversion::ReadFleetMember(state.scanners.at(claim.scanner),
                                                                  state.session, context.origin())
                                          .model,
                                      claim.heading});
    }
    inputs.stations = state.station_order;
    const std::vector<fleet::PledgedView> made = PendingViews(state, context.origin());
    inputs.fleet.pledged.insert(inputs.fleet.pledged.end(), made.begin(), made.end());
  });
  inputs.scanner_models = std::max<size_t>(1, models.size());
  for (size_t s = 0; s < inputs.fleet.scanners.size(); ++s) {
    const absl::Status possible = inputs.config.Validate(inputs.fleet.scanners[s].model);
    if (!possible.ok()) violations.Add(absl::StrCat("plan.scanners[", s, "]"), possible.message());
  }
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return valid;
  const bool by_minutes = request.plan().ranking() == v1::RANKING_SCORE_PER_MINUTE;
  if (by_minutes) inputs.fleet.ranking = fleet::FleetRanking::kScorePerMinute;
  inputs.joint = by_minutes || !inputs.fleet.scanners.empty() || !inputs.fleet.pledged.empty();
  if (inputs.joint && inputs.fleet.scanners.empty()) {
    inputs.fleet.scanners.emplace_back().model = inputs.scanner;
  }
  return absl::OkStatus();
}

absl::Status UseSetting(const v1::Plan& plan, PlanInputs& inputs) {
  if (plan.preset().empty() && plan.setting().empty() && !plan.choose_setting()) {
    return absl::OkStatus();
  }
  const char* const field = plan.choose_setting()     ? "plan.choose_setting"
                            : !plan.setting().empty() ? "plan.setting"
                                                      : "plan.preset";
  if (plan.scanners_size() > 0) {
    return contract::InvalidField(field, "does not go with named scanners: each has its own");
  }
  if (!plan.preset().empty() && !plan.scanner_model_id().empty()) {
    return contract::InvalidField("plan.preset", "does not go with a scanner model of the session");
  }
  if (plan.choose_setting() && !plan.setting().empty()) {
    return contract::InvalidField(field, "does not go with a setting");
  }
  if (plan.choose_setting() && inputs.joint) {
    return contract::InvalidField(
        field,
        "does not go with active claims, stations whose scans have not come, or a "
        "ranking by minutes");
  }
  if (plan.preset().empty() && inputs.preset.empty()) {
    return contract::InvalidField(
        field, absl::StrCat("scanner model '", inputs.scanner_id, "' has no preset"));
  }
  const absl::StatusOr<sensor::Preset> preset =
      sensor::FindPreset(plan.preset().empty() ? inputs.preset : plan.preset());
  if (!preset.ok()) return contract::InvalidField("plan.preset", preset.status().message());
  if (!plan.preset().empty()) {
    inputs.scanner = preset->model;
    inputs.setting = preset->settings[preset->usual].name;
  }
  const absl::StatusOr<sensor::ScanSetting> own = preset->Setting(inputs.setting);
  if (!own.ok()) return contract::InvalidField(field, own.status().message());
  if (plan.choose_setting()) {
    for (const sensor::ScanSetting& setting : preset->settings) {
      inputs.settings.push_back(
          {setting.name, preset->Changed(inputs.scanner, *own, setting), setting.minutes});
      const absl::Status possible = inputs.config.Validate(inputs.settings.back().scanner);
      if (!possible.ok()) return contract::InvalidField(field, possible.message());
    }
    return absl::OkStatus();
  }
  const absl::StatusOr<sensor::ScanSetting> wanted =
      plan.setting().empty() ? own : preset->Setting(plan.setting());
  if (!wanted.ok()) return contract::InvalidField(field, wanted.status().message());
  inputs.scanner = preset->Changed(inputs.scanner, *own, *wanted);
  if (inputs.joint) inputs.fleet.scanners.front().model = inputs.scanner;
  const absl::Status possible = inputs.config.Validate(inputs.scanner);
  return possible.ok() ? possible : contract::InvalidField(field, possible.message());
}

absl::Status UseTour(const v1::Plan& plan, const Eigen::Vector3d& origin, PlanInputs& inputs) {
  if (plan.tour_stations().empty()) return absl::OkStatus();
  constexpr char kField[] = "plan.tour_stations";
  if (plan.scanners_size() > 0) {
    return contract::InvalidField(
        kField,
        "does not go with named scanners; plan for each alone, by its scanner_model_id, with the "
        "stops that the tour has for it");
  }
  if (inputs.joint) {
    return contract::InvalidField(
        kField,
        "does not go with active claims, stations whose scans have not come, or a ranking by "
        "minutes");
  }
  if (!inputs.settings.empty()) {
    return contract::InvalidField(kField, "does not go with choose_setting");
  }
  for (const v1::Vector3& station : plan.tour_stations()) {
    inputs.tour_stations.push_back(conversion::ReadOwnVector(station) - origin);
  }
  return absl::OkStatus();
}

absl::Status CheckSize(const PlanInputs& inputs) {
  absl::Status fits =
      fleet::CheckJointPlanSize(*inputs.model.view, inputs.config, inputs.scanner_models);
  if (fits.ok()) return fits;
  return contract::ErrorWithReason(fits.code(), "PLAN_TOO_LARGE", fits.message());
}

ProblemQuestion QuestionOf(const PlanInputs& inputs) {
  return {inputs.model.view, inputs.scanner, inputs.config, inputs.read_from};
}

absl::StatusOr<SiteOfPlan> SiteOf(ModelMemory& model, const PlanInputs& inputs,
                                  const parallel::Cancellation& cancelled) {
  if (!inputs.prior.has_value()) return SiteOfPlan{nullptr, inputs.memory};
  const int64_t held = inputs.memory == nullptr ? 0 : inputs.memory->bytes();
  const auto use =
      model.site_prior().Of(*inputs.prior, inputs.model.view, {inputs.wanted, held}, cancelled);
  if (!use.ok()) return use.status();
  auto with = WithPrior(model, inputs, **use);
  if (!with.ok()) return with.status();
  return SiteOfPlan{(*use)->site, *std::move(with)};
}

PlanningTask TaskOf(ModelMemory& model, const PlanInputs& inputs) {
  return {*inputs.model.view, inputs.scanner, inputs.config,
          [&model, &inputs](parallel::Parallel& parallel,
                            const parallel::Cancellation& cancelled) -> PreparedOr {
            absl::StatusOr<SiteOfPlan> prior = SiteOf(model, inputs, cancelled);
            if (!prior.ok()) return prior.status();
            ProblemQuestion question = QuestionOf(inputs);
            question.site = std::move(prior->site);
            return model.prepared().Of(question, std::move(prior->memory), parallel, cancelled);
          },
          inputs.tour_stations};
}

absl::Status CheckEverFits(const ModelMemory& model, int64_t bytes, absl::string_view what,
                           absl::string_view cure) {
  const std::optional<int64_t> most = model.memory().Most();
  const int64_t all = bytes + model.Estimate();
  if (!most.has_value() || all <= *most) return absl::OkStatus();
  return contract::ErrorWithReason(
      absl::StatusCode::kResourceExhausted, "PLAN_TOO_LARGE",
      absl::StrCat(what, " takes some ", all >> 20, " MiB, and the server has ", *most >> 20,
                   " MiB for all models and plans: ", cure,
                   ", or have its operator give it more (--memory-mib)"));
}

absl::Status ReserveMemory(const ModelMemory& model, PlanInputs& inputs) {
  const int64_t bytes = MemoryOf(model, inputs);
  if (absl::Status fits = CheckEverFits(model, inputs.certain_memory, "with its model the plan",
                                        "use larger viewcells or voxels, or a region of interest");
      !fits.ok()) {
    return fits;
  }
  absl::StatusOr<MemoryAccount::Reservation> reservation = model.Reserve(bytes);
  if (!reservation.ok()) return reservation.status();
  inputs.memory = std::make_shared<MemoryAccount::Reservation>(*std::move(reservation));
  return absl::OkStatus();
}

bool ReserveSpareMemory(const ModelMemory& model, PlanInputs& inputs) {
  std::optional<MemoryAccount::Reservation> reservation =
      model.memory().ReserveSpare(MemoryOf(model, inputs));
  if (!reservation.has_value()) return false;
  inputs.wanted = SitePriorUse::Wanted::kAhead;
  inputs.memory = std::make_shared<MemoryAccount::Reservation>(*std::move(reservation));
  return true;
}

}  // namespace vantage::session

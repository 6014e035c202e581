#include <chrono>
#include <cstdio>
#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/cli/terminal.h"
#include "client/cli/tour_file.h"
#include "client/library/duration.h"
#include "client/library/resource_names.h"
#include "client/library/tour_stations.h"

namespace vantage::cli {
namespace {

struct PlanArguments {
  std::string session;
  std::optional<double> budget;
  std::optional<uint64_t> work;
  std::optional<uint64_t> seed;
  std::string scanner;
  std::vector<std::string> scanners;
  std::string rank;
  std::string preset;
  std::string setting;
  bool choose_setting = false;
  std::string tour;
  std::vector<std::string> set;
  bool json = false;
  bool full = false;
};

absl::StatusOr<v1::CreatePlanRequest> RequestFrom(const PlanArguments& arguments) {
  v1::CreatePlanRequest request;
  request.set_parent(client::SessionName(arguments.session));
  v1::Plan& plan = *request.mutable_plan();
  if (arguments.budget) *plan.mutable_time_budget() = client::DurationOf(*arguments.budget);
  if (arguments.work) plan.set_work_limit_rays(*arguments.work);
  if (arguments.seed) plan.set_seed(*arguments.seed);
  plan.set_scanner_model_id(arguments.scanner);
  for (const std::string& id : arguments.scanners) {
    plan.add_scanners(client::ScannerName(arguments.session, id));
  }
  plan.set_preset(arguments.preset);
  plan.set_setting(arguments.setting);
  plan.set_choose_setting(arguments.choose_setting);
  if (arguments.rank == "per-minute") plan.set_ranking(v1::RANKING_SCORE_PER_MINUTE);
  if (!arguments.tour.empty()) {
    const auto stations = ReadTourOfOne(arguments.tour);
    if (!stations.ok()) return stations.status();
    if (stations->empty()) {
      return absl::InvalidArgumentError(
          absl::StrCat("--tour ", arguments.tour, ": the tour has no stops to follow"));
    }
    client::SetTourStations(*stations, plan);
  }
  if (absl::Status set = SetFields(*plan.mutable_config_overrides(), arguments.set); !set.ok()) {
    return set;
  }
  return request;
}

absl::StatusOr<ExitCode> RunPlan(Environment& environment, const PlanArguments& arguments) {
  const auto request = RequestFrom(arguments);
  if (!request.ok()) return request.status();
  client::Client& client = environment.client();
  const auto created = client.Call(*request);
  if (!created.ok()) return created.status();

  WaitingLine line;
  // A budget in rays says nothing of time.
  const double seconds = client::SecondsOf(created->plan().time_budget());
  std::optional<std::chrono::steady_clock::time_point> began;  // to have something to show
  const auto watched = client.WatchPlan(created->plan().name(), [&](const v1::Plan& plan) {
    const v1::PlanResult& r = plan.result();
    if (r.views_size() + r.refused_size() == 0) {
      const int ahead = plan.plans_ahead_count();
      if (ahead > 0) {
        line.Show(absl::StrFormat("%s, %d %s first", Word(plan.state()), ahead,
                                  ahead == 1 ? "plan goes" : "plans go"));
      } else {
        line.Show(Word(plan.state()), seconds);
      }
      return;
    }
    const v1::RankedView& best = r.views_size() > 0 ? r.views(0) : r.refused(0);
    if (!began) began = std::chrono::steady_clock::now();
    const double left =
        seconds - std::chrono::duration<double>(std::chrono::steady_clock::now() - *began).count();
    line.Show(absl::StrFormat("%s %s: score %.0f (%.0f..%.0f), gap %.1f %%, %.0f M rays%s",
                              Word(plan.state()), Text(best.position()), best.score(),
                              best.score_lower(), best.score_upper(), r.optimality_gap() * 100,
                              static_cast<double>(r.ray_count()) / 1e6,
                              left > 0 ? absl::StrCat(", ", TimeLeft(left)) : ""));
  });
  line.Clear();
  if (!watched.ok()) return watched.status();
  v1::Plan plan = *watched;
  if (arguments.full) {
    auto full = client.GetFullPlan(plan.name());
    if (!full.ok()) return full.status();
    plan = *std::move(full);
  }
  std::fputs(arguments.json ? ToJson(plan).c_str() : PlanReport(plan).c_str(), stdout);
  return ExitCodeOf(plan);
}

}  // namespace

void AddPlan(CLI::App& parent, Environment& environment) {
  AddCommand<PlanArguments>(
      parent, environment, "plan", "Where to put the scanner next",
      "  vantage plan flat\n"
      "  vantage plan flat --budget 0.2 --json\n"
      "  vantage plan flat --work 20000000 --seed 7      (repeatable to the byte)\n"
      "  vantage plan flat --scanners red,blue,green --rank per-minute\n"
      "  vantage tour flat --json > tour.json; vantage plan flat --tour tour.json\n"
      "  vantage plan flat --set max_view_count=3 --set weights.hole_boundary=0",
      [](CLI::App& command, PlanArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        auto* budget = command.add_option("--budget", a.budget, "Time the plan may take, s [1]");
        command.add_option("--work", a.work, "Work it may take, rays, instead of time")
            ->excludes(budget);
        command.add_option("--seed", a.seed, "Seed of all random choices [1]");
        auto* model = command.add_option("--scanner", a.scanner,
                                         "Id of the scanner model [the session's first]");
        command
            .add_option("--scanners", a.scanners,
                        "ID,ID,...: a view for each of these of the fleet, none twice")
            ->delimiter(',')
            ->excludes(model);
        command.add_option("--rank", a.rank, "By score, or by score per-minute [score]")
            ->check(CLI::IsMember({"score", "per-minute"}));
        command.add_option("--preset", a.preset,
                           "Plan for this instrument instead of the session's scanner");
        auto* setting = command.add_option(
            "--setting", a.setting, "Of the scanner's preset, for this plan only [the session's]");
        command
            .add_flag("--choose-setting", a.choose_setting,
                      "Choose each view's setting by what it gains for each minute")
            ->excludes(setting);
        command
            .add_option("--tour", a.tour,
                        "FILE: a tour (vantage tour --json) that is followed: the stop that brings "
                        "most by now goes first, where it still pays and registers")
            ->excludes("--scanners")
            ->excludes("--choose-setting");
        command
            .add_option("--set", a.set,
                        "PATH=VALUE, repeatable: planning configuration for this plan only")
            ->allow_extra_args(false);
        command.add_flag("--json", a.json, "Print the plan as JSON");
        command.add_flag("--full", a.full, "With --json: patches and the map of scores too");
      },
      RunPlan);
}

}  // namespace vantage::cli

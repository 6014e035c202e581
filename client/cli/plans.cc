// Plans that were made.
#include <cstdio>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/cli/table.h"
#include "client/library/resource_names.h"

namespace vantage::cli {
namespace {

struct PlansListArguments {
  std::string session;
  bool running = false;
  bool json = false;
};

absl::StatusOr<ExitCode> RunPlansList(Environment& environment,
                                      const PlansListArguments& arguments) {
  v1::ListPlansRequest request;
  request.set_parent(client::SessionName(arguments.session));
  if (arguments.running) {
    request.add_states(v1::PLAN_STATE_QUEUED);
    request.add_states(v1::PLAN_STATE_RUNNING);
  }
  v1::ListPlansResponse all;
  const absl::Status listed = environment.client().CallForPages(
      request,
      [&](const v1::ListPlansResponse& page) { all.mutable_plans()->MergeFrom(page.plans()); });
  if (!listed.ok()) return listed;
  if (arguments.json) {
    std::fputs(ToJson(all).c_str(), stdout);
    return ExitCode::kOk;
  }
  if (all.plans().empty()) {
    std::puts(arguments.running ? "no plan is under way" : "no plans; 'vantage plan' makes one");
    return ExitCode::kOk;
  }
  Table table({"plan", "state", "outcome", ">model", "next, m", ">gain, m\u00b2", "made"});
  for (const v1::Plan& plan : all.plans()) {
    const v1::PlanResult& result = plan.result();
    const bool any = result.views_size() > 0;
    table.Add({client::IdOf(plan.name()), Word(plan.state()),
               plan.has_result() ? Word(result.outcome()) : "",
               absl::StrCat(result.model_version()), any ? Text(result.views(0).position()) : "",
               any && GainIsKnown(result.views(0))
                   ? absl::StrFormat("%.1f", result.views(0).model_gain_m2())
                   : "",
               Time(plan.create_time())});
  }
  std::fputs(table.ToString().c_str(), stdout);
  return ExitCode::kOk;
}

struct PlansDeleteArguments {
  std::string plan;
  bool json = false;
};

absl::StatusOr<ExitCode> RunPlansDelete(Environment& environment,
                                        const PlansDeleteArguments& arguments) {
  v1::DeletePlanRequest request;
  request.set_name(client::PlanName(arguments.plan));
  const auto deleted = environment.client().Call(request);
  if (!deleted.ok()) return deleted.status();
  if (arguments.json) {
    std::fputs(ToJson(*deleted).c_str(), stdout);
    return ExitCode::kOk;
  }
  std::printf("%s is forgotten\n", client::IdOf(request.name()).c_str());
  return ExitCode::kOk;
}

}  // namespace

void AddPlansList(CLI::App& parent, Environment& environment) {
  AddCommand<PlansListArguments>(
      parent, environment, "list", "List a job's plans, oldest first",
      "  vantage plans list flat\n  vantage plans list flat --running --json",
      [](CLI::App& command, PlansListArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        command.add_flag("--running", a.running, "Only those that have not ended");
        command.add_flag("--json", a.json, "Print them as JSON");
      },
      RunPlansList);
}

void AddPlansDelete(CLI::App& parent, Environment& environment) {
  AddCommand<PlansDeleteArguments>(
      parent, environment, "delete", "Forget a plan that has ended, with its details",
      "  vantage plans delete flat/plan-3",
      [](CLI::App& command, PlansDeleteArguments& a) {
        command.add_option("PLAN", a.plan, "JOB/PLAN")->required();
        command.add_flag("--json", a.json, "Print the answer as JSON");
      },
      RunPlansDelete);
}

}  // namespace vantage::cli

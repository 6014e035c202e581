#include <cstdio>

#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/cli/table.h"
#include "client/library/resource_names.h"

namespace vantage::cli {
namespace {

struct RejectionListArguments {
  std::string session;
  bool json = false;
};

absl::StatusOr<ExitCode> RunRejectionList(Environment& environment,
                                          const RejectionListArguments& arguments) {
  v1::ListRejectionsRequest request;
  request.set_parent(client::SessionName(arguments.session));
  v1::ListRejectionsResponse all;
  const absl::Status listed =
      environment.client().CallForPages(request, [&](const v1::ListRejectionsResponse& page) {
        all.mutable_rejections()->MergeFrom(page.rejections());
      });
  if (!listed.ok()) return listed;
  if (arguments.json) {
    std::fputs(ToJson(all).c_str(), stdout);
    return ExitCode::kOk;
  }
  if (all.rejections().empty()) {
    std::puts("no place is refused");
    return ExitCode::kOk;
  }
  Table table({"rejection", "position, m", "radius", "since", "until", "why"});
  for (const v1::Rejection& rejection : all.rejections()) {
    table.Add({client::IdOf(rejection.name()), Text(rejection.position()),
               Length(rejection.radius_m()), Time(rejection.create_time()),
               rejection.has_expire_time() ? Time(rejection.expire_time()) : "for good",
               rejection.reason()});
  }
  std::fputs(table.ToString().c_str(), stdout);
  return ExitCode::kOk;
}

struct RejectionDeleteArguments {
  std::string rejection;
  bool json = false;
};

absl::StatusOr<ExitCode> RunRejectionDelete(Environment& environment,
                                            const RejectionDeleteArguments& arguments) {
  v1::DeleteRejectionRequest request;
  request.set_name(client::RejectionName(arguments.rejection));
  const auto deleted = environment.client().Call(request);
  if (!deleted.ok()) return deleted.status();
  if (arguments.json) {
    std::fputs(ToJson(*deleted).c_str(), stdout);
    return ExitCode::kOk;
  }
  std::printf("%s is taken back: plans may use the place again\n",
              client::IdOf(request.name()).c_str());
  return ExitCode::kOk;
}

}  // namespace

void AddRejectionList(CLI::App& parent, Environment& environment) {
  AddCommand<RejectionListArguments>(
      parent, environment, "list", "List the places that plans avoid since somebody refused them",
      "  vantage rejection list flat\n  vantage rejection list flat --json",
      [](CLI::App& command, RejectionListArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        command.add_flag("--json", a.json, "Print them as JSON");
      },
      RunRejectionList);
}

void AddRejectionDelete(CLI::App& parent, Environment& environment) {
  AddCommand<RejectionDeleteArguments>(
      parent, environment, "delete", "Take a refusal back: later plans may use the place again",
      "  vantage rejection delete flat/rejection-3",
      [](CLI::App& command, RejectionDeleteArguments& a) {
        command.add_option("REJECTION", a.rejection, "JOB/REJECTION")->required();
        command.add_flag("--json", a.json, "Print the answer as JSON");
      },
      RunRejectionDelete);
}

}  // namespace vantage::cli

#include <cstdio>

#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/library/resource_names.h"

namespace vantage::cli {
namespace {

struct SessionDeleteArguments {
  std::string session;
  bool json = false;
};

absl::StatusOr<ExitCode> RunSessionDelete(Environment& environment,
                                          const SessionDeleteArguments& arguments) {
  v1::DeleteSessionRequest request;
  request.set_name(client::SessionName(arguments.session));
  const auto deleted = environment.client().Call(request);
  if (!deleted.ok()) return deleted.status();
  if (arguments.json) {
    std::fputs(ToJson(*deleted).c_str(), stdout);
    return ExitCode::kOk;
  }
  std::printf("%s is deleted, with its scans and plans\n", client::IdOf(request.name()).c_str());
  if (deleted->has_backups_forget_time()) {
    std::printf("The last backup that may hold it is gone by %s\n",
                Time(deleted->backups_forget_time()).c_str());
  }
  return ExitCode::kOk;
}

}  // namespace

void AddSessionDelete(CLI::App& parent, Environment& environment) {
  AddCommand<SessionDeleteArguments>(
      parent, environment, "delete", "Delete a job with its scans and plans",
      "  vantage session delete flat",
      [](CLI::App& command, SessionDeleteArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        command.add_flag("--json", a.json, "Print the answer as JSON");
      },
      RunSessionDelete);
}

}  // namespace vantage::cli

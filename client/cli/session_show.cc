#include <cstdio>

#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/library/resource_names.h"

namespace vantage::cli {
namespace {

struct SessionShowArguments {
  std::string session;
  bool json = false;
};

absl::StatusOr<ExitCode> RunSessionShow(Environment& environment,
                                        const SessionShowArguments& arguments) {
  v1::GetSessionRequest request;
  request.set_name(client::SessionName(arguments.session));
  const auto got = environment.client().Call(request);
  if (!got.ok()) return got.status();
  std::fputs(
      arguments.json ? ToJson(got->session()).c_str() : SessionReport(got->session()).c_str(),
      stdout);
  return ExitCode::kOk;
}

}  // namespace

void AddSessionShow(CLI::App& parent, Environment& environment) {
  AddCommand<SessionShowArguments>(
      parent, environment, "show", "Show a job with its configuration",
      "  vantage session show flat\n  vantage session show flat --json",
      [](CLI::App& command, SessionShowArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        command.add_flag("--json", a.json, "Print it as JSON, every field");
      },
      RunSessionShow);
}

}  // namespace vantage::cli

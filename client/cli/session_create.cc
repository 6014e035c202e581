#include <cstdio>

#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/cli/session_settings.h"

namespace vantage::cli {
namespace {

struct SessionCreateArguments {
  std::string id;
  SessionSettings settings;
  bool json = false;
};

absl::StatusOr<ExitCode> RunSessionCreate(Environment& environment,
                                          const SessionCreateArguments& arguments) {
  v1::CreateSessionRequest request;
  request.set_session_id(arguments.id);
  if (auto paths = ApplySettings(arguments.settings, *request.mutable_session()); !paths.ok()) {
    return paths.status();
  }
  const auto created = environment.client().Call(request);
  if (!created.ok()) return created.status();
  std::fputs(arguments.json ? ToJson(created->session()).c_str()
                            : SessionReport(created->session()).c_str(),
             stdout);
  return ExitCode::kOk;
}

}  // namespace

void AddSessionCreate(CLI::App& parent, Environment& environment) {
  AddCommand<SessionCreateArguments>(
      parent, environment, "create", "Open a job",
      "  vantage session create flat --name 'Flat, 3rd floor'\n"
      "  vantage session create --scanner-from scan1.ptx --density 100\n"
      "  vantage session create hall --config hall.json --set "
      "planning_config.max_viewpoint_height_m=3",
      [](CLI::App& command, SessionCreateArguments& a) {
        command.add_option("ID", a.id, "1 to 63 of [a-z0-9-]; chosen by the server when left out");
        AddSettings(command, a.settings);
        command.add_flag("--json", a.json, "Print the session as JSON");
      },
      RunSessionCreate);
}

}  // namespace vantage::cli

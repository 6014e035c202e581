#include <cstdio>

#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/cli/session_settings.h"
#include "client/library/error.h"
#include "client/library/resource_names.h"

namespace vantage::cli {
namespace {

struct SessionUpdateArguments {
  std::string session;
  SessionSettings settings;
  bool json = false;
};

absl::StatusOr<ExitCode> RunSessionUpdate(Environment& environment,
                                          const SessionUpdateArguments& arguments) {
  v1::GetSessionRequest get;
  get.set_name(client::SessionName(arguments.session));
  auto current = environment.client().Call(get);
  if (!current.ok()) return current.status();
  v1::UpdateSessionRequest request;
  *request.mutable_session() = std::move(*current->mutable_session());
  const auto paths = ApplySettings(arguments.settings, *request.mutable_session());
  if (!paths.ok()) return paths.status();
  if (paths->empty()) {
    return client::WithFix(absl::InvalidArgumentError("nothing to change was given"),
                           "name what to change with --set, --density, --config, ...");
  }
  for (const std::string& path : *paths) request.mutable_update_mask()->add_paths(path);
  const auto updated = environment.client().Call(request);
  if (!updated.ok()) return updated.status();
  PrintAnswer(arguments.json, updated->session(), SessionReport(updated->session()));
  return ExitCode::kOk;
}

}  // namespace

void AddSessionUpdate(CLI::App& parent, Environment& environment) {
  AddCommand<SessionUpdateArguments>(
      parent, environment, "update", "Change a job's configuration",
      "  vantage session update flat --density 1600\n"
      "  vantage session update flat --set 'site_rules.keep_out={min {x: 1 y: 2 z: 0} max {x: 2 "
      "y: 3 z: 3}}'",
      [](CLI::App& command, SessionUpdateArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        AddSettings(command, a.settings);
        command.add_flag("--json", a.json, "Print the session as JSON");
      },
      RunSessionUpdate);
}

}  // namespace vantage::cli

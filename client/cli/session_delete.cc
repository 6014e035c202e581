#include <cstdio>

#include "client/cli/command.h"

namespace vantage {
namespace {

struct Arguments {
  std::string session;
};

absl::StatusOr<ExitCode> Run(Environment& environment, const Arguments& arguments) {
  v1::DeleteSessionRequest request;
  request.set_name(SessionName(arguments.session));
  const auto deleted = environment.client().Call(request);
  if (!deleted.ok()) return deleted.status();
  std::printf("%s is deleted, with its scans and plans\n", IdOf(request.name()).c_str());
  return ExitCode::kOk;
}

}  // namespace

void AddSessionDelete(CLI::App& parent, Environment& environment) {
  AddCommand<Arguments>(
      parent, environment, "delete", "Delete a job with its scans and plans",
      "  vantage session delete flat",
      [](CLI::App& command, Arguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
      },
      Run);
}

}  // namespace vantage

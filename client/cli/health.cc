#include <cstdio>

#include "client/cli/command.h"

namespace vantage::cli {
namespace {

struct HealthArguments {
  std::string service;
};

absl::StatusOr<ExitCode> RunHealth(Environment& environment, const HealthArguments& arguments) {
  const auto health = environment.client().CheckHealth(arguments.service);
  if (!health.ok()) return health.status();
  switch (*health) {
    case client::Health::kServing:
      std::puts("serving");
      return ExitCode::kOk;
    case client::Health::kNotServing:
      std::puts("not serving: starting or draining");
      return ExitCode::kUnwelcome;
    case client::Health::kUnknownService:
      std::printf("there is no service '%s'\n", arguments.service.c_str());
      return ExitCode::kNotFound;
  }
  return ExitCode::kInternal;
}

}  // namespace

void AddHealth(CLI::App& parent, Environment& environment) {
  AddCommand<HealthArguments>(
      parent, environment, "health", "Whether the server takes work",
      "  vantage health\n  vantage health vantage.v1.PlanService",
      [](CLI::App& command, HealthArguments& a) {
        command.add_option("SERVICE", a.service, "A service by its full name [the whole server]");
      },
      RunHealth);
}

}  // namespace vantage::cli

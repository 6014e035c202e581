#include <cstdio>

#include "client/cli/command.h"
#include "client/cli/json.h"

namespace vantage::cli {
namespace {

struct HealthArguments {
  std::string service;
  bool json = false;
};

ExitCode CodeOf(client::Health health) {
  switch (health) {
    case client::Health::kServing:
      return ExitCode::kOk;
    case client::Health::kNotServing:
      return ExitCode::kUnwelcome;
    case client::Health::kUnknownService:
      return ExitCode::kNotFound;
  }
  return ExitCode::kInternal;
}

absl::StatusOr<ExitCode> RunHealth(Environment& environment, const HealthArguments& arguments) {
  const auto health = environment.client().CheckHealth(arguments.service);
  if (!health.ok()) return health.status();
  if (arguments.json) {
    PrintJson({{"service", arguments.service},
               {"status", *health == client::Health::kServing      ? "SERVING"
                          : *health == client::Health::kNotServing ? "NOT_SERVING"
                                                                   : "SERVICE_UNKNOWN"}});
    return CodeOf(*health);
  }
  switch (*health) {
    case client::Health::kServing:
      std::puts("serving");
      break;
    case client::Health::kNotServing:
      std::puts("not serving: starting or draining");
      break;
    case client::Health::kUnknownService:
      std::printf("there is no service '%s'\n", arguments.service.c_str());
      break;
  }
  return CodeOf(*health);
}

}  // namespace

void AddHealth(CLI::App& parent, Environment& environment) {
  AddCommand<HealthArguments>(
      parent, environment, "health", "Whether the server takes work",
      "  vantage health\n  vantage health vantage.v1.PlanService",
      [](CLI::App& command, HealthArguments& a) {
        command.add_option("SERVICE", a.service, "A service by its full name [the whole server]");
        command.add_flag("--json", a.json, "Print the answer as JSON");
      },
      RunHealth);
}

}  // namespace vantage::cli

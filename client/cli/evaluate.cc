#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/library/duration.h"
#include "client/library/geometry.h"
#include "client/library/resource_names.h"
#include "core/sensor/scanner_model.h"

namespace vantage::cli {
namespace {

struct EvaluateArguments {
  std::string session;
  std::vector<double> position;
  std::string scanner;
  std::optional<double> heading;  // degrees
  bool json = false;
};

absl::StatusOr<ExitCode> RunEvaluate(Environment& environment, const EvaluateArguments& arguments) {
  v1::EvaluateViewRequest request;
  request.set_parent(client::SessionName(arguments.session));
  *request.mutable_position() = client::ToProto(
      Eigen::Vector3d(arguments.position[0], arguments.position[1], arguments.position[2]));
  request.set_scanner_model_id(arguments.scanner);
  if (arguments.heading) request.set_heading_rad(sensor::Radians(*arguments.heading));
  const auto evaluated = environment.client().Call(request);
  if (!evaluated.ok()) return evaluated.status();
  if (arguments.json) {
    std::fputs(ToJson(*evaluated).c_str(), stdout);
  } else {
    std::printf("%s  %s\n%s  model      version %llu, %.3f s\n", Text(request.position()).c_str(),
                evaluated->feasible()
                    ? "feasible"
                    : ("not feasible: " + evaluated->infeasible_message()).c_str(),
                ViewReport(evaluated->view()).c_str(),
                static_cast<unsigned long long>(evaluated->model_version()),
                client::SecondsOf(evaluated->duration()));
  }
  return evaluated->feasible() ? ExitCode::kOk : ExitCode::kUnwelcome;
}

}  // namespace

void AddEvaluate(CLI::App& parent, Environment& environment) {
  AddCommand<EvaluateArguments>(
      parent, environment, "evaluate", "What a scan from any position would bring",
      "  vantage evaluate flat 2.1,0.4,1.5\n  vantage evaluate flat 2.1,0.4,1.5 --heading 90\n"
      "  vantage evaluate flat -1.0,0.4,1.5 --json",
      [](CLI::App& command, EvaluateArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        command.add_option("POSITION", a.position, "x,y,z of the scanner's centre, m, world")
            ->required()
            ->delimiter(',')
            ->expected(3);
        command.add_option("--scanner", a.scanner, "Id of the scanner model [the session's first]");
        command.add_option("--heading", a.heading,
                           "Where a scanner that sees a sector would face, degrees from +x [the "
                           "best that registers]");
        command.add_flag("--json", a.json, "Print the answer as JSON");
      },
      RunEvaluate);
}

}  // namespace vantage::cli

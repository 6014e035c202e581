#include <cstdio>
#include <optional>
#include <vector>

#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/library/geometry.h"
#include "client/library/resource_names.h"

namespace vantage::cli {
namespace {

struct RejectArguments {
  std::string session;
  std::vector<double> position;
  std::optional<double> radius;
  std::string reason;
  std::optional<double> minutes;
  bool json = false;
};

absl::StatusOr<ExitCode> RunReject(Environment& environment, const RejectArguments& arguments) {
  v1::RejectViewRequest request;
  request.set_parent(client::SessionName(arguments.session));
  *request.mutable_position() = client::ToProto(
      Eigen::Vector3d(arguments.position[0], arguments.position[1], arguments.position[2]));
  if (arguments.radius) request.set_radius_m(*arguments.radius);
  request.set_reason(arguments.reason);
  if (arguments.minutes) {
    request.mutable_ttl()->set_seconds(static_cast<int64_t>(*arguments.minutes * 60));
  }
  const auto rejected = environment.client().Call(request);
  if (!rejected.ok()) return rejected.status();
  if (arguments.json) {
    std::fputs(ToJson(rejected->rejection()).c_str(), stdout);
    return ExitCode::kOk;
  }
  const v1::Rejection& rejection = rejected->rejection();
  std::printf("plans avoid %s and %s around it%s%s\n", Text(rejection.position()).c_str(),
              Length(rejection.radius_m()).c_str(), rejection.has_expire_time() ? " until " : "",
              rejection.has_expire_time() ? Time(rejection.expire_time()).c_str() : "");
  return ExitCode::kOk;
}

}  // namespace

void AddReject(CLI::App& parent, Environment& environment) {
  AddCommand<RejectArguments>(
      parent, environment, "reject", "'I can't stand there': later plans avoid the place",
      "  vantage reject flat 2.1,0.4,1.5 --reason 'wet floor' --minutes 60\n"
      "  vantage reject flat 2.1,0.4,1.5 --radius 1",
      [](CLI::App& command, RejectArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        command.add_option("POSITION", a.position, "x,y,z of the place, m, world")
            ->required()
            ->delimiter(',')
            ->expected(3);
        command.add_option("--radius", a.radius, "Horizontal radius, m [0.5]");
        command.add_option("--reason", a.reason, "Why, for people");
        command.add_option("--minutes", a.minutes, "How long it stands [for good]");
        command.add_flag("--json", a.json, "Print the answer as JSON");
      },
      RunReject);
}

}  // namespace vantage::cli

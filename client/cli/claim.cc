#include <cstdio>
#include <optional>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/cli/table.h"
#include "client/library/geometry.h"
#include "client/library/resource_names.h"
#include "core/sensor/scanner_model.h"

namespace vantage::cli {
namespace {

void SetMinutes(const std::optional<double>& minutes, google::protobuf::Duration& ttl) {
  if (minutes) ttl.set_seconds(static_cast<int64_t>(*minutes * 60));
}

struct ClaimTakeArguments {
  std::string session;
  std::string scanner;
  std::vector<double> position;
  std::string plan;
  std::optional<double> heading;  // degrees
  std::optional<double> minutes;
  bool json = false;
};

// '2.100, 0.400, 1.500 facing 90°'.
std::string ViewText(const v1::Claim& claim) {
  return absl::StrCat(Text(claim.position()), Facing(claim));
}

absl::StatusOr<ExitCode> RunClaimTake(Environment& environment,
                                      const ClaimTakeArguments& arguments) {
  v1::ClaimViewRequest request;
  request.set_parent(client::SessionName(arguments.session));
  request.set_scanner(client::ScannerName(arguments.session, arguments.scanner));
  *request.mutable_position() = client::ToProto(
      Eigen::Vector3d(arguments.position[0], arguments.position[1], arguments.position[2]));
  if (!arguments.plan.empty()) {
    request.set_plan(absl::StrCat(request.parent(), "/plans/", arguments.plan));
  }
  if (arguments.heading) request.set_heading_rad(sensor::Radians(*arguments.heading));
  if (arguments.minutes) SetMinutes(arguments.minutes, *request.mutable_ttl());
  const auto taken = environment.client().Call(request);
  if (!taken.ok()) return taken.status();
  if (arguments.json) {
    std::fputs(ToJson(taken->claim()).c_str(), stdout);
    return ExitCode::kOk;
  }
  const v1::Claim& claim = taken->claim();
  std::printf("%s: %s is %s's until %s\n", client::IdOf(claim.name()).c_str(),
              ViewText(claim).c_str(), arguments.scanner.c_str(),
              Time(claim.expire_time()).c_str());
  return ExitCode::kOk;
}

struct ClaimNameArguments {
  std::string claim;
  std::optional<double> minutes;
  bool json = false;
};

absl::StatusOr<ExitCode> RunClaimRenew(Environment& environment,
                                       const ClaimNameArguments& arguments) {
  v1::RenewClaimRequest request;
  request.set_name(client::ClaimName(arguments.claim));
  if (arguments.minutes) SetMinutes(arguments.minutes, *request.mutable_ttl());
  const auto renewed = environment.client().Call(request);
  if (!renewed.ok()) return renewed.status();
  if (arguments.json) {
    std::fputs(ToJson(renewed->claim()).c_str(), stdout);
    return ExitCode::kOk;
  }
  std::printf("%s holds until %s\n", client::IdOf(renewed->claim().name()).c_str(),
              Time(renewed->claim().expire_time()).c_str());
  return ExitCode::kOk;
}

absl::StatusOr<ExitCode> RunClaimRelease(Environment& environment,
                                         const ClaimNameArguments& arguments) {
  v1::ReleaseClaimRequest request;
  request.set_name(client::ClaimName(arguments.claim));
  const auto released = environment.client().Call(request);
  if (!released.ok()) return released.status();
  if (arguments.json) {
    std::fputs(ToJson(*released).c_str(), stdout);
    return ExitCode::kOk;
  }
  std::printf("%s is free again\n", client::IdOf(request.name()).c_str());
  return ExitCode::kOk;
}

struct ClaimListArguments {
  std::string session;
  bool json = false;
};

absl::StatusOr<ExitCode> RunClaimList(Environment& environment,
                                      const ClaimListArguments& arguments) {
  v1::ListClaimsRequest request;
  request.set_parent(client::SessionName(arguments.session));
  v1::ListClaimsResponse all;
  const absl::Status listed = environment.client().CallForPages(
      request,
      [&](const v1::ListClaimsResponse& page) { all.mutable_claims()->MergeFrom(page.claims()); });
  if (!listed.ok()) return listed;
  if (arguments.json) {
    std::fputs(ToJson(all).c_str(), stdout);
    return ExitCode::kOk;
  }
  if (all.claims().empty()) {
    std::puts("nothing is claimed");
    return ExitCode::kOk;
  }
  Table table({"claim", "scanner", "position, m", "plan", "until"});
  for (const v1::Claim& claim : all.claims()) {
    table.Add({client::IdOf(claim.name()), client::IdOf(claim.scanner()), ViewText(claim),
               client::IdOf(claim.plan()), Time(claim.expire_time())});
  }
  std::fputs(table.ToString().c_str(), stdout);
  return ExitCode::kOk;
}

}  // namespace

void AddClaimTake(CLI::App& parent, Environment& environment) {
  AddCommand<ClaimTakeArguments>(
      parent, environment, "take", "Reserve a view for a scanner: others are planned around it",
      "  vantage claim take flat red 2.1,0.4,1.5\n"
      "  vantage claim take flat red 2.1,0.4,1.5 --plan plan-3 --minutes 10",
      [](CLI::App& command, ClaimTakeArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        command.add_option("SCANNER", a.scanner, "Whose it will be")->required();
        command.add_option("POSITION", a.position, "x,y,z of the view, m, world")
            ->required()
            ->delimiter(',')
            ->expected(3);
        command.add_option("--plan", a.plan, "The plan that it comes from");
        command.add_option("--heading", a.heading,
                           "Where a scanner that sees a sector will face, degrees from +x");
        command.add_option("--minutes", a.minutes, "How long it holds [30]");
        command.add_flag("--json", a.json, "Print the answer as JSON");
      },
      RunClaimTake);
}

void AddClaimRenew(CLI::App& parent, Environment& environment) {
  AddCommand<ClaimNameArguments>(
      parent, environment, "renew", "Prolong a claim", "  vantage claim renew flat/claim-3",
      [](CLI::App& command, ClaimNameArguments& a) {
        command.add_option("CLAIM", a.claim, "JOB/CLAIM")->required();
        command.add_option("--minutes", a.minutes, "How long it holds from now [30]");
        command.add_flag("--json", a.json, "Print the answer as JSON");
      },
      RunClaimRenew);
}

void AddClaimRelease(CLI::App& parent, Environment& environment) {
  AddCommand<ClaimNameArguments>(
      parent, environment, "release", "Give a claim back", "  vantage claim release flat/claim-3",
      [](CLI::App& command, ClaimNameArguments& a) {
        command.add_option("CLAIM", a.claim, "JOB/CLAIM")->required();
        command.add_flag("--json", a.json, "Print the answer as JSON");
      },
      RunClaimRelease);
}

void AddClaimList(CLI::App& parent, Environment& environment) {
  AddCommand<ClaimListArguments>(
      parent, environment, "list", "List the claims of a job that hold, oldest first",
      "  vantage claim list flat\n  vantage claim list flat --json",
      [](CLI::App& command, ClaimListArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        command.add_flag("--json", a.json, "Print them as JSON");
      },
      RunClaimList);
}

}  // namespace vantage::cli

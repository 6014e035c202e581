#include <cstdio>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/cli/table.h"
#include "client/library/geometry.h"
#include "client/library/resource_names.h"
#include "core/sensor/scanner_model.h"

namespace vantage::cli {
namespace {

struct StationAddArguments {
  std::string session;
  std::vector<double> position;
  std::string from;  // a file of positions; empty: `position` is the only one
  std::string scanner;
  std::string model;
  std::optional<double> heading;  // degrees
  std::optional<double> loss;
  bool json = false;
};

// 'x,y,z' or 'x y z' a line, m; empty lines and those that begin with '#' say nothing.
absl::StatusOr<std::vector<Eigen::Vector3d>> ReadPositions(const std::string& path) {
  std::ifstream file(path);
  if (!file) return absl::NotFoundError(absl::StrCat(path, " cannot be read"));
  std::vector<Eigen::Vector3d> positions;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    const absl::string_view words = absl::StripAsciiWhitespace(line);
    if (words.empty() || words.front() == '#') continue;
    const std::vector<absl::string_view> parts =
        absl::StrSplit(words, absl::ByAnyChar(", \t"), absl::SkipEmpty());
    Eigen::Vector3d position;
    bool read = parts.size() == 3;
    for (int axis = 0; read && axis < 3; ++axis) {
      read = absl::SimpleAtod(parts[static_cast<size_t>(axis)], &position[axis]);
    }
    if (!read) {
      return absl::InvalidArgumentError(
          absl::StrCat(path, ", line ", number, ": '", words, "' is not x,y,z in m"));
    }
    positions.push_back(position);
  }
  if (positions.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(path, " has no positions"));
  }
  return positions;
}

// '5 %'.
std::string LossText(const v1::Station& station) {
  return absl::StrFormat("%.0f %%", 100 * station.loss_chance());
}

absl::StatusOr<ExitCode> RunStationAdd(Environment& environment,
                                       const StationAddArguments& arguments) {
  std::vector<Eigen::Vector3d> positions;
  if (arguments.from.empty()) {
    if (arguments.position.size() != 3) {
      return absl::InvalidArgumentError("give a POSITION x,y,z, or a file of them with --from");
    }
    positions.emplace_back(arguments.position[0], arguments.position[1], arguments.position[2]);
  } else {
    absl::StatusOr<std::vector<Eigen::Vector3d>> read = ReadPositions(arguments.from);
    if (!read.ok()) return read.status();
    positions = *std::move(read);
  }
  for (const Eigen::Vector3d& position : positions) {
    v1::CreateStationRequest request;
    request.set_parent(client::SessionName(arguments.session));
    v1::Station& station = *request.mutable_station();
    *station.mutable_position() = client::ToProto(position);
    if (!arguments.scanner.empty()) {
      station.set_scanner(client::ScannerName(arguments.session, arguments.scanner));
    }
    station.set_scanner_model_id(arguments.model);
    if (arguments.heading) station.set_heading_rad(sensor::Radians(*arguments.heading));
    if (arguments.loss) station.set_loss_chance(*arguments.loss);
    const auto created = environment.client().Call(request);
    if (!created.ok()) return created.status();
    if (arguments.json) {
      std::fputs(ToJson(created->station(), false).c_str(), stdout);
      continue;
    }
    std::printf("%s at %s: %s; counts as scanned, with %s to be lost\n",
                client::IdOf(created->station().name()).c_str(),
                Text(created->station().position()).c_str(), created->station().message().c_str(),
                LossText(created->station()).c_str());
  }
  return ExitCode::kOk;
}

struct StationListArguments {
  std::string session;
  bool json = false;
};

absl::StatusOr<ExitCode> RunStationList(Environment& environment,
                                        const StationListArguments& arguments) {
  v1::ListStationsRequest request;
  request.set_parent(client::SessionName(arguments.session));
  v1::ListStationsResponse all;
  const absl::Status listed =
      environment.client().CallForPages(request, [&](const v1::ListStationsResponse& page) {
        all.mutable_stations()->MergeFrom(page.stations());
      });
  if (!listed.ok()) return listed;
  if (arguments.json) {
    std::fputs(ToJson(all).c_str(), stdout);
    return ExitCode::kOk;
  }
  if (all.stations().empty()) {
    std::puts("no station waits for its scan");
    return ExitCode::kOk;
  }
  Table table(
      {"station", "position, m", "scanner", "should bring, m\u00b2", "may be lost", "since"});
  for (const v1::Station& station : all.stations()) {
    table.Add({client::IdOf(station.name()),
               absl::StrCat(Text(station.position()), Facing(station)),
               client::IdOf(station.scanner()),
               station.has_model_gain_m2() ? absl::StrFormat("%.1f", station.model_gain_m2()) : "-",
               LossText(station), Time(station.create_time())});
  }
  std::fputs(table.ToString().c_str(), stdout);
  return ExitCode::kOk;
}

struct StationDeleteArguments {
  std::string station;
  bool json = false;
};

absl::StatusOr<ExitCode> RunStationDelete(Environment& environment,
                                          const StationDeleteArguments& arguments) {
  v1::DeleteStationRequest request;
  request.set_name(client::StationName(arguments.station));
  const auto deleted = environment.client().Call(request);
  if (!deleted.ok()) return deleted.status();
  if (arguments.json) {
    std::fputs(ToJson(*deleted).c_str(), stdout);
    return ExitCode::kOk;
  }
  std::printf("%s is given up\n", client::IdOf(request.name()).c_str());
  return ExitCode::kOk;
}

}  // namespace

void AddStationAdd(CLI::App& parent, Environment& environment) {
  AddCommand<StationAddArguments>(
      parent, environment, "add",
      "Say that a scan was made whose data will come later: it counts as scanned until then",
      "  vantage station add flat 2.1,0.4,1.5\n"
      "  vantage station add flat --from stations.txt --scanner red",
      [](CLI::App& command, StationAddArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        auto* position =
            command.add_option("POSITION", a.position, "x,y,z of the scanner, m, world");
        position->delimiter(',')->expected(3);
        command.add_option("--from", a.from, "A file with x,y,z of a station on each line")
            ->excludes(position);
        command.add_option("--scanner", a.scanner, "Which scanner of the fleet made it");
        command.add_option("--scanner-model", a.model,
                           "Its scanner model [the scanner's, or the job's first]");
        command.add_option("--heading", a.heading,
                           "Where a scanner that sees a sector faced, degrees from +x");
        command.add_option(
            "--loss", a.loss,
            "The chance that its data do not come into the model, 0 to 1 [estimated]");
        command.add_flag("--json", a.json, "Print each station as JSON on a line");
      },
      RunStationAdd);
}

void AddStationList(CLI::App& parent, Environment& environment) {
  AddCommand<StationListArguments>(
      parent, environment, "list", "List the stations whose scans have not come, oldest first",
      "  vantage station list flat\n  vantage station list flat --json",
      [](CLI::App& command, StationListArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        command.add_flag("--json", a.json, "Print them as JSON");
      },
      RunStationList);
}

void AddStationDelete(CLI::App& parent, Environment& environment) {
  AddCommand<StationDeleteArguments>(
      parent, environment, "delete", "Give a station up: its scan was not made, or will not come",
      "  vantage station delete flat/station-3",
      [](CLI::App& command, StationDeleteArguments& a) {
        command.add_option("STATION", a.station, "JOB/STATION")->required();
        command.add_flag("--json", a.json, "Print the answer as JSON");
      },
      RunStationDelete);
}

}  // namespace vantage::cli

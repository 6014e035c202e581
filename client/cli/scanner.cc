#include <cstdio>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/cli/table.h"
#include "client/library/duration.h"
#include "client/library/error.h"
#include "client/library/geometry.h"
#include "client/library/resource_names.h"
#include "core/sensor/presets.h"

namespace vantage::cli {
namespace {

struct ScannerArguments {
  std::string session;
  std::string id;
  std::string model;
  std::string operator_name;
  std::optional<double> speed;
  std::optional<double> scan_seconds;
  std::vector<std::vector<double>> reach;
  bool json = false;
};

// What the options say of a scanner.
v1::Scanner Described(const ScannerArguments& arguments) {
  v1::Scanner scanner;
  scanner.set_scanner_model_id(arguments.model);
  scanner.set_operator_(arguments.operator_name);
  if (arguments.speed) scanner.set_speed_m_per_s(*arguments.speed);
  if (arguments.scan_seconds) {
    *scanner.mutable_scan_duration() = client::DurationOf(*arguments.scan_seconds);
  }
  for (const std::vector<double>& box : arguments.reach) {
    v1::Box& added = *scanner.add_reach();
    *added.mutable_min() = client::ToProto(Eigen::Vector3d(box[0], box[1], box[2]));
    *added.mutable_max() = client::ToProto(Eigen::Vector3d(box[3], box[4], box[5]));
  }
  return scanner;
}

absl::StatusOr<ExitCode> RunScannerAdd(Environment& environment,
                                       const ScannerArguments& arguments) {
  v1::CreateScannerRequest request;
  request.set_parent(client::SessionName(arguments.session));
  request.set_scanner_id(arguments.id);
  *request.mutable_scanner() = Described(arguments);
  const auto added = environment.client().Call(request);
  if (!added.ok()) return added.status();
  if (arguments.json) {
    std::fputs(ToJson(added->scanner()).c_str(), stdout);
    return ExitCode::kOk;
  }
  std::printf("%s joins, model %s, %.1f m/s, %.0f s a scan\n",
              client::IdOf(added->scanner().name()).c_str(),
              added->scanner().scanner_model_id().c_str(), added->scanner().speed_m_per_s(),
              client::SecondsOf(added->scanner().scan_duration()));
  return ExitCode::kOk;
}

absl::StatusOr<ExitCode> RunScannerUpdate(Environment& environment,
                                          const ScannerArguments& arguments) {
  v1::UpdateScannerRequest request;
  *request.mutable_scanner() = Described(arguments);
  request.mutable_scanner()->set_name(client::ScannerName(arguments.session, arguments.id));
  const std::pair<bool, const char*> given[] = {
      {!arguments.model.empty(), "scanner_model_id"},
      {!arguments.operator_name.empty(), "operator"},
      {arguments.speed.has_value(), "speed_m_per_s"},
      {arguments.scan_seconds.has_value(), "scan_duration"},
      {!arguments.reach.empty(), "reach"}};
  for (const auto& [is_given, field] : given) {
    if (is_given) request.mutable_update_mask()->add_paths(field);
  }
  if (request.update_mask().paths().empty()) {
    return client::WithFix(absl::InvalidArgumentError("nothing is to be changed"),
                           "name --model, --operator, --speed, --seconds or --reach");
  }
  const auto updated = environment.client().Call(request);
  if (!updated.ok()) return updated.status();
  if (arguments.json) {
    std::fputs(ToJson(updated->scanner()).c_str(), stdout);
    return ExitCode::kOk;
  }
  std::printf("%s: model %s, %.1f m/s, %.0f s a scan\n",
              client::IdOf(updated->scanner().name()).c_str(),
              updated->scanner().scanner_model_id().c_str(), updated->scanner().speed_m_per_s(),
              client::SecondsOf(updated->scanner().scan_duration()));
  return ExitCode::kOk;
}

struct ScannerDeleteArguments {
  std::string session;
  std::string id;
  bool json = false;
};

absl::StatusOr<ExitCode> RunScannerDelete(Environment& environment,
                                          const ScannerDeleteArguments& arguments) {
  v1::DeleteScannerRequest request;
  request.set_name(client::ScannerName(arguments.session, arguments.id));
  const auto deleted = environment.client().Call(request);
  if (!deleted.ok()) return deleted.status();
  if (arguments.json) {
    std::fputs(ToJson(*deleted).c_str(), stdout);
    return ExitCode::kOk;
  }
  std::printf("%s has left; its scans stay\n", client::IdOf(request.name()).c_str());
  return ExitCode::kOk;
}

struct ScannerListArguments {
  std::string session;
  bool json = false;
};

absl::StatusOr<ExitCode> RunScannerList(Environment& environment,
                                        const ScannerListArguments& arguments) {
  v1::ListScannersRequest request;
  request.set_parent(client::SessionName(arguments.session));
  v1::ListScannersResponse all;
  const absl::Status listed =
      environment.client().CallForPages(request, [&](const v1::ListScannersResponse& page) {
        all.mutable_scanners()->MergeFrom(page.scanners());
      });
  if (!listed.ok()) return listed;
  if (arguments.json) {
    std::fputs(ToJson(all).c_str(), stdout);
    return ExitCode::kOk;
  }
  if (all.scanners().empty()) {
    std::puts("no scanners; 'vantage scanner add' adds one");
    return ExitCode::kOk;
  }
  Table table({"scanner", "model", "operator", "stood at, m", ">m/s", ">s a scan", "reach"});
  for (const v1::Scanner& scanner : all.scanners()) {
    table.Add(
        {client::IdOf(scanner.name()), scanner.scanner_model_id(), scanner.operator_(),
         scanner.has_last_pose() ? Text(scanner.last_pose().translation()) : "",
         absl::StrFormat("%.1f", scanner.speed_m_per_s()),
         absl::StrFormat("%.0f", client::SecondsOf(scanner.scan_duration())),
         scanner.reach().empty() ? "everywhere" : absl::StrCat(scanner.reach_size(), " boxes")});
  }
  std::fputs(table.ToString().c_str(), stdout);
  return ExitCode::kOk;
}

struct ScannerPresetsArguments {
  bool json = false;
};

Json PresetsAsJson() {
  Json all = Json::array();
  for (const sensor::Preset& preset : sensor::Presets()) {
    Json one = {{"preset", preset.name},
                {"title", preset.title},
                {"minElevationRad", preset.model.elevation_min},
                {"maxElevationRad", preset.model.elevation_max},
                {"minRangeM", preset.model.range_min},
                {"maxRangeM", preset.model.range_max},
                {"rangeSigmaAt10M", preset.model.RangeSigma(10)},
                {"source", preset.source},
                {"usualSetting", preset.settings[preset.usual].name},
                {"settings", Json::array()}};
    for (const sensor::ScanSetting& setting : preset.settings) {
      one["settings"].push_back(
          {{"name", setting.name}, {"stepRad", setting.step}, {"minutes", setting.minutes}});
    }
    all.push_back(std::move(one));
  }
  return {{"presets", std::move(all)}};
}

absl::StatusOr<ExitCode> RunScannerPresets(Environment&, const ScannerPresetsArguments& arguments) {
  if (arguments.json) {
    PrintJson(PresetsAsJson());
    return ExitCode::kOk;
  }
  Table table({"preset", "instrument", "settings (spacing at 10 m, minutes)", ">elevation",
               ">range, m", ">noise at 10 m", "document"});
  for (const sensor::Preset& preset : sensor::Presets()) {
    std::vector<std::string> settings;
    for (const sensor::ScanSetting& setting : preset.settings) {
      settings.push_back(
          absl::StrFormat("%s%s (%.1f mm, %.1f)", setting.name,
                          setting.name == preset.settings[preset.usual].name ? "*" : "",
                          1e4 * setting.step, setting.minutes));
    }
    table.Add({preset.name, preset.title, absl::StrJoin(settings, ", "),
               absl::StrFormat("%.0f..%.0f", sensor::Degrees(preset.model.elevation_min),
                               sensor::Degrees(preset.model.elevation_max)),
               absl::StrFormat("%.1f..%.0f", preset.model.range_min, preset.model.range_max),
               Length(preset.model.RangeSigma(10)), preset.source});
  }
  std::fputs(table.ToString().c_str(), stdout);
  std::puts("*: where no setting is named");
  std::puts(
      "No figure has been compared with its document yet: check what matters, and state it with "
      "--set scanner.FIELD=VALUE.");
  return ExitCode::kOk;
}

void AddDescription(CLI::App& command, ScannerArguments& a) {
  command.add_option("--model", a.model, "Id of the scanner model [the session's first]");
  command.add_option("--operator", a.operator_name, "Who works with it");
  command.add_option("--speed", a.speed, "Walking speed, m/s [1]");
  command.add_option("--seconds", a.scan_seconds, "To set up and scan, s [180]");
  command
      .add_option("--reach", a.reach,
                  "x0,y0,z0,x1,y1,z1, m, world, repeatable: where it can go [everywhere]")
      ->delimiter(',')
      ->expected(6)
      ->allow_extra_args(false);
  command.add_flag("--json", a.json, "Print the scanner as JSON");
}

}  // namespace

void AddScannerPresets(CLI::App& parent, Environment& environment) {
  AddCommand<ScannerPresetsArguments>(
      parent, environment, "presets", "List the instruments whose figures are known",
      "  vantage scanner presets\n  vantage session create flat --preset leica-rtc360",
      [](CLI::App& command, ScannerPresetsArguments& a) {
        command.add_flag("--json", a.json, "Print them as JSON");
      },
      RunScannerPresets);
}

void AddScannerAdd(CLI::App& parent, Environment& environment) {
  AddCommand<ScannerArguments>(
      parent, environment, "add", "A scanner joins a job",
      "  vantage scanner add flat red --operator Ada\n"
      "  vantage scanner add flat blue --model handheld --speed 0.5 --seconds 60\n"
      "  vantage scanner add flat cellar --reach 0,0,-3,12,9,0",
      [](CLI::App& command, ScannerArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        command.add_option("SCANNER", a.id, "Its id [chosen by the server]");
        AddDescription(command, a);
      },
      RunScannerAdd);
}

void AddScannerUpdate(CLI::App& parent, Environment& environment) {
  AddCommand<ScannerArguments>(
      parent, environment, "update", "Change what is known of a scanner; the rest stays",
      "  vantage scanner update flat red --operator Bob --seconds 90",
      [](CLI::App& command, ScannerArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        command.add_option("SCANNER", a.id, "The scanner")->required();
        AddDescription(command, a);
      },
      RunScannerUpdate);
}

void AddScannerDelete(CLI::App& parent, Environment& environment) {
  AddCommand<ScannerDeleteArguments>(
      parent, environment, "delete", "A scanner leaves a job; its scans stay",
      "  vantage scanner delete flat red",
      [](CLI::App& command, ScannerDeleteArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        command.add_option("SCANNER", a.id, "The scanner")->required();
        command.add_flag("--json", a.json, "Print the answer as JSON");
      },
      RunScannerDelete);
}

void AddScannerList(CLI::App& parent, Environment& environment) {
  AddCommand<ScannerListArguments>(
      parent, environment, "list", "List a job's scanners, oldest first",
      "  vantage scanner list flat\n  vantage scanner list flat --json",
      [](CLI::App& command, ScannerListArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        command.add_flag("--json", a.json, "Print them as JSON");
      },
      RunScannerList);
}

}  // namespace vantage::cli

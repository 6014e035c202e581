#include "client/cli/session_settings.h"

#include <set>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "client/cli/file.h"
#include "client/cli/json.h"
#include "client/cli/reading_progress.h"
#include "client/library/geometry.h"
#include "core/sensor/confined_scan_file.h"
#include "core/sensor/imported_scan.h"

namespace vantage::cli {
namespace {

constexpr char kScannerPrefix[] = "scanner.";

// 'scanner.max_range_m' is the first scanner model's.
absl::Status SetOne(const std::string& path, const std::string& value, v1::Session& session,
                    std::set<std::string>& paths) {
  if (!absl::StartsWith(path, kScannerPrefix)) {
    paths.insert(path);
    return SetField(session, path, value);
  }
  paths.insert("scanner_models");
  if (session.scanner_models().empty()) session.add_scanner_models();
  return SetField(*session.mutable_scanner_models(0),
                  std::string(absl::StripPrefix(path, kScannerPrefix)), value);
}

}  // namespace

void AddSettings(CLI::App& command, SessionSettings& s) {
  command.add_option("--name", s.name, "Name for people");
  command.add_option("--density", s.density, "Required sampling density, samples / m^2 [2500]");
  command.add_option("--accuracy", s.accuracy, "Required registration accuracy, m at 95 % [0.010]");
  command.add_option("--voxel", s.voxel, "Voxel size, m [0.05]; fixed at creation");
  command.add_option("--scanner-from", s.scanner_from,
                     "Take the scanner's angles and steps from a scan file (E57, PTX, PCD)");
  AddFileFlags(command, s.file);
  command.add_option("--preset", s.preset,
                     "Take the figures of an instrument, such as leica-rtc360; 'vantage scanner "
                     "presets' lists them");
  command.add_option("--setting", s.setting, "Of the preset [its usual one]");
  command.add_option("--config", s.config, "File with a Session in Protobuf's JSON form");
  command
      .add_option("--set", s.set,
                  "PATH=VALUE, repeatable: any field of the session, such as "
                  "planning_config.max_viewpoint_height_m=2.5, or of its first scanner, such as "
                  "scanner.max_range_m=30")
      ->allow_extra_args(false);
}

absl::StatusOr<std::vector<std::string>> ApplySettings(const SessionSettings& settings,
                                                       v1::Session& session) {
  std::set<std::string> paths;
  if (!settings.config.empty()) {
    const auto text = ReadFile(settings.config);
    if (!text.ok()) return text.status();
    v1::Session given;
    if (absl::Status s = FromJson(*text, settings.config, given); !s.ok()) return s;
    std::vector<const google::protobuf::FieldDescriptor*> fields;
    given.GetReflection()->ListFields(given, &fields);
    for (const auto* field : fields) paths.insert(field->name());
    // Lists replace those that the session has.
    if (given.scanner_models_size() > 0) session.clear_scanner_models();
    const v1::SiteRules& rules = given.site_rules();
    if (rules.keep_out_size() > 0) session.mutable_site_rules()->clear_keep_out();
    if (rules.regions_size() > 0) session.mutable_site_rules()->clear_regions();
    if (rules.storeys_size() > 0) session.mutable_site_rules()->clear_storeys();
    session.MergeFrom(given);
  }
  if (!settings.scanner_from.empty()) {
    const ReadingProgress reading(settings.scanner_from);
    auto file = sensor::ConfinedScanFile::Open(settings.scanner_from, StationOf(settings.file),
                                               settings.file.reader, reading.Watch());
    if (!file.ok()) return file.status();
    const auto scan = file->Read(0, LimitsOf(settings.file));  // one instrument, in all of a file
    reading.Clear();
    if (!scan.ok()) return scan.status();
    session.clear_scanner_models();
    *session.add_scanner_models() = client::ToProto(scan->scanner, "from-file");
    paths.insert("scanner_models");
  }
  if (!settings.setting.empty() && settings.preset.empty()) {
    return absl::InvalidArgumentError("--setting is of a --preset, which is not given");
  }
  if (!settings.preset.empty()) {
    session.clear_scanner_models();
    v1::ScannerModel& model = *session.add_scanner_models();
    model.set_preset(settings.preset);
    model.set_setting(settings.setting);
    paths.insert("scanner_models");
  }
  const auto set = [&](const char* path, const auto& value) {
    if (!value) return absl::OkStatus();
    return SetOne(path, absl::StrCat(*value), session, paths);
  };
  for (const absl::Status& status :
       {set("display_name", settings.name), set("model_config.voxel_size_m", settings.voxel),
        set("planning_config.required_density_per_m2", settings.density),
        set("planning_config.registration.required_accuracy_m", settings.accuracy)}) {
    if (!status.ok()) return status;
  }
  for (const std::string& assignment : settings.set) {
    const auto parsed = ParseAssignment(assignment);
    if (!parsed.ok()) return parsed.status();
    const absl::Status status = SetOne(parsed->first, parsed->second, session, paths);
    if (!status.ok()) return status;
  }
  return std::vector<std::string>(paths.begin(), paths.end());
}

}  // namespace vantage::cli

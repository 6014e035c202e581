#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/command.h"
#include "client/cli/file_flags.h"
#include "client/cli/json.h"
#include "client/cli/reading_progress.h"
#include "client/cli/table.h"
#include "core/sensor/confined_scan_file.h"
#include "core/sensor/imported_scan.h"
#include "core/sensor/oddities.h"
#include "core/sensor/scanner_model.h"

namespace vantage::cli {
namespace {

struct FileArguments {
  std::string file;
  FileFlags flags;
  bool json = false;
};

// The least and the most of what was measured, m; 0 without a return.
std::pair<float, float> Ranges(const sensor::RangeImage& image) {
  float least = 0;
  float most = 0;
  for (const float range : image.range) {
    if (!sensor::RangeImage::IsRange(range)) continue;
    least = least == 0 ? range : std::min(least, range);
    most = std::max(most, range);
  }
  return {least, most};
}

// Of the scanner's axis from the vertical, as the file has it.
std::string Tilt(const sensor::ImportedScan& scan) {
  if (!scan.T_world_scan) return "";
  const double up = std::clamp(scan.T_world_scan->linear()(2, 2), -1.0, 1.0);
  return absl::StrFormat("%.2f", sensor::Degrees(std::acos(up)));
}

std::string Place(const sensor::ImportedScan& scan) {
  if (!scan.T_world_scan) return "none";
  const Eigen::Vector3d at = scan.T_world_scan->translation();
  return absl::StrFormat("%.3f, %.3f, %.3f", at.x(), at.y(), at.z());
}

// What `scan push --with` brings along.
std::string Besides(const sensor::AppearanceKinds& appearance) {
  return absl::StrCat(appearance.intensity ? "intensity" : "",
                      appearance.intensity && appearance.colour ? ", " : "",
                      appearance.colour ? "colour" : "");
}

Json SetupAsJson(size_t number, const std::string& name, const sensor::ImportedScan& scan) {
  const sensor::RangeImage& image = scan.image;
  const auto [least, most] = Ranges(image);
  Json setup = {{"setup", number},
                {"name", name},
                {"columnCount", image.columns()},
                {"rowCount", image.rows()},
                {"resampled", scan.resampled},
                {"azimuthStepRad", image.native_azimuth_step},
                {"elevationStepRad", image.native_elevation_step},
                {"sampleCount", image.SampleCount()},
                {"minRangeM", least},
                {"maxRangeM", most},
                {"intensity", scan.appearance.intensity},
                {"colour", scan.appearance.colour},
                {"oddities", sensor::Oddities(scan)}};
  if (scan.T_world_scan) {
    Json rows = Json::array();
    for (int row = 0; row < 4; ++row) {
      for (int column = 0; column < 4; ++column) {
        rows.push_back(scan.T_world_scan->matrix()(row, column));
      }
    }
    setup["worldFromScan"] = std::move(rows);
  }
  return setup;
}

absl::StatusOr<ExitCode> RunFile(Environment&, const FileArguments& arguments) {
  const ReadingProgress reading(arguments.file);
  auto file = sensor::ConfinedScanFile::Open(arguments.file, StationOf(arguments.flags),
                                             arguments.flags.reader, reading.Watch());
  if (!file.ok()) return file.status();
  Table table({">set-up", "name", "grid", ">step (deg)", ">returns", ">range (m)", "place (m)",
               ">tilt (deg)", "besides"});
  Json setups = Json::array();
  bool all = true;
  for (size_t i = 0; i < file->setups().size(); ++i) {
    const auto scan = file->Read(i, LimitsOf(arguments.flags));
    reading.Clear();
    if (!scan.ok()) {
      // What is wrong with one says nothing of the others.
      if (file->setups().size() == 1) return scan.status();
      PrintError(scan.status());
      all = false;
      continue;
    }
    if (arguments.json) {
      setups.push_back(SetupAsJson(i + 1, file->setups()[i], *scan));
      continue;
    }
    PrintOddities(absl::StrCat("set-up ", i + 1), *scan);
    const sensor::RangeImage& image = scan->image;
    const auto [least, most] = Ranges(image);
    table.Add({absl::StrCat(i + 1), file->setups()[i],
               absl::StrFormat("%d x %d%s", image.columns(), image.rows(),
                               scan->resampled ? ", resampled" : ""),
               absl::StrFormat("%.3f x %.3f", sensor::Degrees(image.native_azimuth_step),
                               sensor::Degrees(image.native_elevation_step)),
               absl::StrFormat("%d (%.0f %%)", image.SampleCount(),
                               100.0 * static_cast<double>(image.SampleCount()) /
                                   static_cast<double>(image.cells())),
               absl::StrFormat("%.2f to %.2f", least, most), Place(*scan), Tilt(*scan),
               Besides(scan->appearance)});
  }
  if (arguments.json) {
    PrintJson({{"setups", std::move(setups)}});
  } else {
    std::fputs(table.ToString().c_str(), stdout);
  }
  return all ? ExitCode::kOk : ExitCode::kRefused;
}

}  // namespace

void AddFile(CLI::App& parent, Environment& environment) {
  AddCommand<FileArguments>(
      parent, environment, "file", "What is in a scan file, without a server",
      "  vantage file project.e57",
      [](CLI::App& command, FileArguments& a) {
        command.add_option("FILE", a.file, "An E57, PTX, PCD, VRIM, LAS, PLY or XYZ file")
            ->required();
        AddFileFlags(command, a.flags);
        command.add_flag("--json", a.json, "Print it as JSON");
      },
      RunFile);
}

}  // namespace vantage::cli

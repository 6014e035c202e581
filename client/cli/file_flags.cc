#include "client/cli/file_flags.h"

#include <cstdio>
#include <map>

#include "core/sensor/oddities.h"

namespace vantage::cli {
namespace {

// m. US survey feet differ from international ones by 2 ppm: a centimetre at 5,000 m.
const std::map<std::string, double>& Units() {
  static const std::map<std::string, double> units = {
      {"m", 1},      {"cm", 0.01}, {"mm", 0.001}, {"ft", 0.3048}, {"us-ft", 1200.0 / 3937},
      {"in", 0.0254}};
  return units;
}

}  // namespace

void AddFileFlags(CLI::App& command, FileFlags& flags) {
  command
      .add_option("--station", flags.station,
                  "Where the scanner stood: x,y,z, in the frame of a file of points that does not "
                  "say it")
      ->delimiter(',')
      ->expected(3)
      ->allow_extra_args(false);
  std::vector<std::string> names;
  for (const auto& [name, metres] : Units()) names.push_back(name);
  command.add_option("--unit", flags.unit, "Of the file's coordinates, and of --station [m]")
      ->check(CLI::IsMember(names));
  AddReaderFlags(command, flags.reader);
}

void AddReaderFlags(CLI::App& command, confinement::AllowanceSettings& reader) {
  command
      .add_option(reader.memory_option, reader.memory_mb,
                  "MB of memory that the process which reads a file may take [by the file's size]")
      ->check(CLI::Range(1.0, 1e7));
  command
      .add_option(reader.seconds_option, reader.seconds,
                  "Seconds of a processor, and twice as many in all [60, and two for each MB]")
      ->check(CLI::Range(1.0, 1e7));
}

void AddAppearanceFlag(CLI::App& command, FileFlags& flags) {
  command
      .add_option("--with", flags.with,
                  "What comes along besides ranges, for exports: intensity, colour or both; "
                  "planning uses neither")
      ->delimiter(',')
      ->check(CLI::IsMember({"intensity", "colour"}));
}

std::optional<Eigen::Vector3d> StationOf(const FileFlags& flags) {
  if (flags.station.empty()) return std::nullopt;
  return Eigen::Vector3d(flags.station[0], flags.station[1], flags.station[2]);
}

sensor::ImportLimits LimitsOf(const FileFlags& flags) {
  sensor::ImportLimits limits;
  limits.unit = Units().at(flags.unit);
  for (const std::string& kind : flags.with) {
    (kind == "colour" ? limits.appearance.colour : limits.appearance.intensity) = true;
  }
  return limits;
}

void PrintOddities(const std::string& name, const sensor::ImportedScan& scan) {
  for (const std::string& oddity : sensor::Oddities(scan)) {
    std::fprintf(stderr, "%s: %s\n", name.c_str(), oddity.c_str());
  }
}

}  // namespace vantage::cli

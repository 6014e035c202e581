// How fast scan files are read, beside reading their bytes, and what that takes of memory.
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/sensor/scan_file.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/figures.h"
#include "tests/bench/scenes.h"
#include "tests/support/e57_writer.h"

namespace vantage::bench {
namespace {

// As instruments write them: spherical, whole multiples of 0.1 mm and of a microradian.
std::string E57Of(const sensor::RangeImage& image) {
  std::vector<double> range, azimuth, elevation;
  std::vector<int64_t> row, column;
  for (int c = 0; c < image.columns(); ++c) {
    for (int r = 0; r < image.rows(); ++r) {
      if (!sensor::RangeImage::IsRange(image.at(c, r))) continue;
      range.push_back(image.at(c, r));
      azimuth.push_back(image.azimuth[static_cast<size_t>(c)]);
      elevation.push_back(image.elevation[static_cast<size_t>(r)]);
      row.push_back(r);
      column.push_back(c);
    }
  }
  const size_t records = range.size();
  test_support::E57SetupFile setup{
      absl::StrCat("<guid type=\"String\">scan</guid>",
                   test_support::E57Bounds(0, image.rows() - 1, 0, image.columns() - 1)),
      {test_support::E57Scaled("sphericalRange", 1e-4, 0, 0, 1'000'000, range),
       test_support::E57Scaled("sphericalAzimuth", 1e-6, 0, -3'200'000, 3'200'000, azimuth),
       test_support::E57Scaled("sphericalElevation", 1e-6, 0, -1'600'000, 1'600'000, elevation),
       test_support::E57Integers("rowIndex", 0, image.rows() - 1, row),
       test_support::E57Integers("columnIndex", 0, image.columns() - 1, column)},
      records,
      ""};
  test_support::E57Options options;
  options.packets = records / 4000 + 1;  // a packet has at most 64 KiB
  return test_support::WriteE57({setup}, options);
}

std::string PtxOf(const sensor::RangeImage& image) {
  std::string ptx =
      absl::StrFormat("%d\n%d\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n",
                      image.columns(), image.rows());
  for (int c = 0; c < image.columns(); ++c) {
    for (int r = 0; r < image.rows(); ++r) {
      const float range = image.at(c, r);
      const Eigen::Vector3d p = sensor::RangeImage::IsRange(range)
                                    ? Eigen::Vector3d(range * image.Direction(c, r))
                                    : Eigen::Vector3d(0, 0, 0);
      absl::StrAppendFormat(&ptx, "%.6f %.6f %.6f 0.5\n", p.x(), p.y(), p.z());
    }
  }
  return ptx;
}

double Seconds(const std::chrono::steady_clock::time_point& start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double SecondsToReadBytes(const std::string& path) {
  std::vector<char> piece(4 << 20);
  const auto start = std::chrono::steady_clock::now();
  std::ifstream file(path, std::ios::binary);
  while (file.read(piece.data(), static_cast<std::streamsize>(piece.size())) || file.gcount() > 0) {
  }
  return Seconds(start);
}

// In a process of its own, so that nothing that came before counts.
double MegabytesToRead(const std::string& path) {
  const pid_t child = fork();
  if (child == 0) {
    const auto file = sensor::ScanFile::Open(path);
    _exit(file.ok() && file->Read(0, {}).ok() ? 0 : 1);
  }
  int status = 0;
  rusage usage{};
  wait4(child, &status, 0, &usage);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0
             ? static_cast<double>(usage.ru_maxrss) * 1024 / 1e6
             : -1;
}

}  // namespace

void BenchImport(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("import.")) return;
  sensor::ScannerModel scanner;
  scanner.azimuth_step = scanner.elevation_step = sensor::Radians(options.full ? 0.034 : 0.1);
  scanner.range_max = 60;
  const simulation::Scene flat = simulation::FurnishedFlat(SceneSeeds(options.use).front());
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translate(flat.starts[0]);
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / absl::StrFormat("vantage-import-%d", getpid());
  std::filesystem::create_directories(folder);
  double cells = 0;
  std::vector<std::string> paths;
  {
    const sensor::RangeImage image = simulation::SimulatedScanner(flat.mesh).Scan(
        scanner, pose, simulation::ScanFaults{}, 1, parallel);
    cells = static_cast<double>(image.cells());
    for (const char* format : {"e57", "ptx"}) {
      paths.push_back((folder / absl::StrCat("scan.", format)).string());
      std::ofstream(paths.back(), std::ios::binary)
          << (format == std::string("e57") ? E57Of(image) : PtxOf(image));
    }
  }
  for (const std::string& path : paths) {
    const std::string format = std::filesystem::path(path).extension().string().substr(1);
    const double bytes = SecondsToReadBytes(path);
    const auto start = std::chrono::steady_clock::now();
    const auto file = sensor::ScanFile::Open(path);
    const bool read = file.ok() && file->Read(0, {}).ok();
    const double seconds = read ? Seconds(start) : 1e9;
    figures.Add(
        {absl::StrCat("import.", format, ".rate"), cells / seconds / 1e6, "M/s", "",
         absl::StrFormat("samples a second on one core: %.1f M in %.2f s, its %.0f MB "
                         "alone in %.2f s from the page cache",
                         cells / 1e6, seconds,
                         static_cast<double>(std::filesystem::file_size(path)) / 1e6, bytes)});
    figures.Add({absl::StrCat("import.", format, ".mb"), MegabytesToRead(path), "MB", "",
                 absl::StrFormat("at most, to read %.1f M cells", cells / 1e6)});
  }
  std::filesystem::remove_all(folder);
}

}  // namespace vantage::bench

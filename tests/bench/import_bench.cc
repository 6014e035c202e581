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
#include "tests/support/scan_files.h"

namespace vantage::bench {
namespace {

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
          << (format == std::string("e57") ? test_support::E57Of(image)
                                           : test_support::PtxOf(image));
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

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "absl/strings/str_format.h"
#include "core/parallel/thread_pool.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/faults/fault_figures.h"
#include "tests/integration/process.h"
#include "tests/support/scan_files.h"

namespace vantage::faults {
namespace {

constexpr uint64_t kFlat = 203;  // of those that no default was chosen on

// In a process of its own: what a command takes of memory counts from that of the process that
// starts it.
bool WriteFiles(const std::string& e57, const std::string& ptx) {
  const pid_t child = fork();
  if (child == 0) {
    parallel::ThreadPool threads(2);
    sensor::ScannerModel scanner;
    scanner.azimuth_step = scanner.elevation_step = sensor::Radians(0.0345);
    scanner.range_max = 60;
    const simulation::Scene flat = simulation::FurnishedFlat(kFlat);
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(flat.starts[0]);
    const sensor::RangeImage image = simulation::SimulatedScanner(flat.mesh).Scan(
        scanner, pose, simulation::ScanFaults{}, 1, threads);
    std::ofstream(e57, std::ios::binary) << test_support::E57Of(image);
    std::ofstream(ptx, std::ios::binary) << test_support::PtxOf(image);
    std::ofstream(e57 + ".cells") << image.cells();
    std::_Exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

// Seconds from the file to the merged scan, and on to a plan; negative where one fails.
struct Way {
  double merged = -1;
  double planned = -1;
  double client_megabytes = 0;
};

Way Go(const integration::ServerProcess& server, const std::string& job, const std::string& file) {
  Way way;
  integration::Finished finished = integration::Vantage(server, {"session", "create", job});
  const auto run = [&](const std::vector<std::string>& command) {
    const double seconds =
        bench::WallSeconds([&] { finished = integration::Vantage(server, command); });
    way.client_megabytes = std::max(way.client_megabytes, finished.peak_megabytes);
    if (finished.exit_code == 0) return seconds;
    std::cerr << "scan: " << finished.error << "\n";
    return -1.0;
  };
  if (finished.exit_code != 0) return way;
  way.merged = run({"scan", "push", job, file});
  if (way.merged > 0) way.planned = run({"plan", job, "--budget", "1"});
  return way;
}

}  // namespace

bool MeasureLargeScan(bench::Figures& figures) {
  const integration::ScratchFolder scratch;
  const std::string e57 = scratch.File("scan.e57");
  const std::string ptx = scratch.File("scan.ptx");
  std::cerr << "scan: writing the files\n";
  if (!WriteFiles(e57, ptx)) return false;
  double cells = 0;
  std::ifstream(e57 + ".cells") >> cells;
  for (const std::string& file : {e57, ptx}) {
    const bool is_ptx = file == ptx;
    const integration::ServerProcess server;
    const Way way = Go(server, "job", file);
    if (way.planned < 0) return false;
    figures.Add(
        {is_ptx ? "scan.40m.ptx_seconds" : "scan.40m.seconds", way.merged + way.planned, "s",
         is_ptx ? "" : "12",
         absl::StrFormat("the command line, %.1f M cells of %.0f MB with 3 mm of noise: %.1f s to "
                         "merged, %.1f s to a plan; the server held %.0f MB at most",
                         1e-6 * cells, 1e-6 * static_cast<double>(std::filesystem::file_size(file)),
                         way.merged, way.planned, server.PeakMegabytes())});
    if (is_ptx) continue;
    figures.Add({"scan.40m.client_mb", way.client_megabytes, "MB", "500",
                 "that the command line held at most"});
  }
  return true;
}

}  // namespace vantage::faults

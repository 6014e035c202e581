// vantage_bench [--only PREFIX] [--out FILE] [--full] [--pictures FOLDER]
//
// Prints a table of figures and writes them as JSON. The exit status says whether it ran, not
// whether aims are met.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <functional>
#include <iostream>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "absl/strings/str_format.h"
#include "core/parallel/thread_pool.h"
#include "tests/bench/benchmarks.h"

int main(int argc, char** argv) {
  CLI::App app("Benchmarks of Vantage, as ratios against references in the same run");
  std::string only;
  std::string out = "bench.json";
  bool full = false;
  app.add_option("--only", only, "only figures whose names start so");
  app.add_option("--out", out, "where to write the JSON")->capture_default_str();
  app.add_flag("--full", full, "all figures, however long they take");
  std::string pictures;
  app.add_option("--pictures", pictures, "folder for the anytime curves; they take minutes each");
  CLI11_PARSE(app, argc, argv);
  // Before the minutes are spent whose results go there.
  for (const std::filesystem::path& folder :
       {std::filesystem::path(out).parent_path(), std::filesystem::path(pictures)}) {
    std::error_code failed;
    if (!folder.empty()) std::filesystem::create_directories(folder, failed);
    if (failed) {
      std::cerr << "cannot make the folder " << folder << ": " << failed.message() << "\n";
      return 1;
    }
  }

  const int threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  vantage::parallel::ThreadPool pool(threads);
  vantage::bench::Figures figures(only);
  // A loop of plain arithmetic: how fast this machine was during this run.
  if (figures.Wants("machine.")) {
    std::vector<double> loops;
    loops.reserve(3);
    for (int run = 0; run < 3; ++run) loops.push_back(vantage::bench::MachineLoopSeconds());
    const double loop = vantage::bench::Percentile(loops, 0.5);
    figures.Add({"machine.loop.seconds", loop, "s", "", "1e8 dependent multiply-adds, one thread"});
  }
  // How long each group took, as they end: the whole is to stay within half an hour.
  double whole = 0;
  const auto timed = [&](const char* group, const std::function<void()>& bench) {
    const double seconds = vantage::bench::WallSeconds(bench);
    whole += seconds;
    if (seconds >= 1) std::cerr << absl::StrFormat("[%5.0f s] %s: %.0f s\n", whole, group, seconds);
  };
  timed("carve", [&] { vantage::bench::BenchCarve(pool, figures); });
  timed("site", [&] { vantage::bench::BenchSite(full, pool, figures); });
  timed("model", [&] { vantage::bench::BenchModel(full, pool, figures); });
  timed("snapshot", [&] { vantage::bench::BenchSnapshot(pool, figures); });
  timed("planning", [&] { vantage::bench::BenchPlanning(full, pool, figures); });
  timed("evaluator", [&] { vantage::bench::BenchEvaluator(full, pool, figures); });
  timed("anytime", [&] { vantage::bench::BenchAnytime({full, pictures}, pool, figures); });
  timed("registration", [&] { vantage::bench::BenchRegistration(full, pool, figures); });
  timed("cycle", [&] { vantage::bench::BenchCycle(pool, figures); });
  timed("fleet", [&] { vantage::bench::BenchFleet({full, pictures}, pool, figures); });
  if (!figures.WriteJson(out)) {
    std::cerr << "cannot write " << out << ": name a file in a folder that can be written\n";
    return 1;
  }
  std::cout << "written to " << out << "\n";
  return 0;
}

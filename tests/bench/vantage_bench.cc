// vantage_bench [--only PREFIX] [--out FILE] [--full] [--tuning] [--pictures FOLDER] [--list]
//
// Prints a table of figures and writes them as JSON. The exit status says whether it ran, not
// whether aims are met.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>
#include <iostream>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "absl/strings/str_format.h"
#include "core/confinement/reader.h"
#include "core/parallel/thread_pool.h"
#include "core/simulation/confined_mesh.h"
#include "core/simulation/scenes/scene_use.h"
#include "tests/bench/benchmarks.h"

namespace vantage::bench {
namespace {

// What runs together, in this order.
struct Group {
  const char* name;
  const char* figures;  // beginnings of names, as --only takes them
  const char* what;
  double minutes;  // about, on two cores
  Benchmark* run;
};
constexpr auto kGroups = std::to_array<Group>({
    {"carve", "carve.", "carving one scan, beside OctoMap", 1, BenchCarve},
    {"site", "site.",
     "views in the air, places without one; jobs under the open sky; --full: 1,000 scenes, 12 jobs",
     4, BenchSite},
    {"phantom", "phantom.", "rooms that are only in mirrors, and openings lost for mirrors", 3,
     BenchPhantom},
    {"model", "merge. model.", "merging the tenth scan; memory; --full: 1,000 m2", 1, BenchModel},
    {"remerge", "loop.remerge.", "100 scans merged anew at adjusted poses", 1, BenchRemerge},
    {"hall", "model.hall100. plan.hall100.", "a hall of 100 x 60 x 15 m: memory, time of a plan", 3,
     BenchHall},
    {"memory", "memory.account.",
     "what scans and plans are estimated to take, from a room to a hall of 24 M cells", 2,
     BenchMemory},
    {"snapshot", "snapshot.", "loading a model, beside building it", 0.5, BenchSnapshot},
    {"planning", "plan.embree. plan.brute. plan.budget. plan.cancel. plan.2000m2.",
     "rays per second; whether budgets are kept; --full: 1,000 and 2,000 m2", 2, BenchPlanning},
    {"answers", "plan.answered plan.first_view.",
     "whether plans of 0.25 to 1 s have a view, idle and beside six busy loops", 4, BenchAnswers},
    {"evaluator", "plan.exact.",
     "exact scores of all views, beside brute force; --full: 500 to 2,000 m2", 3, BenchEvaluator},
    {"heading", "heading.", "plans for a scanner that sees a sector, beside all around", 3,
     BenchHeading},
    {"preview", "preview.",
     "plans from previews, beside those from whole scans; --full: in three times the scenes", 3,
     BenchPreview},
    {"import", "import.",
     "reading E57 and PTX, beside their bytes from the page cache; --full: 44 million cells", 1,
     BenchImport},
    {"scans", "scan. scans200.", "memory that dense scans keep; --full: two hundred scans", 1,
     BenchLargeScans},
    {"anytime",
     "plan.anytime.speedup. plan.anytime.worst_regret. plan.anytime.cpu_seconds. "
     "plan.anytime.dominates. plan.anytime.curve. plan.threads2.",
     "answers at a budget, beside brute force and a rival, each for flat1, flat3, rooms1, "
     "bookstore, 250m2; --full: hall3, 1000m2; curves with --pictures",
     10, BenchAnytime},
    {"registration", "align. predict.", "alignment, beside PCL's ICP; predictions; global search",
     2, BenchRegistration},
    {"verdict", "verdict.",
     "scans where a site repeats itself, from priors of 5 cm to 2 m; --full: in five times the "
     "scenes",
     2, BenchVerdict},
    {"change", "change.", "good scans after something was moved; --full: in five times the scenes",
     2, BenchChange},
    {"promises", "predict.kept. predict.missed.",
     "views promised to register, and whether their scans do; --full: in four times the scenes", 4,
     BenchPrediction},
    {"advice", "advice.",
     "views that were refused, and whether their scans register with the targets that are advised; "
     "--full: in four times the scenes",
     3, BenchAdvice},
    {"loop", "loop.",
     "chains of scans that close, adjusted together; --full: five sites of each kind", 5,
     BenchLoop},
    {"overlap", "predict.overlap.",
     "the overlap of scans over what was predicted; --full: in three times the scenes", 2,
     BenchOverlap},
    {"prepare", "prepare.", "steps A to C after the tenth scan, beside from nothing", 2,
     BenchPrepare},
    {"cycle", "cycle.", "from a scan to checked views", 1, BenchCycle},
#ifdef VANTAGE_BENCH_COVER
    {"cover", "tour.stations.",
     "stations where the mesh is known, beside the integer optimum; small_house, if it is there", 5,
     BenchCover},
#endif
    {"fleet", "fleet.greedy_ratio fleet.joint4. fleet.job fleet.speedup4 fleet.waste_ratio",
     "several scanners on one job; --full: 1,000 m2, an hour and more", 8, BenchFleet},
    {"tour", "tour.",
     "tours of 1,000 m2 of which the shape is known, beside greedy stations in their order, the "
     "best stations by the scene's own rays; --full: a job that knew nothing",
     10, BenchTour},
});

void PrintGroups() {
  double minutes = 0;
  for (const Group& group : kGroups) {
    absl::PrintF("%-13s %4.1f min  %s\n%25s%s\n", group.name, group.minutes, group.what, "",
                 group.figures);
    minutes += group.minutes;
  }
  absl::PrintF("%-13s %4.0f min  on two cores, without --full\n", "all", minutes);
}

// A loop of plain arithmetic: how fast this machine was during this run.
void BenchMachine(Figures& figures) {
  if (!figures.Wants("machine.")) return;
  std::vector<double> loops;
  loops.reserve(3);
  for (int run = 0; run < 3; ++run) loops.push_back(MachineLoopSeconds());
  figures.Add({"machine.loop.seconds", Percentile(loops, 0.5), "s", "",
               "1e8 dependent multiply-adds, one thread"});
}

int Run(const BenchOptions& options, const std::string& only, const std::string& out) {
  // The file is opened first, so that an error shows before minutes are spent.
  for (const std::filesystem::path& folder :
       {std::filesystem::path(out).parent_path(), std::filesystem::path(options.pictures)}) {
    std::error_code failed;
    if (!folder.empty()) std::filesystem::create_directories(folder, failed);
    if (failed) {
      std::cerr << "cannot make the folder " << folder << ": " << failed.message() << "\n";
      return 1;
    }
  }
  const int threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  parallel::ThreadPool pool(threads);
  Figures figures(only);
  BenchMachine(figures);
  // How long each group took, as they end: the whole is to stay within half an hour.
  double whole = 0;
  for (const Group& group : kGroups) {
    const double seconds = WallSeconds([&] { group.run(options, pool, figures); });
    whole += seconds;
    if (seconds < 1) continue;
    std::cerr << absl::StrFormat("[%5.0f s] %s: %.0f s\n", whole, group.name, seconds);
  }
  const bool tuning = options.use == simulation::SceneUse::kTuning;
  if (!figures.WriteJson(out, tuning ? "tuning" : "reporting")) {
    std::cerr << "cannot write " << out << ": name a file in a folder that can be written\n";
    return 1;
  }
  std::cout << "written to " << out << "\n";
  return 0;
}

}  // namespace
}  // namespace vantage::bench

int main(int argc, char** argv) {
  vantage::confinement::RunIfReader(argc, argv, {vantage::simulation::MeshReader()});
  CLI::App app(
      "Benchmarks of Vantage, as ratios against references in the same run. 20 to 30 minutes on "
      "two "
      "cores, some hours with --full; --list says what takes how long.");
  std::string only;
  std::string out = "bench.json";
  bool tuning = false;
  bool list = false;
  vantage::bench::BenchOptions options;
  app.add_option("--only", only, "only figures whose names start so");
  app.add_option("--out", out, "where to write the JSON")->capture_default_str();
  app.add_flag("--full", options.full, "all figures, however long they take");
  app.add_flag("--tuning", tuning,
               "on the scenes for tuning instead of those that report: whatever is chosen by a "
               "figure is chosen by these");
  app.add_option("--pictures", options.pictures,
                 "folder for the anytime curves, which take minutes each, and the tours");
  app.add_flag("--list", list, "groups of figures and what they take, and nothing else");
  CLI11_PARSE(app, argc, argv);
  if (list) {
    vantage::bench::PrintGroups();
    return 0;
  }
  if (tuning) options.use = vantage::simulation::SceneUse::kTuning;
  return vantage::bench::Run(options, only, out);
}

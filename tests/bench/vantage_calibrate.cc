// vantage_calibrate [--small] [--tuning] [--family NAME] [--out FOLDER] [--seconds S]
//                   [--shared MM] [--correlation M] [--scale K] [--prior-lie F] [--learn]
//
// Registration against the truth: predicted and achieved error of simulated pairs in generated
// scenes, and of the real pairs. Goes on where it was stopped: scenes that are in FOLDER's table
// are not done again (delete the table after the algorithm has changed). The exit status says
// whether it ran, not whether aims are met.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/parallel/thread_pool.h"
#include "tests/bench/calibration_pair.h"
#include "tests/bench/calibration_real.h"
#include "tests/bench/calibration_report.h"
#include "tests/bench/calibration_scene.h"
#include "tests/bench/figures.h"

namespace vantage::bench {
namespace {

// Scenes for tuning and for reporting have nothing in common.
constexpr uint64_t kTuningSeed = 1'000'000;
constexpr uint64_t kReportingSeed = 2'000'000;

struct SceneJob {
  size_t family = 0;
  int scene = 0;
};

// A scene that yields nothing is entered too, so that it is not tried again.
std::string DoneLine(const SceneFamily& family, int scene) {
  return absl::StrCat("# ", family.name, " ", scene);
}

struct StudyOptions {
  std::string folder = "build/calibration";
  uint64_t base_seed = kReportingSeed;
  std::string family;  // empty: all
  int scenes = 0;
  int pairs = 10;   // in each
  int priors = 20;  // of each real pair
  int threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  double seconds = 1e9;
  CalibrationSettings settings;
};

}  // namespace

int Calibrate(const StudyOptions& options) {
  const auto started = std::chrono::steady_clock::now();
  const CalibrationSettings& settings = options.settings;
  const registration::RegistrationConfig config;
  const auto families = CalibrationFamilies();
  const std::string& folder = options.folder;
  std::filesystem::create_directories(folder);
  const std::string table = folder + "/pairs.csv";
  std::vector<CalibrationPair> pairs;
  std::set<std::string> done;
  {
    std::ifstream in(table);
    for (std::string line; std::getline(in, line);) {
      if (line.starts_with("#")) done.insert(line);
      if (auto pair = FromLine(line); pair.has_value()) pairs.push_back(*std::move(pair));
    }
  }
  std::vector<SceneJob> jobs;
  for (int scene = 0; scene < options.scenes; ++scene) {
    for (size_t family = 0; family < families.size(); ++family) {
      if (!options.family.empty() && options.family != families[family].name) continue;
      if (!done.contains(DoneLine(families[family], scene))) jobs.push_back({family, scene});
    }
  }
  absl::PrintF("seed %d, %d scenes in each of %d families, %d pairs each; %d scenes are done\n",
               options.base_seed, options.scenes, families.size(), options.pairs, done.size());
  parallel::ThreadPool pool(std::max(1, options.threads));
  const auto width = static_cast<size_t>(pool.width());
  std::ofstream out(table, std::ios::app);
  if (pairs.empty()) out << CalibrationHeader() << "\n";
  bool finished = true;
  for (size_t begin = 0; begin < jobs.size(); begin += width) {
    if (std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count() >
        options.seconds) {
      absl::PrintF("stopped after %d of %d scenes; run it again to go on\n", begin, jobs.size());
      finished = false;
      break;
    }
    const size_t count = std::min(width, jobs.size() - begin);
    std::vector<std::vector<CalibrationPair>> made(count);
    pool.For(count, [&](size_t k) {
      const SceneJob& job = jobs[begin + k];
      const uint64_t seed = options.base_seed + static_cast<uint64_t>(job.scene) * 100 + job.family;
      made[k] =
          MeasureScene(families[job.family], job.scene, seed, options.pairs, settings, config);
    });
    for (size_t k = 0; k < count; ++k) {
      for (CalibrationPair& pair : made[k]) {
        out << ToLine(pair) << "\n";
        pairs.push_back(std::move(pair));
      }
      out << DoneLine(families[jobs[begin + k].family], jobs[begin + k].scene) << "\n";
    }
    out.flush();
  }
  if (!out.good()) {
    std::cerr << "cannot write " << table << ": name a folder that can be written\n";
    return 1;
  }
  Figures figures("");
  ReportCalibration(pairs, config, figures);
  PrintFamilies(pairs, config);
  PrintInstrument(pairs);
  if (!figures.WriteJson(folder + "/figures.json") ||
      !DrawCalibration(folder + "/errors.svg", pairs, config)) {
    std::cerr << "cannot write into " << folder << "\n";
    return 1;
  }
  if (finished && options.priors > 0) {
    std::string why_not;
    const std::vector<CalibrationPair> real = MeasureRealPairs(options.priors, pool, why_not);
    if (!why_not.empty()) absl::PrintF("\nno real pairs: %s\n", why_not);
    if (!real.empty()) PrintRealPairs(real);
  }
  absl::PrintF("pairs, figures and the picture are in %s\n", folder);
  return 0;
}

}  // namespace vantage::bench

int main(int argc, char** argv) {
  CLI::App app("Registration's predictions and verdicts against the truth");
  bool small = false;
  bool tuning = false;
  vantage::bench::StudyOptions options;
  app.add_flag("--small", small, "2 scenes a family instead of 17");
  app.add_flag("--tuning", tuning, "the scenes for tuning, not those that are reported");
  app.add_option("--out", options.folder, "folder for the table, the figures and the picture")
      ->capture_default_str();
  app.add_option("--seconds", options.seconds, "start nothing more after that long");
  app.add_option("--family", options.family, "one kind of scene only");
  app.add_option("--threads", options.threads, "scenes done at a time");
  app.add_option("--scenes", options.scenes, "scenes in each family");
  app.add_option("--pairs", options.pairs, "pairs in each scene")->capture_default_str();
  app.add_option("--priors", options.priors, "of each real pair; 0: none")->capture_default_str();
  double shared_mm = 1000 * options.settings.shared_sigma;
  app.add_option("--shared", shared_mm, "errors that neighbours share, one sigma, mm")
      ->capture_default_str();
  app.add_option("--correlation", options.settings.correlation_length,
                 "over which they are shared, m; bounds assume 0.5")
      ->capture_default_str();
  app.add_option("--scale", options.settings.scale, "of scenes, distances and ranges (10 m)")
      ->capture_default_str();
  app.add_option("--prior-lie", options.settings.prior_lie,
                 "errors of priors, over what these state")
      ->capture_default_str();
  app.add_flag("--learn", options.settings.learn,
               "the scans of a scene tell the next ones of the instrument");
  CLI11_PARSE(app, argc, argv);
  options.settings.shared_sigma = shared_mm / 1000;
  if (options.scenes <= 0) options.scenes = small ? 2 : 17;
  if (tuning) options.base_seed = vantage::bench::kTuningSeed;
  return vantage::bench::Calibrate(options);
}

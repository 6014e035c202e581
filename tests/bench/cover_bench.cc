// How many stations are chosen where the mesh is known, beside the integer optimum and greed
// (algorithm.md section 12).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "client/study/best_cover.h"
#include "client/study/cover_program.h"
#include "client/study/scene_list.h"
#include "client/study/study_scene.h"
#include "client/study/visibility_table.h"
#include "core/cover/choose_stations.h"
#include "core/sensor/presets.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/cpu_budget.h"
#include "tests/bench/scenes.h"

namespace vantage::bench {
namespace {

constexpr double kCoverSeconds = 10;    // of one core
constexpr double kSolverSeconds = 120;  // for the proof
constexpr double kLattice = 0.6;        // m
constexpr size_t kSamplesForProof = 2000;
constexpr size_t kAllSamples = 20'000;

absl::StatusOr<study::VisibilityTable> TableOf(const std::string& name, size_t samples,
                                               const sensor::ScannerModel& scanner,
                                               parallel::Parallel& parallel) {
  const char* data = std::getenv("VANTAGE_SHARED_DATA");
  auto site = study::BuildScene(name, data == nullptr ? "" : data);
  if (!site.ok()) return site.status();
  study::StudySettings settings;
  settings.scanner = scanner;
  settings.truth_samples = samples;
  const auto scene = study::StudyScene::Make(*std::move(site), settings, parallel);
  if (!scene.ok()) return scene.status();
  return study::MakeVisibilityTable(**scene, kLattice, std::nullopt);
}

absl::StatusOr<cover::FewestStations> Choose(const study::VisibilityTable& table, double seconds) {
  const study::CoverSettings settings;
  return cover::ChooseFewest(study::ProblemOf(table, settings),
                             settings.goal * static_cast<double>(table.samples),
                             CpuBudget(seconds));
}

study::CoverProblem ProgramOf(const study::VisibilityTable& table) {
  const study::CoverSettings settings;
  study::CoverProblem program;
  program.sets = table.sees;
  for (const std::vector<uint32_t>& links : study::ProblemOf(table, settings).links) {
    program.neighbours.emplace_back(links.begin(), links.end());
  }
  program.goal =
      static_cast<size_t>(std::ceil(settings.goal * static_cast<double>(table.samples) - 1e-9));
  return program;
}

// Where the optimum is proven.
void BenchOptimum(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (study::FindCoverSolver().empty()) {
    std::fprintf(stderr, "no tour.stations.over_optimum: install coinor-cbc\n");
    return;
  }
  const auto preset = sensor::FindPreset("leica-rtc360");
  if (!preset.ok()) return;
  const auto setting = preset->Setting("");
  if (!setting.ok()) return;
  size_t chosen = 0;
  size_t least = 0;
  double worst = 0;
  std::vector<std::string> words;
  for (const char* kind : {"two-rooms", "hall", "flat"}) {
    for (const uint64_t seed : SceneSeeds(options.use)) {
      const std::string name = absl::StrCat(kind, "-", seed);
      const auto table = TableOf(name, kSamplesForProof, preset->At(*setting), parallel);
      if (!table.ok()) continue;
      const auto found = Choose(*table, kCoverSeconds);
      if (!found.ok() || !found->complete) continue;
      const size_t stations = found->cover.stations.size();
      std::vector<size_t> known(found->cover.stations.begin(), found->cover.stations.end());
      size_t optimum = found->least;
      if (optimum < stations) {
        const auto answer = study::SolveCover(ProgramOf(*table), kSolverSeconds, known);
        if (!answer.ok() || !answer->proven) {
          words.push_back(absl::StrFormat("%s: %d, nothing proven", name, stations));
          continue;
        }
        optimum = answer->route.size();
      }
      chosen += stations;
      least += optimum;
      worst = std::max(worst, static_cast<double>(stations) / static_cast<double>(optimum));
      words.push_back(absl::StrFormat("%s: %d of %d", name, stations, optimum));
    }
  }
  if (least == 0) {
    std::fprintf(stderr, "no tour.stations.over_optimum: nothing was proven\n");
    return;
  }
  figures.Add({"tour.stations.over_optimum",
               static_cast<double>(chosen) / static_cast<double>(least), "", "<= 1.1",
               absl::StrFormat("stations over the integer optimum, mesh known; at worst %.2f; %s",
                               worst, absl::StrJoin(words, ", "))});
}

// The house that others' searches were run in: steps of 0.25 degrees, so that density decides.
void BenchSmallHouse(parallel::Parallel& parallel, Figures& figures) {
  const auto table = TableOf("small-house", kAllSamples, sensor::ScannerModel(), parallel);
  if (!table.ok()) {
    std::fprintf(stderr, "no tour.stations.small_house: %s\n",
                 std::string(table.status().message()).c_str());
    return;
  }
  const auto greedy = Choose(*table, 0);
  const auto found = Choose(*table, kCoverSeconds);
  if (!greedy.ok() || !found.ok()) return;
  figures.Add(
      {"tour.stations.small_house", static_cast<double>(found->cover.stations.size()), "", "<= 19",
       absl::StrFormat("%d places, overlap 0.1, %.0f s of one core; greedy %d; at least %d; "
                       "an evolutionary search (fnoi/scanplan) 19 in 180 s",
                       table->candidates.size(), kCoverSeconds, greedy->cover.stations.size(),
                       found->least)});
}

}  // namespace

void BenchCover(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (figures.Wants("tour.stations.small_house")) BenchSmallHouse(parallel, figures);
  if (figures.Wants("tour.stations.over_optimum")) BenchOptimum(options, parallel, figures);
}

}  // namespace vantage::bench

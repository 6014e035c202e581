// What is left in the model of rooms that exist only in mirrors, and what real was lost for them.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/model/partial_model.h"
#include "core/simulation/scenes/mirror_scenes.h"
#include "tests/bench/benchmarks.h"
#include "tests/support/phantom_oracle.h"

namespace vantage::bench {
namespace {

constexpr uint64_t kScenes = 50;
constexpr double kOpeningLost = 0.1;  // of the returns through it: the edge of a mirror beside it
constexpr size_t kFewReturns = 50;    // that tell nothing of an opening

struct PhantomFigures {
  double shown = 0;      // m^2: the most that was there after any scan
  double left = 0;       // m^2, after the last
  double reflected = 0;  // m^2 that mirrors showed to all scans
  size_t openings = 0;   // that scans saw through
  size_t lost = 0;       // of these
  size_t real = 0;       // returns
  size_t real_lost = 0;

  void Add(const PhantomFigures& other) {
    shown += other.shown;
    left += other.left;
    reflected += other.reflected;
    openings += other.openings;
    lost += other.lost;
    real += other.real;
    real_lost += other.real_lost;
  }
};

PhantomFigures PhantomsOf(const simulation::MirrorScene& made, uint64_t seed,
                          parallel::Parallel& parallel) {
  sensor::ScannerModel scanner;
  scanner.azimuth_step = scanner.elevation_step = sensor::Radians(0.4);
  const simulation::SimulatedScanner simulated(made.scene.mesh);
  test_support::PhantomOracle oracle(simulated);
  auto model = model::PartialModel::Create({}).value();
  PhantomFigures figures;
  for (size_t i = 0; i < made.scene.starts.size(); ++i) {
    const auto posed = oracle.Scan(made.scene.starts[i], scanner, 100 * seed + i, parallel);
    model->Insert(absl::StrCat("scan", i), posed.scan, posed.T_model_scan, parallel).value();
    figures.left = oracle.PhantomArea(*model->Publish());
    figures.shown = std::max(figures.shown, figures.left);
  }
  const auto view = model->Publish();
  figures.reflected = oracle.ReflectedArea(view->voxel_size());
  const auto all = oracle.LostReturns(*view);
  figures.real = all.returns;
  figures.real_lost = all.lost;
  std::string openings;
  for (const Eigen::AlignedBox3d& opening : made.openings) {
    const auto through = oracle.LostThrough(opening, *view);
    if (through.returns < kFewReturns) continue;
    ++figures.openings;
    if (through.share() <= kOpeningLost) continue;
    ++figures.lost;
    absl::StrAppendFormat(&openings, ", %.0f %% of an opening at (%.1f, %.1f) lost",
                          100 * through.share(), opening.center().x(), opening.center().y());
  }
  std::fprintf(stderr,
               "%s: %.2f m2 left, %.2f shown, of %.1f reflected; %.2f %% of returns lost%s\n",
               made.scene.name.c_str(), figures.left, figures.shown, figures.reflected,
               100 * all.share(), openings.c_str());
  return figures;
}

void Report(const std::string& name, const std::string& of, const PhantomFigures& all,
            Figures& figures) {
  figures.Add({name + ".area", all.shown > 0 ? all.left / all.shown : 0, "", "0.05",
               absl::StrFormat("%s: %.2f m2 left of %.2f", of, all.left, all.shown)});
  figures.Add({name + ".area.of_reflected", all.reflected > 0 ? all.left / all.reflected : 0, "",
               "", absl::StrFormat("%s: of %.1f m2 that mirrors showed", of, all.reflected)});
  figures.Add({name + ".openings_lost", static_cast<double>(all.lost), "openings", "0",
               absl::StrCat(of, ": of ", all.openings)});
  figures.Add({name + ".returns_lost",
               100 * static_cast<double>(all.real_lost) /
                   static_cast<double>(std::max<size_t>(1, all.real)),
               "%", "", absl::StrCat(of, ": of what was measured directly")});
}

}  // namespace

void BenchPhantom(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("phantom.")) return;
  const uint64_t first =
      options.use == simulation::SceneUse::kReporting ? simulation::kFirstReportingSeed : 1;
  PhantomFigures all;
  for (uint64_t seed = first; seed < first + kScenes; ++seed) {
    all.Add(PhantomsOf(simulation::RandomMirrorScene(seed), seed, parallel));
  }
  Report("phantom", absl::StrCat(kScenes, " random scenes after five scans"), all, figures);
}

}  // namespace vantage::bench

// What plans lose that are made from previews, and how large previews are.
#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_format.h"
#include "core/bytes/compression.h"
#include "core/model/partial_model.h"
#include "core/planning/evaluate_view.h"
#include "core/planning/planner.h"
#include "core/sensor/encoding.h"
#include "core/sensor/thinning.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/figures.h"
#include "tests/bench/scenes.h"

namespace vantage::bench {
namespace {

constexpr double kPreview = sensor::Radians(0.25);  // as the command line's
constexpr double kNative = sensor::Radians(0.08);   // 14 mm at 10 m
constexpr size_t kScans = 3;
constexpr size_t kPiece = 256 << 10;  // bytes, as sent

double SentMegabytes(const sensor::RangeImage& image) {
  const std::string bytes = sensor::EncodeRangeImage(image);
  size_t sent = 0;
  for (size_t from = 0; from < bytes.size(); from += kPiece) {
    sent += bytes::ZstdCompress(absl::string_view(bytes).substr(from, kPiece)).size();
  }
  return static_cast<double>(sent) / 1e6;
}

// The planner's best view in a model, and the problem, prepared.
struct Best {
  std::shared_ptr<const planning::PlanningProblem> problem;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  double gain = 0;  // m^2, of the model
};

std::optional<Best> BestOf(const model::PlanningView& model, const sensor::ScannerModel& scanner,
                           const planning::PlanningConfig& config, parallel::Parallel& parallel) {
  Best best;
  best.problem = planning::PlanningProblem::Prepare({model, scanner, config}, parallel).value();
  const planning::Plan plan = planning::MakePlan(*best.problem, parallel::Budget::Unlimited(),
                                                 parallel, [](const planning::Plan&) {});
  if (plan.views.empty() || !plan.views[0].model_gain.has_value()) return std::nullopt;
  best.position = plan.views[0].position;
  best.gain = *plan.views[0].model_gain;
  return best;
}

// m^2 that a scan brings from the nearest view to a place that is feasible in this model, within a
// viewcell: nobody places a tripod better, and what is feasible ends within one.
double GainBeside(const planning::PlanningProblem& problem, const Eigen::Vector3d& place,
                  const planning::PlanningConfig& config) {
  double nearest = 2;  // viewcells
  double gain = 0;
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        const Eigen::Vector3d step(x, y, z);
        if (step.norm() >= nearest) continue;
        const auto there =
            planning::EvaluateView(problem, place + config.viewcell_size * step).value();
        if (!there.feasible) continue;
        nearest = step.norm();
        gain = there.view.model_gain.value_or(0);
      }
    }
  }
  return gain;
}

}  // namespace

void BenchPreview(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("preview.")) return;
  sensor::ScannerModel scanner;
  scanner.azimuth_step = scanner.elevation_step = kNative;
  struct Sum {
    planning::StationBasis basis;
    const char* name;
    double gain = 0;
    double lost = 0;
    std::vector<double> regrets;
    std::string each;
  };
  Sum sums[] = {{planning::StationBasis::kExpected, "preview.regret", 0, 0, {}, ""},
                {planning::StationBasis::kKnown, "preview.regret.known", 0, 0, {}, ""}};
  std::vector<uint64_t> seeds = SceneSeeds(options.use);
  if (!options.full) seeds.resize(1);
  for (const uint64_t seed : seeds) {
    for (const simulation::Scene& scene :
         {simulation::FurnishedFlat(seed), simulation::TwoRooms(seed)}) {
      const simulation::SimulatedScanner tracer(scene.mesh);
      auto whole = model::PartialModel::Create({}).value();
      auto thinned = model::PartialModel::Create({}).value();
      std::optional<Eigen::Vector3d> position = scene.starts[0];
      for (size_t i = 0; i < kScans && position.has_value(); ++i) {
        Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
        pose.translate(*position);
        pose.rotate(Eigen::AngleAxisd(0.7 * static_cast<double>(i), Eigen::Vector3d::UnitZ()));
        sensor::Scan scan;
        scan.scanner = scanner;
        scan.image = tracer.Scan(scanner, pose, simulation::ScanFaults{}, seed + i, parallel);
        const std::string id = absl::StrFormat("scan%d", i);
        whole->Insert(id, scan, pose, parallel).value();
        scan.image = sensor::Thinned(scan.image, kPreview);
        thinned->Insert(id, scan, pose, parallel).value();
        position.reset();
        for (Sum& sum : sums) {
          planning::PlanningConfig config;
          config.station_basis = sum.basis;
          const auto of_whole = BestOf(*whole->Publish(), scanner, config, parallel);
          const auto of_preview = BestOf(*thinned->Publish(), scanner, config, parallel);
          if (!of_whole.has_value() || !of_preview.has_value()) continue;
          const double brings = GainBeside(*of_whole->problem, of_preview->position, config);
          sum.regrets.push_back(1 - brings / of_whole->gain);
          sum.gain += of_whole->gain;
          sum.lost += of_whole->gain - brings;
          sum.each += absl::StrFormat("%s%s after %d %.4f", sum.each.empty() ? "" : ", ",
                                      scene.name, i + 1, sum.regrets.back());
          position = of_whole->position;  // at last that of a known place
        }
      }
    }
  }
  for (const Sum& sum : sums) {
    figures.Add(
        {sum.name, sum.lost / sum.gain, "of model gain", "0.01",
         absl::StrFormat(
             "what the best view of a plan from previews of 0.25 degrees lacks in the model of the "
             "whole scans (0.08 degrees), of all that their own best views gain; %d plans, median "
             "%.4f, worst %.4f: %s",
             sum.regrets.size(), Percentile(sum.regrets, 0.5), Percentile(sum.regrets, 1),
             sum.each)});
  }
  sensor::ScannerModel fine = scanner;
  fine.azimuth_step = fine.elevation_step = sensor::Radians(0.035);
  const simulation::Scene flat = simulation::FurnishedFlat(SceneSeeds(options.use).front());
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translate(flat.starts[0]);
  const sensor::RangeImage sent = simulation::SimulatedScanner(flat.mesh).Scan(
      fine, pose, simulation::ScanFaults{}, 1, parallel, kPreview);
  figures.Add(
      {"preview.mb", SentMegabytes(sent), "MB", "1.0",
       absl::StrFormat("as sent, of a scan of %.0f M cells in a furnished flat: %d x %d rays",
                       2 * sensor::kPi / fine.azimuth_step *
                           (fine.elevation_max - fine.elevation_min) / fine.elevation_step / 1e6,
                       sent.columns(), sent.rows())});
}

}  // namespace vantage::bench

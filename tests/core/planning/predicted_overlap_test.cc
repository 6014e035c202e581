// The overlap that is predicted of a view means what the verdict on a scan from there means by it,
// but for what unknown space may hide, which a prediction takes to be hidden.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "core/planning/evaluate_view.h"
#include "core/registration/registration.h"
#include "core/simulation/random_sequence.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::planning {
namespace {

struct OverlapScene {
  const char* name;
  simulation::Scene (*make)(uint64_t seed);
  // Of the verdict's overlap over the predicted one: the most that its median may be. In a bare
  // room nothing is hidden; among pillars some of what lies between is unknown.
  double most_median;
};

class PredictedOverlapTest : public testing::TestWithParam<OverlapScene> {};

TEST_P(PredictedOverlapTest, IsTheOverlapOfTheScan) {
  // Nineteen of twenty scans overlap by 0.8 of what was predicted or more (prediction.cc).
  constexpr double kLeast = 0.75;
  constexpr double kLeastMedian = 0.9;
  constexpr size_t kViews = 5;
  parallel::ThreadPool pool(2);
  const simulation::Scene scene = GetParam().make(21);
  const simulation::SimulatedScanner tracer(scene.mesh);
  sensor::ScannerModel scanner;
  scanner.azimuth_step = scanner.elevation_step = sensor::Radians(0.5);
  const auto scan_at = [&](const Eigen::Vector3d& place, uint64_t seed) {
    sensor::Scan scan;
    scan.scanner = scanner;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = place;
    scan.image = tracer.Scan(scanner, pose, simulation::ScanFaults{}, seed, pool);
    scan.prior.emplace();
    scan.prior->T_world_scan = pose;
    return scan;
  };
  const auto model = model::PartialModel::Create({}).value();
  const sensor::Scan first = scan_at(scene.starts[0], 1);
  model->Insert("first", first, first.prior->T_world_scan, pool).value();
  const auto view = model->Publish();
  PlanningConfig config;
  config.viewcell_size = 0.25;
  const auto problem = PlanningProblem::Prepare({*view, scanner, config}, pool).value();
  simulation::RandomSequence random(simulation::MixBits(78));
  std::vector<double> ratios;
  for (int tries = 0; tries < 200 && ratios.size() < kViews; ++tries) {
    const Eigen::Vector3d at =
        scene.starts[0] + Eigen::Vector3d(random.Between(-5, 5), random.Between(-5, 5), 0);
    const ViewEvaluation evaluated = EvaluateView(*problem, at).value();
    if (!evaluated.feasible) continue;
    const sensor::Scan scan = scan_at(at, 2 + ratios.size());
    const auto registered =
        registration::Register(*view, scan, *scan.prior, config.registration, pool);
    ASSERT_TRUE(registered.ok()) << registered.status();
    if (registered->verdict.overlap_share < 0.1) continue;
    ratios.push_back(registered->verdict.overlap_share / evaluated.view.verdict.overlap_share);
    std::printf("%s: predicted %.3f, found %.3f\n", GetParam().name,
                evaluated.view.verdict.overlap_share, registered->verdict.overlap_share);
  }
  ASSERT_EQ(ratios.size(), kViews);
  std::sort(ratios.begin(), ratios.end());
  EXPECT_GT(ratios[kViews / 2], kLeastMedian);
  EXPECT_LT(ratios[kViews / 2], GetParam().most_median);
  EXPECT_GT(ratios.front(), kLeast);
}

simulation::Scene BareRoom(uint64_t) { return simulation::BoxRoom({9, 7, 2.8}); }

INSTANTIATE_TEST_SUITE_P(Scenes, PredictedOverlapTest,
                         testing::Values(OverlapScene{"bare", BareRoom, 1.1},
                                         OverlapScene{"pillars", simulation::PillarHall, 1.2}),
                         [](const auto& scene) { return std::string(scene.param.name); });

}  // namespace
}  // namespace vantage::planning

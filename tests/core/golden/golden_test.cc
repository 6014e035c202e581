// Compares the core's results, to the bit, with recorded ones. Moving or renaming code must not
// change them.
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/fleet/claim_cover.h"
#include "core/model/view/export.h"
#include "core/parallel/thread_pool.h"
#include "core/planning/openings/measure_coverage.h"
#include "core/registration/align/targets.h"
#include "core/registration/global_registration.h"
#include "core/registration/levelling.h"
#include "core/sensor/encoding.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/pane_room.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/core/golden/describe.h"
#include "tests/support/closed_form_view.h"

namespace vantage::golden {
namespace {

std::string Recorded(const std::string& name) { return absl::StrCat(GOLDENS, "/", name); }

Eigen::Isometry3d PoseAt(const Eigen::Vector3d& position, double yaw = 0) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translate(position);
  pose.rotate(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  return pose;
}

// Scans of a generated site.
class Site {
 public:
  explicit Site(simulation::Scene scene) : scene_(std::move(scene)), tracer_(scene_.mesh) {
    scanner_.azimuth_step = scanner_.elevation_step = sensor::Radians(0.75);
  }

  const sensor::ScannerModel& scanner() const { return scanner_; }
  Eigen::Vector3d start(size_t i) const { return scene_.starts.at(i); }
  sensor::Scan At(const Eigen::Isometry3d& pose, uint64_t seed) const {
    sensor::Scan scan;
    scan.scanner = scanner_;
    scan.image = tracer_.Scan(scanner_, pose, simulation::ScanFaults(), seed, *pool_);
    return scan;
  }

 private:
  simulation::Scene scene_;
  simulation::SimulatedScanner tracer_;
  sensor::ScannerModel scanner_;
  std::unique_ptr<parallel::ThreadPool> pool_ = std::make_unique<parallel::ThreadPool>(2);
};

std::unique_ptr<model::PartialModel> EmptyModel() {
  model::ModelConfig config;
  config.voxel_size = 0.1;
  return model::PartialModel::Create(config).value();
}

// What `describe` comes to on one thread and on two, which must be the same.
template <typename DescribeOn>
test_support::GoldenText OnAnyThreads(const DescribeOn& describe) {
  test_support::GoldenText one;
  test_support::GoldenText two;
  parallel::Serial serial;
  parallel::ThreadPool pool(2);
  describe(serial, one);
  describe(pool, two);
  EXPECT_EQ(one.text(), two.text()) << "differs by the number of threads";
  return one;
}

class Golden : public testing::Test {
 protected:
  // Two scans of the living room of a flat, at their true poses.
  static std::unique_ptr<model::PartialModel> FlatModel(const Site& flat,
                                                        parallel::Parallel& parallel) {
    auto model = EmptyModel();
    const Eigen::Isometry3d first = PoseAt(flat.start(0));
    const Eigen::Isometry3d second = PoseAt(flat.start(0) + Eigen::Vector3d(0, 1.5, 0), 0.3);
    EXPECT_TRUE(model->Insert("first", flat.At(first, 10), first, parallel).ok());
    EXPECT_TRUE(model->Insert("second", flat.At(second, 11), second, parallel).ok());
    return model;
  }

  parallel::Serial serial_;
};

TEST_F(Golden, RangeImages) {
  test_support::GoldenText out;
  const Site flat(simulation::FurnishedFlat(3));
  for (const uint64_t seed : {1, 2}) {
    const sensor::Scan scan = flat.At(PoseAt(flat.start(0), 0.5), seed);
    out.Section(absl::StrCat("flat, seed ", seed));
    out.Counts("columns, rows, samples", {scan.image.columns(), scan.image.rows(),
                                          static_cast<int64_t>(scan.image.SampleCount())});
    const std::string bytes = sensor::EncodeRangeImage(scan.image);
    out.Bytes("encoded", bytes);
    const sensor::RangeImage decoded = sensor::DecodeRangeImage(bytes, scan.image.cells()).value();
    EXPECT_EQ(sensor::EncodeRangeImage(decoded), bytes);
    test_support::GoldenText ranges;
    for (const float range : decoded.range) ranges.Numbers("", {range});
    out.Lines("ranges", ranges);
  }
  test_support::ExpectGolden(out, Recorded("range_images.txt"));
}

TEST_F(Golden, Models) {
  const Site room(simulation::PaneRoom(simulation::Panes()));
  const std::vector<Eigen::Isometry3d> poses = {PoseAt(room.start(0)), PoseAt({1.6, 1.2, 1.5}, 1.0),
                                                PoseAt({3.6, 3.0, 1.4}, -2.0)};
  const test_support::GoldenText out = OnAnyThreads([&](parallel::Parallel& parallel,
                                                        test_support::GoldenText& text) {
    auto model = EmptyModel();
    for (size_t i = 0; i < poses.size(); ++i) {
      text.Section(absl::StrCat("scan ", i, " comes"));
      Describe(model->Insert(absl::StrCat("scan", i), room.At(poses[i], 20 + i), poses[i], parallel)
                   .value(),
               text);
      Describe(*model, parallel, text);
    }
    text.Section("scan 1 goes");
    Describe(model->Withdraw("scan1", parallel).value(), text);
    Describe(*model, parallel, text);
    const auto loaded = model::PartialModel::Load(model->Save(parallel), 1 << 30, parallel).value();
    EXPECT_EQ(loaded->Digest(), model->Digest());
    text.Section("exports");
    text.Bytes("octomap", model::ExportOctomap(*model->Publish()));
    text.Bytes("ply", model::ExportSurfacePly(*model->Publish()));
  });
  test_support::ExpectGolden(out, Recorded("models.txt"));
}

TEST_F(Golden, Registrations) {
  const Site flat(simulation::FurnishedFlat(3));
  parallel::ThreadPool pool(2);
  const auto model = EmptyModel();
  const Eigen::Isometry3d first = PoseAt(flat.start(0));
  ASSERT_TRUE(model->Insert("first", flat.At(first, 10), first, pool).ok());
  const std::shared_ptr<const model::PlanningView> view = model->Publish();
  test_support::GoldenText out;
  const auto enter = [&](const std::string& title, const registration::RegistrationResult& result) {
    out.Section(title);
    Describe(result, out);
  };
  registration::RegistrationConfig config;
  const auto off = [](const Eigen::Isometry3d& pose, double metres, double degrees) {
    Eigen::Isometry3d wrong = pose;
    wrong.pretranslate(Eigen::Vector3d(metres, -0.6 * metres, 0.2 * metres));
    wrong.rotate(Eigen::AngleAxisd(sensor::Radians(degrees), Eigen::Vector3d::UnitZ()));
    return wrong;
  };
  // In the same room, on the other side of it, in the hall, in the next room.
  const std::vector<Eigen::Vector3d> stations = {
      flat.start(0) + Eigen::Vector3d(0, 1.5, 0), flat.start(0) + Eigen::Vector3d(-1, -2, 0),
      flat.start(2) + Eigen::Vector3d(-2, 0, 0), flat.start(3)};
  for (size_t i = 0; i < stations.size(); ++i) {
    const Eigen::Isometry3d pose = PoseAt(stations[i], 0.7);
    const sensor::Scan scan = flat.At(pose, 30 + i);
    sensor::PosePrior prior;
    prior.T_world_scan = off(pose, 0.12, 2);
    const std::string where = absl::StrCat("scan ", i);
    enter(where + ", prior off by 0.15 m",
          registration::Register(*view, scan, prior, config, pool).value());
    if (i != 0) continue;
    prior.T_world_scan = off(pose, 3, 60);
    enter(where + ", prior off by 3.5 m",
          registration::Register(*view, scan, prior, config, pool).value());
    prior.T_world_scan = off(pose, 0.01, 0.1);
    prior.covariance = sensor::Matrix6d::Identity() * 1e-4;
    prior.levelled_sigma = 0.001;
    prior.trusted = true;
    enter(where + ", trusted", registration::Register(*view, scan, prior, config, pool).value());
    std::vector<registration::TargetTie> targets(3);
    for (size_t k = 0; k < targets.size(); ++k) {
      targets[k].name = absl::StrCat("target ", k);
      targets[k].in_scan = Eigen::Vector3d(k == 0 ? 2 : 0.5, k == 1 ? 2 : -1, k == 2 ? 0.8 : 0);
      targets[k].in_world = pose * targets[k].in_scan + Eigen::Vector3d(0.001, 0, -0.001);
    }
    prior = sensor::PosePrior();
    prior.T_world_scan = off(pose, 0.05, 1);
    enter(where + ", targets",
          registration::RegisterWithTargets(*view, scan, prior, targets, config, pool).value());
    enter(where + ", no prior",
          registration::RegisterGlobally(*view, scan, first, config, pool).value());
  }
  Eigen::Isometry3d tilted = PoseAt(flat.start(0), 0.2);
  tilted.rotate(Eigen::AngleAxisd(sensor::Radians(3), Eigen::Vector3d(0.6, 0.8, 0)));
  const registration::Levelling level = registration::LevelFirstScan(flat.At(tilted, 40)).value();
  out.Section("first scan, tilted by 3 degrees");
  Describe(level.T_world_scan, out);
  out.Numbers("tilt", {level.tilt});
  out.Counts("by inclinometer, floor found", {level.from_inclinometer, level.found_floor});
  test_support::ExpectGolden(out, Recorded("registrations.txt"));
}

TEST_F(Golden, Plans) {
  const Site flat(simulation::FurnishedFlat(3));
  const std::shared_ptr<const model::PlanningView> model = FlatModel(flat, serial_)->Publish();
  planning::PlanningConfig config;
  config.viewcell_size = 0.2;
  config.required_density = 600;
  config.candidates = 3;
  config.max_checked = 20;
  config.registration.minimum_overlap = 0.4;
  test_support::GoldenText out;
  for (const planning::EvaluationOrder order :
       {planning::EvaluationOrder::kAnytime, planning::EvaluationOrder::kPatches}) {
    config.order = order;
    for (const uint64_t work : {400'000, 20'000'000}) {
      parallel::Budget budget;
      budget.work_limit = work;
      out.Section(
          absl::StrCat(order == planning::EvaluationOrder::kAnytime ? "anytime" : "by patches",
                       ", ", work, " rays"));
      out.Append(OnAnyThreads([&](parallel::Parallel& parallel, test_support::GoldenText& text) {
        Describe(planning::MakePlan(*model, flat.scanner(), config, budget, parallel,
                                    [](const planning::Plan&) {})
                     .value(),
                 text);
      }));
    }
  }
  out.Section("coverage");
  Describe(planning::MeasureCoverage(*model, std::span(&flat.scanner(), 1), config).value(), out);
  test_support::ExpectGolden(out, Recorded("plans.txt"));
}

TEST_F(Golden, EvaluatedViews) {
  const Site flat(simulation::FurnishedFlat(3));
  const std::shared_ptr<const model::PlanningView> model = FlatModel(flat, serial_)->Publish();
  planning::PlanningConfig config;
  config.viewcell_size = 0.4;
  config.required_density = 600;
  test_support::GoldenText out;
  const Eigen::Vector3d seen = flat.start(0) + Eigen::Vector3d(-0.5, 0.2, 0);
  for (const Eigen::Vector3d& position : {seen, flat.start(2), Eigen::Vector3d(50, 0, 1.5)}) {
    out.Section("view");
    out.Append(OnAnyThreads([&](parallel::Parallel& parallel, test_support::GoldenText& text) {
      Describe(planning::EvaluateView(*model, flat.scanner(), config, position, parallel).value(),
               text);
    }));
  }
  config.pose_sensitivity = true;
  out.Section("with what every pose within the error sees");
  Describe(planning::EvaluateView(*model, flat.scanner(), config, seen, serial_).value(), out);
  test_support::ExpectGolden(out, Recorded("views.txt"));
}

// Two scanners of different models beside a claim, in a room that is given in closed form.
TEST_F(Golden, JointPlans) {
  test_support::ClosedFormScene scene = test_support::FurnishedRoom(5);
  scene.density = [](const Eigen::Vector3d& p) {
    return 20000 / (Eigen::Vector3d(1.5, 1.5, 1.5) - p).squaredNorm();
  };
  const model::PlanningView model = test_support::BuildView(scene);
  planning::PlanningConfig config;
  config.viewcell_size = 0.4;
  config.max_viewpoint_height = 1.7;
  config.candidates = 3;
  config.registration.required_accuracy = 0.05;
  fleet::FleetRequest request;
  request.scanners.resize(3);
  request.scanners[1].model.name = "coarse";
  request.scanners[1].model.azimuth_step = request.scanners[1].model.elevation_step =
      sensor::Radians(0.4);
  request.scanners[1].at = Eigen::Vector3d(4.5, 3.5, 1.5);
  request.scanners[1].speed = 0.8;
  request.scanners[2].reach = {
      planning::Region(Eigen::Vector3d(20, 20, 0), Eigen::Vector3d(21, 21, 3))};
  const fleet::PledgedView claim{{1.8, 3.4, 1.43}, sensor::ScannerModel()};
  request.pledged = {claim};
  parallel::Budget budget;
  budget.work_limit = 6'000'000;
  test_support::GoldenText out;
  for (const fleet::FleetRanking ranking :
       {fleet::FleetRanking::kScore, fleet::FleetRanking::kScorePerMinute}) {
    request.ranking = ranking;
    out.Section(ranking == fleet::FleetRanking::kScore ? "by gain" : "by gain a minute");
    out.Append(OnAnyThreads([&](parallel::Parallel& parallel, test_support::GoldenText& text) {
      Describe(fleet::MakeJointPlan(model, request, config, budget, parallel,
                                    [](const planning::Plan&) {})
                   .value(),
               text);
    }));
  }
  out.Section("covered by claims");
  for (const double x : {3.8, 2.2}) {
    const fleet::CoveredView covered = fleet::MeasureCover(model, sensor::ScannerModel(), config,
                                                           {x, 3.4, 1.43}, request.pledged, serial_)
                                           .value();
    out.Numbers("gain, left", {covered.score, covered.left});
    out.Numbers("by claim", covered.cover.by_claim);
    out.Numbers("together", {covered.cover.together});
  }
  test_support::ExpectGolden(out, Recorded("joint_plans.txt"));
}

}  // namespace
}  // namespace vantage::golden

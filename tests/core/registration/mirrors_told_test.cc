// A scan from right in front of a mirror shows a room behind the wall, where other scans saw empty
// space. The pose is right nevertheless.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <random>
#include <span>

#include "absl/strings/str_cat.h"
#include "core/model/partial_model.h"
#include "core/parallel/parallel.h"
#include "core/registration/align/without_reflections.h"
#include "core/registration/registration.h"
#include "core/sensor/presets.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/core/registration/box_scene.h"
#include "tests/core/registration/flat_scans.h"
#include "tests/support/runs.h"

namespace vantage::registration {
namespace {

class MirrorsToldTest : public testing::Test {
 protected:
  MirrorsToldTest() : simulated_(scene_.mesh) {
    scanner_.azimuth_step = scanner_.elevation_step = sensor::Radians(0.3);
  }

  sensor::Scan ScanAt(const Eigen::Isometry3d& pose, const simulation::ScanFaults& faults = {}) {
    return {simulated_.Scan(scanner_, pose, faults, 7, serial_), scanner_, {}};
  }
  // What the first scan sees: the hall, the doors to other rooms, and into the bath.
  std::shared_ptr<const model::PlanningView> AfterTheFirst() {
    auto model = *model::PartialModel::Create({});
    const Eigen::Isometry3d pose = PoseAt({0.95, 6.65, 1.2}, 0);
    EXPECT_TRUE(model->Insert("first", ScanAt(pose), pose, serial_).ok());
    return model->Publish();
  }

  parallel::Serial serial_;
  const simulation::Scene scene_ = simulation::FurnishedFlat(101);
  const simulation::SimulatedScanner simulated_;
  sensor::ScannerModel scanner_;
};

// A metre from the mirror over the washstand, 0.6 m wide in the wall at y = 4.43.
const Eigen::Isometry3d kBeforeTheMirror = PoseAt({3.44, 3.47, 1.1}, 0.4);

TEST_F(MirrorsToldTest, AScanFromBeforeAMirrorIsRegistered) {
  const std::shared_ptr<const model::PlanningView> model = AfterTheFirst();
  const sensor::Scan scan = ScanAt(kBeforeTheMirror);
  std::mt19937_64 random(1);
  for (int t = 0; t < test_support::Runs(5); ++t) {
    sensor::PosePrior prior;
    prior.T_world_scan = Disturbed(kBeforeTheMirror, 0.1, sensor::Radians(3), random);
    const auto result = Register(*model, scan, prior, {}, serial_);
    ASSERT_TRUE(result.ok());
    EXPECT_TRUE(result->verdict.registered()) << result->verdict.reason;
    EXPECT_LT((result->T_world_scan.translation() - kBeforeTheMirror.translation()).norm(), 0.005);
    EXPECT_LT(result->contradiction_share, 0.08);
  }
}

// A mirror at the end of a room shows the wall beside it, turned by twice as much as the mirror
// hangs askew: within two centimetres of the wall as it goes on in the next room. No return
// contradicts.
TEST(MirrorHungAskew, MovesNoScan) {
  FlatScans flat(201);
  flat.Insert(PoseAt({9.65, 0.65, 1.2}, 0.7));
  flat.Insert(PoseAt({6.57, 3.22, 1.45}, 2.9));
  std::mt19937_64 random(1);
  for (int t = 0; t < test_support::Runs(4); ++t) {
    const Eigen::Isometry3d truth = PoseAt({4.35 + 0.05 * t, 1.69, 1.25}, 0.9 * t);
    sensor::PosePrior prior;
    prior.T_world_scan = Disturbed(truth, 0.1, sensor::Radians(3), random);
    const auto result = flat.RegisterAt(truth, prior, 10 + t);
    ASSERT_TRUE(result.ok());
    EXPECT_TRUE(result->verdict.registered()) << result->verdict.reason;
    EXPECT_LT((result->T_world_scan.translation() - truth.translation()).norm(), 0.001);
  }
}

TEST_F(MirrorsToldTest, AScanAtAWrongPlaceIsNot) {
  const std::shared_ptr<const model::PlanningView> model = AfterTheFirst();
  const sensor::Scan scan = ScanAt(kBeforeTheMirror);
  const std::array<Eigen::Vector3d, 5> offsets = {
      {{2, 0, 0}, {0, 2, 0}, {3, 1, 0}, {-2, 1, 0}, {5, 2, 0}}};
  for (const Eigen::Vector3d& off : std::span(offsets).first(test_support::Runs(offsets.size()))) {
    sensor::PosePrior prior;
    prior.T_world_scan = kBeforeTheMirror;
    prior.T_world_scan.pretranslate(off);
    const auto result = Register(*model, scan, prior, {}, serial_);
    ASSERT_TRUE(result.ok());
    const double error =
        (result->T_world_scan.translation() - kBeforeTheMirror.translation()).norm();
    EXPECT_TRUE(!result->verdict.registered() || error < 0.01) << off.transpose();
  }
}

TEST_F(MirrorsToldTest, OnlyWhatIsBehindTheMirrorIsLeftOut) {
  const sensor::Scan scan = ScanAt(kBeforeTheMirror);
  const std::optional<sensor::Scan> without = WithoutReflections(scan, serial_);
  ASSERT_TRUE(without.has_value());
  ASSERT_TRUE(without->image.Validate().ok());
  // What a mirror that cannot be seen in would have let through.
  const sensor::RangeImage truth = ScanAt(kBeforeTheMirror, simulation::ScanFaults::None()).image;
  size_t reflections = 0;
  size_t left = 0;
  size_t lost = 0;
  for (size_t i = 0; i < truth.range.size(); ++i) {
    const float range = scan.image.range[i];
    if (!sensor::RangeImage::IsRange(range)) continue;
    const bool reflected =
        sensor::RangeImage::IsRange(truth.range[i]) && range > truth.range[i] + 0.15F;
    const bool is_left = sensor::RangeImage::IsRange(without->image.range[i]);
    EXPECT_TRUE(!is_left || without->image.range[i] == range);
    reflections += reflected ? 1 : 0;
    left += reflected && is_left ? 1 : 0;
    lost += !reflected && !is_left ? 1 : 0;
  }
  EXPECT_GT(reflections, 3000u);
  EXPECT_LT(left, reflections / 20);
  EXPECT_LT(lost, reflections / 20);
}

TEST_F(MirrorsToldTest, WithoutAMirrorInSightNothingIsLeftOut) {
  const sensor::Scan scan = ScanAt(PoseAt({0.95, 6.65, 1.2}, 0), simulation::ScanFaults::None());
  EXPECT_FALSE(WithoutReflections(scan, serial_).has_value());
}

}  // namespace
}  // namespace vantage::registration

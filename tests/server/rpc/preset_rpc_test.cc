// Plans for instruments that are named: far outside, and with a setting for each view.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/parallel/parallel.h"
#include "core/sensor/encoding.h"
#include "core/sensor/presets.h"
#include "core/simulation/scenes/outdoor_scenes.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/server/fixture/in_process.h"

namespace vantage::rpc {
namespace {

class PresetRpc : public testing::Test {
 protected:
  // A session with the instrument, and voxels of 0.1 m.
  void Open(const std::string& preset, const Eigen::Vector3d& max_half_extent) {
    v1::CreateSessionRequest request;
    v1::Session& asked = *request.mutable_session();
    asked.add_scanner_models()->set_preset(preset);
    v1::ModelConfig& config = *asked.mutable_model_config();
    config.set_voxel_size_m(0.1);
    config.mutable_max_half_extent()->set_x(max_half_extent.x());
    config.mutable_max_half_extent()->set_y(max_half_extent.y());
    config.mutable_max_half_extent()->set_z(max_half_extent.z());
    grpc::ClientContext context;
    v1::CreateSessionResponse response;
    const grpc::Status status = server_.sessions->CreateSession(&context, request, &response);
    ASSERT_TRUE(status.ok()) << status.error_message();
    session_ = response.session().name();
  }

  // A scan from the scene's first start, as the instrument makes it but in steps of 0.4 degrees.
  v1::Scan Scan(const simulation::Scene& scene, const std::string& preset) {
    sensor::ScannerModel scanner = sensor::FindPreset(preset).value().model;
    scanner.azimuth_step = scanner.elevation_step = sensor::Radians(0.4);
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = scene.starts.front();
    parallel::Serial serial;
    const v1::Upload upload = server_.Send(
        session_, sensor::EncodeRangeImage(
                      simulation::SimulatedScanner(scene.mesh).Scan(scanner, pose, {}, 7, serial)));
    return server_.WaitFor(session_, upload.scan(), v1::SCAN_STATE_MERGED);
  }

  v1::Plan Plan(bool choose_setting) {
    v1::CreatePlanRequest request;
    request.set_parent(session_);
    request.mutable_plan()->set_work_limit_rays(5'000'000);
    request.mutable_plan()->set_choose_setting(choose_setting);
    return server_.Plan(request);
  }

  fixture::InProcess server_{session::Algorithms::Core()};
  std::string session_;
};

// The instrument measures 250 m far; the site ends within the yard.
TEST_F(PresetRpc, ALongRangeScannerInAYardIsPlannedForWithinTheSite) {
  const Eigen::Vector3d half(6, 8, 5);
  ASSERT_NO_FATAL_FAILURE(Open("riegl-vz-400i", half));
  const v1::Scan scan = Scan(simulation::CourtyardScene(1), "riegl-vz-400i");
  EXPECT_GT(scan.merge().beyond_site_count(), 0);
  EXPECT_EQ(scan.merge().beyond_range_count(), 0);
  EXPECT_LT(scan.merge().beyond_site_count(), scan.sample_count() / 2);
  EXPECT_GT(scan.merge().sky_ray_count(), 0);
  EXPECT_EQ(scan.levelling().message(), "");
  const v1::PlanResult result = Plan(false).result();
  ASSERT_GT(result.views_size(), 0);
  for (const v1::RankedView& view : result.views()) {
    EXPECT_LT(std::abs(view.position().x()), half.x());
    EXPECT_LT(std::abs(view.position().y()), half.y());
    EXPECT_GT(view.model_gain_m2(), 0);
    EXPECT_TRUE(view.setting().empty());
  }
}

TEST_F(PresetRpc, APlanThatChoosesNamesTheSettingOfEachView) {
  ASSERT_NO_FATAL_FAILURE(Open("leica-rtc360", {30, 30, 10}));
  Scan(simulation::TwoRooms(1), "leica-rtc360");
  const v1::Plan plan = Plan(true);
  EXPECT_TRUE(plan.choose_setting());
  ASSERT_GT(plan.result().views_size(), 0);
  const sensor::Preset preset = sensor::FindPreset("leica-rtc360").value();
  for (const v1::RankedView& view : plan.result().views()) {
    ASSERT_FALSE(view.setting().empty());
    const auto setting = preset.Setting(view.setting());
    ASSERT_TRUE(setting.ok()) << setting.status();
    EXPECT_NEAR(
        static_cast<double>(view.scan_duration().seconds()) + 1e-9 * view.scan_duration().nanos(),
        60 * setting->minutes, 1e-3);
    EXPECT_GT(view.score_per_minute(), 0);
  }
}

}  // namespace
}  // namespace vantage::rpc

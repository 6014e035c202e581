// Two real panoramic scans of a furnished home (ranges quantised to 1 cm, tilted, cluttered).
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

#include "core/model/partial_model.h"
#include "core/model/view/model_config.h"
#include "core/parallel/thread_pool.h"
#include "core/registration/align/registration_config.h"
#include "core/registration/bound/prediction.h"
#include "core/registration/levelling.h"
#include "core/registration/place_and_register.h"
#include "core/registration/registration.h"
#include "core/sensor/imported_scan.h"
#include "core/sensor/scan_file.h"
#include "tests/core/registration/box_scene.h"

namespace vantage::registration {
namespace {

// The instrument cannot meet the default of 10 mm: what it is held to is what its reference pose
// is good for.
RegistrationConfig ForThisInstrument() {
  RegistrationConfig config;
  config.required_accuracy = 0.05;
  return config;
}

class RealScans : public testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("VANTAGE_SHARED_DATA");
    if (data == nullptr) GTEST_SKIP() << "VANTAGE_SHARED_DATA is not set: no real scans to read";
    const std::string folder = std::string(data) + "/pcl_room_scan/";
    if (!std::ifstream(folder + "room_scan1.ptx")) {
      GTEST_SKIP() << folder << "room_scan1.ptx is not there: no real scans to read";
    }
    for (int i = 0; i < 2; ++i) {
      const auto imported = sensor::ReadScanFile(
          folder + "room_scan" + std::to_string(i + 1) + ".ptx", sensor::ImportLimits());
      ASSERT_TRUE(imported.ok()) << imported.status();
      scans_[i].image = imported->image;
      scans_[i].scanner = imported->scanner;
    }
    std::ifstream poses(folder + "poses.txt");
    for (std::string line; std::getline(poses, line);) {
      std::istringstream words(line);
      std::string name;
      words >> name;
      if (name != "room_scan2") continue;
      Eigen::Matrix4d m;
      for (int i = 0; i < 16; ++i) words >> m(i / 4, i % 4);
      T_scan1_scan2_.linear() = Eigen::Quaterniond(Eigen::Matrix3d(m.topLeftCorner<3, 3>()))
                                    .normalized()
                                    .toRotationMatrix();
      T_scan1_scan2_.translation() = m.topRightCorner<3, 1>();
    }
    ASSERT_NEAR(T_scan1_scan2_.translation().x(), 1.964, 0.001) << "poses.txt has changed";
  }

  // Scan 1 levelled and inserted.
  std::shared_ptr<const model::PlanningView> ModelOfScan1() {
    const auto level = LevelFirstScan(scans_[0]);
    EXPECT_TRUE(level.ok()) << level.status();
    T_world_scan1_ = level->T_world_scan;
    auto model = model::PartialModel::Create(model::ModelConfig());
    EXPECT_TRUE(model.ok()) << model.status();
    const auto merged = (*model)->Insert("scan1", scans_[0], T_world_scan1_, pool_);
    EXPECT_TRUE(merged.ok()) << merged.status();
    return (*model)->Publish();
  }

  struct Difference {
    double metres;
    double degrees;
  };
  Difference ToReference(const Eigen::Isometry3d& T_world_scan2) const {
    const Eigen::Isometry3d e =
        T_scan1_scan2_.inverse() * (T_world_scan1_.inverse() * T_world_scan2);
    return {e.translation().norm(), sensor::Degrees(Eigen::AngleAxisd(e.linear()).angle())};
  }

  parallel::ThreadPool pool_{2};
  sensor::Scan scans_[2];
  Eigen::Isometry3d T_scan1_scan2_ = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_world_scan1_ = Eigen::Isometry3d::Identity();
};

TEST_F(RealScans, AreLevelledByTheirFloor) {
  constexpr double kTilt[2] = {1.0, 1.7};  // degrees, as published with the data
  for (int i = 0; i < 2; ++i) {
    const auto level = LevelFirstScan(scans_[i]);
    ASSERT_TRUE(level.ok()) << level.status();
    EXPECT_TRUE(level->found_floor);
    EXPECT_NEAR(sensor::Degrees(level->tilt), kTilt[i], 0.3);
    EXPECT_EQ(level->message, "");
  }
}

TEST_F(RealScans, SecondRegistersFromAPriorOff20CentimetresAnd5Degrees) {
  const auto model = ModelOfScan1();
  const Eigen::Isometry3d reference = T_world_scan1_ * T_scan1_scan2_;
  sensor::PosePrior prior;
  prior.T_world_scan = reference;
  prior.T_world_scan.translation() += Eigen::Vector3d(0.16, -0.12, 0);
  prior.T_world_scan.linear() =
      Eigen::AngleAxisd(sensor::Radians(5), Eigen::Vector3d::UnitZ()) * reference.linear();
  const auto result = Register(*model, scans_[1], prior, ForThisInstrument(), pool_);
  ASSERT_TRUE(result.ok()) << result.status();
  const Difference d = ToReference(result->T_world_scan);
  EXPECT_LT(d.metres, 0.05);
  EXPECT_LT(d.degrees, 1.0);
  EXPECT_TRUE(result->verdict.registered()) << result->verdict.reason;
}

// What is asked by default cannot be met with this instrument, as its residuals show. Refitting
// from random halves of the scan scatters by 5 to 21 mm (experiments.md).
TEST_F(RealScans, SayWhatThisInstrumentCan) {
  const auto model = ModelOfScan1();
  sensor::PosePrior prior;
  prior.T_world_scan = T_world_scan1_ * T_scan1_scan2_;
  const auto result = Register(*model, scans_[1], prior, RegistrationConfig(), pool_);
  ASSERT_TRUE(result.ok()) << result.status();
  const RegistrationVerdict& v = result->verdict;
  EXPECT_FALSE(v.registered());
  EXPECT_EQ(BasesText(v.bases), "residuals") << v.reason;
  ASSERT_TRUE(v.attainable_accuracy.has_value()) << v.reason;
  // The scan's own bound counts what its residuals share over a metre, and what is learned of the
  // instrument what they share over two.
  EXPECT_GT(v.judged_bound, 0.021);
  EXPECT_LT(v.judged_bound, 0.050);
  EXPECT_GT(*v.attainable_accuracy, v.judged_bound);
  EXPECT_LT(*v.attainable_accuracy, 2 * v.judged_bound);
  // What it says to set is what the scan registers with.
  RegistrationConfig as_said;
  as_said.required_accuracy = kBoundMargin * *v.attainable_accuracy;
  const auto again = Register(*model, scans_[1], prior, as_said, pool_);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_TRUE(again->verdict.registered()) << again->verdict.reason;
}

TEST_F(RealScans, TwentyPriorsUpToHalfAMetreAnd15Degrees) {
  const auto model = ModelOfScan1();
  const Eigen::Isometry3d reference = T_world_scan1_ * T_scan1_scan2_;
  std::mt19937_64 random(20);
  std::uniform_real_distribution<double> unit(0, 1);
  int accepted = 0;
  for (int k = 0; k < 20; ++k) {
    const double metres = 0.5 * unit(random);
    const double degrees = 15 * unit(random);
    sensor::PosePrior prior;
    prior.T_world_scan = Disturbed(reference, metres, sensor::Radians(degrees), random);
    const auto result = Register(*model, scans_[1], prior, ForThisInstrument(), pool_);
    ASSERT_TRUE(result.ok()) << result.status();
    const Difference d = ToReference(result->T_world_scan);
    const RegistrationVerdict& v = result->verdict;
    std::printf(
        "prior %2d off %.2f m %4.1f deg: off %.3f m %.2f deg, overlap %.2f, rms %.1f mm (%.1f), "
        "contradiction %.3f, E %.1f mm: %s %s\n",
        k, metres, degrees, d.metres, d.degrees, v.overlap_share, 1000 * result->rms_residual,
        1000 * result->expected_residual, result->contradiction_share, 1000 * v.error_bound,
        v.registered() ? "registered" : "not registered", v.reason.c_str());
    if (!v.registered()) continue;
    ++accepted;
    EXPECT_LT(d.metres, 0.05) << "accepted wrong from prior " << k;
    EXPECT_LT(d.degrees, 1.0) << "accepted wrong from prior " << k;
  }
  EXPECT_GE(accepted, 15);
}

TEST_F(RealScans, AreNotAcceptedWhereTheyDoNotBelong) {
  const auto model = ModelOfScan1();
  const Eigen::Isometry3d reference = T_world_scan1_ * T_scan1_scan2_;
  for (const double yaw : {90.0, 180.0, 270.0}) {
    for (const double shift : {-1.5, 1.5}) {
      sensor::PosePrior prior;
      prior.T_world_scan = PoseAt({0, 0, 0}, sensor::Radians(yaw)) * reference;
      prior.T_world_scan.translation() =
          reference.translation() + Eigen::Vector3d(shift, 0.5 * shift, 0);
      const auto result = Register(*model, scans_[1], prior, ForThisInstrument(), pool_);
      ASSERT_TRUE(result.ok()) << result.status();
      const Difference d = ToReference(result->T_world_scan);
      EXPECT_FALSE(result->verdict.registered() && (d.metres > 0.05 || d.degrees > 1.0))
          << "accepted " << d.metres << " m and " << d.degrees << " degrees off, prior turned "
          << yaw << ", moved " << shift;
      std::printf("turned %.0f moved %.1f: off %.2f m, contradiction %.2f: %s\n", yaw, shift,
                  d.metres, result->contradiction_share, result->verdict.reason.c_str());
    }
  }
}

// Also with the default requirement, which this instrument cannot meet.
TEST_F(RealScans, AreFoundWhereTheirPriorIsWrong) {
  const std::shared_ptr<const model::PlanningView> model = ModelOfScan1();
  const Eigen::Isometry3d truth = T_world_scan1_ * T_scan1_scan2_;
  sensor::Scan scan = scans_[1];
  scan.prior.emplace();
  scan.prior->T_world_scan = PoseAt({2.1, 0.2, 0}, sensor::Radians(126));
  for (const RegistrationConfig& config : {ForThisInstrument(), RegistrationConfig()}) {
    const auto result = PlaceAndRegister(*model, scan, T_world_scan1_, {}, config, pool_);
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_EQ(result->verdict.outcome, RegistrationOutcome::kDoubtful);
    EXPECT_NE(result->verdict.reason.find("does not fit: it is 0.1"), std::string::npos)
        << result->verdict.reason;
    EXPECT_LT((result->T_world_scan.translation() - truth.translation()).norm(), 0.05);
  }
}

}  // namespace
}  // namespace vantage::registration

// Two real scans of a furnished home: the whole loop on real noise, drop-outs and clutter.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <tuple>

#include "client/cli/pose_flags.h"
#include "client/library/geometry.h"
#include "client/picture/surface_ply.h"
#include "tests/integration/answers.h"
#include "vantage/v1/plan.pb.h"
#include "vantage/v1/scan.pb.h"

namespace vantage::integration {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

// What these scans can be asked for: about 1 degree between samples, ranges in whole centimetres.
constexpr char kDensity[] = "100";
constexpr char kAccuracy[] = "0.05";
constexpr char kNoise[] = "scanner.range_noise_m=0.01";

class RealScansTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (SharedData("pcl_room_scan/poses.txt").empty()) {
      GTEST_SKIP() << "the real room scans are not on this machine (VANTAGE_SHARED_DATA)";
    }
    ASSERT_FALSE(server_.address().empty());
    const auto poses =
        cli::ParsePoses(Contents(SharedData("pcl_room_scan/poses.txt")), "poses.txt");
    ASSERT_TRUE(poses.ok()) << poses.status();
    T_scan1_scan2_ = (*poses)[0].second.inverse() * (*poses)[1].second;
  }

  v1::Scan PushFirst(const std::string& session, const std::string& file) {
    EXPECT_EQ(Vantage(server_, {"session", "create", session, "--scanner-from", SharedData(file),
                                "--density", kDensity, "--accuracy", kAccuracy, "--set", kNoise})
                  .exit_code,
              0);
    const Finished pushed = Vantage(
        server_, {"scan", "push", session, SharedData(file), "--scanner", "from-file", "--json"});
    EXPECT_EQ(pushed.exit_code, 0) << pushed.error;
    return Answer<v1::Scan>(pushed);
  }

  v1::Plan Plan(const std::string& session) {
    const Finished planned =
        Vantage(server_, {"plan", session, "--work", "3000000", "--seed", "1", "--json"});
    EXPECT_EQ(planned.exit_code, 0) << planned.out << planned.error;
    return Answer<v1::Plan>(planned);
  }

  std::string PriorFile(const Isometry3d& prior) {
    std::ofstream file(folder_.File("prior.txt"));
    file.precision(12);
    file << "room_scan2";
    for (int i = 0; i < 16; ++i) file << ' ' << prior.matrix()(i / 4, i % 4);
    file << '\n';
    return folder_.File("prior.txt");
  }

  ServerProcess server_;
  ScratchFolder folder_;
  Isometry3d T_scan1_scan2_ = Isometry3d::Identity();
};

TEST_F(RealScansTest, FromTheFirstScanToTheNextPositionTwice) {
  const v1::Scan first = PushFirst("home", "pcl_room_scan/room_scan1.ptx");
  ASSERT_EQ(first.state(), v1::SCAN_STATE_MERGED) << first.state_message();
  EXPECT_TRUE(first.levelling().found_floor());
  const Isometry3d T_world_scan1 = client::FromProto(first.pose());

  const v1::Plan plan1 = Plan("home");
  EXPECT_GT(plan1.result().views_size() + plan1.result().refused_size(), 0);
  for (const v1::RankedView& view : plan1.result().views()) {
    EXPECT_EQ(view.verdict().outcome(), v1::REGISTRATION_OUTCOME_REGISTERED);
    EXPECT_GE(view.score_upper(), view.score());
    EXPECT_LE(view.score_lower(), view.score());
  }

  // A prior that is 0.2 m and 5 degrees wrong.
  Isometry3d error = Isometry3d::Identity();
  error.linear() =
      Eigen::AngleAxisd(sensor::Radians(5), Vector3d(0.1, 0.1, 1).normalized()).toRotationMatrix();
  error.translation() = Vector3d(0.15, -0.12, 0.05).normalized() * 0.2;
  const Finished pushed = Vantage(
      server_, {"scan", "push", "home", SharedData("pcl_room_scan/room_scan2.ptx"), "--prior-file",
                PriorFile(T_world_scan1 * T_scan1_scan2_ * error), "--json"});
  EXPECT_EQ(pushed.exit_code, 0) << pushed.error;
  const auto second = Answer<v1::Scan>(pushed);
  ASSERT_EQ(second.state(), v1::SCAN_STATE_MERGED) << second.state_message();
  EXPECT_EQ(second.registration().verdict().outcome(), v1::REGISTRATION_OUTCOME_REGISTERED);
  const Isometry3d off =
      T_scan1_scan2_.inverse() * (T_world_scan1.inverse() * client::FromProto(second.pose()));
  EXPECT_LT(off.translation().norm(), 0.05);
  EXPECT_LT(sensor::Degrees(Eigen::AngleAxisd(off.linear()).angle()), 1.0);
  RecordProperty("off_mm", static_cast<int>(off.translation().norm() * 1000));

  const v1::Plan plan2 = Plan("home");
  EXPECT_GT(plan2.result().model_version(), plan1.result().model_version());
  EXPECT_GT(plan2.result().coverage().area_at_density_m2(),
            plan1.result().coverage().area_at_density_m2());

  // The body of the scanner and the blind cells beside it do not ban its own station.
  for (const v1::Scan& scan : {first, second}) {
    const v1::Vector3& at = scan.pose().translation();
    const Finished evaluated = Vantage(
        server_,
        {"evaluate", "home",
         std::to_string(at.x()) + "," + std::to_string(at.y()) + "," + std::to_string(at.z())});
    EXPECT_EQ(evaluated.exit_code, 0) << evaluated.out << evaluated.error;
  }
  EXPECT_EQ(server_.Stop(SIGTERM), 0) << server_.Log();
}

TEST_F(RealScansTest, WithdrawingAScanLeavesTheModelWithoutIt) {
  PushFirst("home", "pcl_room_scan/room_scan1.ptx");
  const auto export_to = [&](const std::string& name) {
    EXPECT_EQ(Vantage(server_, {"export", "home", "-o", folder_.File(name)}).exit_code, 0);
    return Contents(folder_.File(name));
  };
  const std::string before = export_to("before.ply");
  const v1::Scan first =
      Answer<v1::Scan>(Vantage(server_, {"scan", "show", "home/scan-1", "--json"}));
  const Finished pushed =
      Vantage(server_, {"scan", "push", "home", SharedData("pcl_room_scan/room_scan2.ptx"),
                        "--scanner", "from-file", "--prior-file",
                        PriorFile(client::FromProto(first.pose()) * T_scan1_scan2_), "--json"});
  ASSERT_EQ(pushed.exit_code, 0) << pushed.error;
  EXPECT_NE(export_to("with.ply"), before);
  const std::string name = Answer<v1::Scan>(pushed).name();
  ASSERT_EQ(Vantage(server_, {"scan", "withdraw", name}).exit_code, 0);
  // Taking out is queued behind the answer; the plan after it sees the model without the scan.
  Plan("home");
  EXPECT_EQ(export_to("after.ply"), before);
}

TEST_F(RealScansTest, PtxAndPcdGiveTheSameModel) {
  PushFirst("from-ptx", "pcl_room_scan/room_scan1.ptx");
  PushFirst("from-pcd", "pcl_room_scan/room_scan1.pcd");
  // The PTX carries coordinates in text: a sample on the edge of a voxel may fall to either side.
  std::vector<std::set<std::tuple<int, int, int, int>>> models;
  for (const std::string session : {"from-ptx", "from-pcd"}) {
    ASSERT_EQ(Vantage(server_, {"export", session, "-o", folder_.File("model.ply")}).exit_code, 0);
    const auto surfaces = picture::ParseSurfacePly(Contents(folder_.File("model.ply")));
    ASSERT_TRUE(surfaces.ok()) << surfaces.status();
    models.emplace_back();
    for (const picture::SurfaceElement& e : *surfaces) {
      const Eigen::Array3i voxel = (e.position.array() / 0.05f).floor().cast<int>();
      models.back().emplace(voxel.x(), voxel.y(), voxel.z(), static_cast<int>(e.kind));
    }
  }
  size_t common = 0;
  for (const auto& voxel : models[0]) common += models[1].count(voxel);
  const double united = static_cast<double>(models[0].size() + models[1].size() - common);
  EXPECT_GT(models[0].size(), 10'000u);
  EXPECT_GT(static_cast<double>(common) / united, 0.999);
}

}  // namespace
}  // namespace vantage::integration

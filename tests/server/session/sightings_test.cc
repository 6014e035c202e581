// Targets that scans saw, as sessions use them.
#include "server/session/sightings.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "core/sensor/encoding.h"
#include "server/contract/error.h"
#include "server/store/memory_store.h"
#include "tests/core/registration/box_scene.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::session {
namespace {

void Write(const Eigen::Vector3d& from, v1::Vector3& to) {
  to.set_x(from.x());
  to.set_y(from.y());
  to.set_z(from.z());
}

// A target at a place in the world as a scanner at `pose` sees it.
v1::TargetSighting Sighting(const std::string& name, const Eigen::Vector3d& in_world,
                            const Eigen::Isometry3d& pose, bool surveyed = false) {
  v1::TargetSighting sighting;
  sighting.set_name(name);
  Write(pose.inverse() * in_world, *sighting.mutable_in_scan());
  if (surveyed) Write(in_world, *sighting.mutable_in_world());
  return sighting;
}

class SightingsTest : public testing::Test {
 protected:
  v1::Scan Send(Session& session, const std::string& encoded, const v1::PosePrior* prior,
                const std::vector<v1::TargetSighting>& targets) {
    const auto upload = fixture::SendScan(session, encoded, prior, "", "", targets);
    EXPECT_TRUE(upload.ok()) << upload.status();
    if (!upload.ok()) return {};
    session.WaitUntilIdle();
    return session.scans().Get(upload->scan()).value();
  }
  store::MemoryStore store_{size_t{256} << 20};
};

TEST_F(SightingsTest, AreTiedToWhereEarlierScansSawThem) {
  fixture::Script script;
  fixture::SessionHost host(store_, script.Make());
  const auto session = fixture::OpenSession(host.registry, "job");
  const Eigen::Isometry3d first = registration::PoseAt({2, 1.5, 1.4}, 0);
  const v1::PosePrior at_first = fixture::PriorAt(2, 1.5, 1.4);
  Send(*session, fixture::EncodedRoom({2, 1.5, 1.4}), &at_first,
       {Sighting("T1", {4.9, 1, 2}, first), Sighting("T2", {0.1, 3, 1}, first)});
  EXPECT_TRUE(script.Targets().empty());
  const v1::PosePrior near = fixture::PriorAt(3, 2.5, 1.4);
  v1::TargetSighting vague = Sighting("T2", {0.1, 3, 1}, registration::PoseAt({3, 2.5, 1.4}, 0));
  vague.set_sigma_m(0.01);
  const v1::Scan scan =
      Send(*session, fixture::EncodedRoom({3, 2.5, 1.4}), &near,
           {vague, Sighting("new", {1, 1, 1}, first),
            Sighting("C", {3, 3, 2}, registration::PoseAt({3, 2.5, 1.4}, 0), true)});
  EXPECT_EQ(scan.state(), v1::SCAN_STATE_MERGED) << scan.state_message();
  EXPECT_EQ(scan.targets_size(), 3);
  const std::vector<registration::TargetTie> ties = script.Targets();
  ASSERT_EQ(ties.size(), 2u);
  EXPECT_EQ(ties[0].name, "T2");
  EXPECT_LT((ties[0].in_world - Eigen::Vector3d(0.1, 3, 1)).norm(), 1e-9);
  EXPECT_DOUBLE_EQ(ties[0].sigma, 0.01);
  EXPECT_EQ(ties[1].name, "C");
  EXPECT_LT((ties[1].in_world - Eigen::Vector3d(3, 3, 2)).norm(), 1e-9);
  EXPECT_DOUBLE_EQ(ties[1].sigma, 0.002);
}

TEST_F(SightingsTest, OfWithdrawnScansSayNothing) {
  fixture::Script script;
  fixture::SessionHost host(store_, script.Make());
  const auto session = fixture::OpenSession(host.registry, "job");
  const v1::PosePrior at = fixture::PriorAt(2, 1.5, 1.4);
  Send(*session, fixture::EncodedRoom({2, 1.5, 1.4}), &at, {});
  const v1::Scan gone = Send(*session, fixture::EncodedRoom({2.5, 1.5, 1.4}), &at,
                             {Sighting("T1", {4.9, 1, 2}, registration::PoseAt({2, 1.5, 1.4}, 0))});
  ASSERT_TRUE(session->scans().Withdraw(gone.name(), {}).ok());
  session->WaitUntilIdle();
  Send(*session, fixture::EncodedRoom({3, 1.5, 1.4}), &at,
       {Sighting("T1", {4.9, 1, 2}, registration::PoseAt({3, 1.5, 1.4}, 0))});
  EXPECT_TRUE(script.Targets().empty());
}

TEST_F(SightingsTest, ThreeOfAControlNetworkPlaceTheFirstScan) {
  fixture::Script script;
  fixture::SessionHost host(store_, script.Make());
  v1::CreateSessionRequest create;
  create.set_session_id("job");
  create.mutable_session()->mutable_origin()->set_x(5000);
  create.mutable_session()->mutable_model_config()->set_voxel_size_m(0.1);
  const auto session = host.registry.Create(create).value();
  const Eigen::Isometry3d truth = registration::PoseAt({5012, -3, 1.6}, 0.7, 0.01, -0.02);
  std::vector<v1::TargetSighting> targets = {Sighting("A", {5014, -2, 2}, truth, true),
                                             Sighting("B", {5011, -5, 1}, truth, true),
                                             Sighting("C", {5010, -1, 0.5}, truth, true)};
  const v1::Scan scan = Send(*session, fixture::EncodedRoom({2, 1.5, 1.4}), nullptr, targets);
  ASSERT_EQ(scan.state(), v1::SCAN_STATE_MERGED) << scan.state_message();
  EXPECT_NEAR(scan.pose().translation().x(), 5012, 1e-6);
  EXPECT_NEAR(scan.pose().translation().y(), -3, 1e-6);
  EXPECT_NEAR(scan.pose().rotation().w(), Eigen::Quaterniond(truth.linear()).w(), 1e-6);

  const auto second = fixture::OpenSession(host.registry, "confused");
  targets[1].mutable_in_world()->set_x(5011.1);
  const v1::Scan refused = Send(*second, fixture::EncodedRoom({2, 1.5, 1.4}), nullptr, targets);
  EXPECT_EQ(refused.state(), v1::SCAN_STATE_FAILED);
  EXPECT_NE(refused.state_message().find("target '"), std::string::npos) << refused.state_message();
}

// What plans are told for their advice on targets.
TEST_F(SightingsTest, OfScansInTheModelAreKnown) {
  SessionState state;
  const Eigen::Vector3d origin(100, 0, 0);
  const Eigen::Isometry3d pose = registration::PoseAt({102, 1.5, 1.4}, 0);
  const auto add = [&](const std::string& name, bool in_model, double bound,
                       const v1::TargetSighting& sighting) {
    ScanRecord& record = state.scans[name];
    record.in_model = in_model;
    record.scan.set_name(name);
    Write({102, 1.5, 1.4}, *record.scan.mutable_pose()->mutable_translation());
    record.scan.mutable_pose()->mutable_rotation()->set_w(1);
    record.scan.mutable_registration()->mutable_verdict()->set_error_bound_m(bound);
    *record.scan.add_targets() = sighting;
    state.scan_order.push_back(name);
  };
  add("a", true, 0.00392, Sighting("T1", {105, 1, 2}, pose));
  add("b", false, 0, Sighting("T2", {105, 1, 2}, pose));
  add("c", true, 0.00392, Sighting("C", {103, 3, 2}, pose, true));
  const std::vector<registration::KnownTarget> known = KnownTargetsOf(state, origin);
  ASSERT_EQ(known.size(), 2u);
  EXPECT_EQ(known[0].name, "C");
  EXPECT_LT((known[0].in_world - Eigen::Vector3d(3, 3, 2)).norm(), 1e-9);
  EXPECT_DOUBLE_EQ(known[0].sigma, 0.002);
  EXPECT_EQ(known[1].name, "T1");
  EXPECT_LT((known[1].in_world - Eigen::Vector3d(5, 1, 2)).norm(), 1e-9);
  EXPECT_NEAR(known[1].sigma, std::hypot(0.002, 0.002), 1e-9);
  const std::vector<planning::ScannedFrom> from = ScannedFromOf(state, origin);
  ASSERT_EQ(from.size(), 2u);
  EXPECT_EQ(from[0].name, "a");
  EXPECT_EQ(from[1].name, "c");
  EXPECT_LT((from[0].position - Eigen::Vector3d(2, 1.5, 1.4)).norm(), 1e-9);
  EXPECT_EQ(from[0].error_bound, 0.00392);
}

// The whole of it: a bare corridor leaves its axis open, and two targets that the first scan saw
// too cure it.
TEST_F(SightingsTest, TwoCureACorridor) {
  fixture::SessionHost host(store_, Algorithms::Core());
  const auto session = fixture::OpenSession(host.registry, "corridor");
  const Eigen::Isometry3d first = registration::PoseAt({0, 0, 1.4}, 0);
  const Eigen::Isometry3d truth = registration::PoseAt({1.5, 0.2, 1.4}, 0.4);
  const Eigen::Vector3d t1(4, -1, 1.2);
  const Eigen::Vector3d t2(-2, 1, 1.7);
  const v1::PosePrior at_first = fixture::PriorAt(0, 0, 1.4);
  Send(*session,
       sensor::EncodeRangeImage(
           registration::ScanScene(registration::Corridor(), first, {}, 3).image),
       &at_first, {Sighting("T1", t1, first), Sighting("T2", t2, first)});
  v1::PosePrior off = fixture::PriorAt(1.7, 0.2, 1.4);
  off.mutable_pose()->mutable_rotation()->set_w(std::cos(0.2));
  off.mutable_pose()->mutable_rotation()->set_z(std::sin(0.2));
  const std::string second = sensor::EncodeRangeImage(
      registration::ScanScene(registration::Corridor(), truth, {}, 4).image);
  const v1::Scan without = Send(*session, second, &off, {});
  EXPECT_EQ(without.state(), v1::SCAN_STATE_FAILED) << without.state_message();
  const v1::Scan with =
      Send(*session, second, &off, {Sighting("T1", t1, truth), Sighting("T2", t2, truth)});
  ASSERT_EQ(with.state(), v1::SCAN_STATE_MERGED) << with.state_message();
  EXPECT_EQ(with.registration().verdict().basis(), v1::REGISTRATION_BASIS_TARGETS);
  EXPECT_NEAR(with.pose().translation().x(), 1.5, 0.004);
}

}  // namespace
}  // namespace vantage::session

// The chain of scans closes: poses are adjusted together and what moved is merged anew, as if the
// scans had stood there from the start.
#include "server/session/pose_adjuster.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <future>
#include <memory>
#include <numeric>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/bytes/checksum.h"
#include "google/protobuf/util/message_differencer.h"
#include "server/conversion/to_proto.h"
#include "server/session/export.h"
#include "server/store/memory_store.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"
#include "tests/support/runs.h"

namespace vantage::session {
namespace {

using google::protobuf::util::MessageDifferencer;

constexpr int kScans = 5;

std::string ScanNamed(int i) { return absl::StrCat("sessions/job/scans/scan-", i + 1); }

// A ring of scans in one room, each off by a step more than the one before it, so that all fit
// their neighbours and the last does not fit the first.
struct Ring {
  explicit Ring(const Eigen::Vector3d& drift) {
    for (int i = 0; i < kScans; ++i) {
      const double angle = 2 * M_PI * i / kScans;
      truth.push_back({2.5 + 1.4 * std::cos(angle), 2 + 1.3 * std::sin(angle), 1.4});
      registered.push_back(truth.back() + i * drift);
    }
  }
  fixture::Script::Ties Ties() const {
    fixture::Script::Ties ties;
    const auto tie = [&](int a, int b, const Eigen::Vector3d& apart) {
      ties[{ScanNamed(a), ScanNamed(b)}] = Eigen::Isometry3d(Eigen::Translation3d(apart));
    };
    for (int i = 0; i + 1 < kScans; ++i) tie(i, i + 1, registered[i + 1] - registered[i]);
    tie(0, kScans - 1, truth[kScans - 1] - truth[0]);
    return ties;
  }

  std::vector<Eigen::Vector3d> truth;
  std::vector<Eigen::Vector3d> registered;
};

const Eigen::Vector3d kDrift(0.012, -0.008, 0.004);

v1::PosePrior PriorOf(const Eigen::Vector3d& position) {
  return fixture::PriorAt(position.x(), position.y(), position.z());
}

// All that planners see of a model, but for its version.
std::string BytesOf(Session& session) {
  const ModelSnapshot model = session.model().Current();
  if (model.view == nullptr) return "none";
  std::string out;
  for (const model::BrickAt& at : model.view->bricks()) {
    absl::StrAppend(&out, at.brick.x(), " ", at.brick.y(), " ", at.brick.z(), " ");
    for (const model::VoxelState state : at.contents->state) {
      out += static_cast<char>('0' + static_cast<int>(state));
    }
    for (const model::SurfaceVoxel& voxel : at.contents->surface) {
      out.append(reinterpret_cast<const char*>(&voxel.centroid), sizeof(voxel.centroid));
      out.append(reinterpret_cast<const char*>(&voxel.normal), sizeof(voxel.normal));
      out.append(reinterpret_cast<const char*>(&voxel.density), sizeof(voxel.density));
      absl::StrAppend(&out, voxel.samples, " ", voxel.missed);
    }
  }
  for (const model::Station& station : model.view->stations()) {
    out.append(reinterpret_cast<const char*>(station.position.data()), sizeof(double) * 3);
  }
  return out;
}

std::vector<std::string> PosesIn(Session& session) {
  bool more = false;
  std::vector<std::string> poses;
  const std::vector<v1::Scan> scans = session.scans().List("", 100, more).value();
  for (const v1::Scan& scan : scans) {
    const bool in_model = scan.state() == v1::SCAN_STATE_MERGED;
    poses.push_back(in_model ? absl::StrCat(scan.name(), scan.pose().SerializeAsString(),
                                            scan.adjustment().SerializeAsString())
                             : "");
  }
  return poses;
}

std::vector<v1::PosesAdjustedEvent> AdjustmentsIn(Session& session) {
  std::vector<v1::PosesAdjustedEvent> adjustments;
  const std::vector<v1::SessionEvent> events = session.journal().Events(0, 1000).value();
  for (const v1::SessionEvent& event : events) {
    if (event.has_poses_adjusted()) adjustments.push_back(event.poses_adjusted());
  }
  return adjustments;
}

class PoseAdjusterTest : public testing::Test {
 protected:
  explicit PoseAdjusterTest(const Eigen::Vector3d& drift = kDrift) : ring_(drift) {
    script_.TieScans(ring_.Ties());
    Start();
  }
  void Start() {
    host_ = std::make_unique<fixture::SessionHost>(store_, script_.Make());
    session_ =
        host_->registry.Find("job").ok() ? nullptr : fixture::OpenSession(host_->registry, "job");
  }
  void Restart() {
    session_.reset();
    host_.reset();
    host_ = std::make_unique<fixture::SessionHost>(store_, script_.Make());
    session_ = fixture::LoadSession(host_->registry, "job");
  }
  std::string Send(int i) {
    const v1::PosePrior prior = PriorOf(ring_.registered[static_cast<size_t>(i)]);
    const auto upload = fixture::SendScan(
        *session_, fixture::EncodedRoom(ring_.truth[static_cast<size_t>(i)], 4), &prior);
    EXPECT_TRUE(upload.ok()) << upload.status();
    session_->WaitUntilIdle();
    return upload->scan();
  }
  void SendAll() {
    for (int i = 0; i < kScans; ++i) Send(i);
  }
  v1::Scan Scan(int i) { return session_->scans().Get(ScanNamed(i)).value(); }
  void Withdraw(int i) {
    ASSERT_TRUE(session_->scans().Withdraw(ScanNamed(i), {}).ok());
    session_->WaitUntilIdle();
  }

  const Ring ring_;
  store::MemoryStore store_{size_t{256} << 20};
  fixture::Script script_;
  std::unique_ptr<fixture::SessionHost> host_;
  std::shared_ptr<Session> session_;
};

// What does not close is shared out among equal links: each scan is off by its place in the ring,
// over their number, of what it was.
TEST_F(PoseAdjusterTest, WhatTheLoopDoesNotCloseIsSharedOut) {
  for (int i = 0; i + 1 < kScans; ++i) Send(i);
  EXPECT_TRUE(AdjustmentsIn(*session_).empty()) << "each fits its neighbour";
  Send(kScans - 1);
  const std::vector<v1::PosesAdjustedEvent> adjustments = AdjustmentsIn(*session_);
  ASSERT_EQ(adjustments.size(), 1U);
  EXPECT_EQ(adjustments[0].poses_size(), kScans);
  EXPECT_EQ(adjustments[0].moved_count(), kScans - 1);
  EXPECT_EQ(adjustments[0].most_moved_scan(), ScanNamed(kScans - 1));
  for (int i = 0; i < kScans; ++i) {
    const v1::Scan scan = Scan(i);
    const Eigen::Vector3d at = conversion::ReadOwnVector(scan.pose().translation());
    const Eigen::Vector3d expected = ring_.truth[static_cast<size_t>(i)] + i * kDrift / kScans;
    EXPECT_LT((at - expected).norm(), 2e-4) << scan.name();
    EXPECT_EQ(adjustments[0].poses(i).scan(), scan.name());
    EXPECT_TRUE(MessageDifferencer::Equals(adjustments[0].poses(i).pose(), scan.pose()));
    EXPECT_EQ(scan.has_adjustment(), i > 0) << "the first one holds the others";
    if (i == 0) continue;
    EXPECT_TRUE(
        MessageDifferencer::Equals(adjustments[0].poses(i).adjustment(), scan.adjustment()));
    const Eigen::Vector3d before =
        conversion::ReadOwnVector(scan.adjustment().unadjusted_pose().translation());
    EXPECT_LT((before - ring_.registered[static_cast<size_t>(i)]).norm(), 1e-12);
    EXPECT_EQ(scan.adjustment().covariance_size(), 36);
    EXPECT_GT(scan.adjustment().position_sigma_m(), 0.3 * fixture::Script::kTieSigma);
    EXPECT_TRUE(scan.adjustment().has_worst_link());
  }
  EXPECT_EQ(session_->Describe().model_version(), adjustments[0].model_version());
  EXPECT_EQ(session_->model().Current().version, adjustments[0].model_version());
}

// In another session all scans are set where these ended.
TEST_F(PoseAdjusterTest, TheModelIsAsIfScansHadStoodThereFromTheStart) {
  SendAll();
  store::MemoryStore store(size_t{256} << 20);
  fixture::Script script;
  fixture::SessionHost host(store, script.Make());
  const auto other = fixture::OpenSession(host.registry, "other");
  for (int i = 0; i < kScans; ++i) {
    const v1::PosePrior prior = PriorOf(ring_.registered[static_cast<size_t>(i)]);
    if (i > 0) script.SetVerdict(registration::RegistrationOutcome::kDoubtful);
    const std::string name =
        fixture::SendScan(*other, fixture::EncodedRoom(ring_.truth[static_cast<size_t>(i)], 4),
                          &prior)
            .value()
            .scan();
    other->WaitUntilIdle();
    if (i == 0) continue;
    v1::PosePrior set;
    *set.mutable_pose() = Scan(i).pose();
    ASSERT_TRUE(other->scans().SetPose(name, set, true, {}).ok());
    other->WaitUntilIdle();
  }
  EXPECT_EQ(BytesOf(*session_), BytesOf(*other));
}

TEST_F(PoseAdjusterTest, ARestartFindsTheSame) {
  SendAll();
  const std::string model = BytesOf(*session_);
  const std::vector<std::string> poses = PosesIn(*session_);
  const uint64_t version = session_->model().Current().version;
  Restart();
  EXPECT_EQ(BytesOf(*session_), model);
  EXPECT_EQ(PosesIn(*session_), poses);
  EXPECT_EQ(session_->model().Current().version, version);
  EXPECT_EQ(AdjustmentsIn(*session_).size(), 1U) << "nothing is computed again";
}

TEST_F(PoseAdjusterTest, WithdrawingTheScanThatClosedTheLoopGivesBackWhatWas) {
  for (int i = 0; i + 1 < kScans; ++i) Send(i);
  const std::string model = BytesOf(*session_);
  std::vector<std::string> poses = PosesIn(*session_);
  Send(kScans - 1);
  EXPECT_NE(BytesOf(*session_), model);
  Withdraw(kScans - 1);
  poses.emplace_back();
  EXPECT_EQ(PosesIn(*session_), poses);
  EXPECT_EQ(BytesOf(*session_), model);
  ASSERT_EQ(AdjustmentsIn(*session_).size(), 2U);
  EXPECT_FALSE(AdjustmentsIn(*session_)[1].poses(1).has_adjustment());
  Restart();
  EXPECT_EQ(BytesOf(*session_), model);
  EXPECT_EQ(PosesIn(*session_), poses);
}

// Whatever order people accept scans in, and whatever they withdraw in between.
TEST_F(PoseAdjusterTest, PosesAndModelFollowFromTheSetOfScans) {
  struct Ended {
    std::string model;
    std::vector<std::string> poses;
  };
  const auto run = [&](uint64_t seed) {
    store::MemoryStore store(size_t{256} << 20);
    fixture::SessionHost host(store, script_.Make());
    const auto session = fixture::OpenSession(host.registry, "job");
    const auto send = [&](int i) {
      const v1::PosePrior prior = PriorOf(ring_.registered[static_cast<size_t>(i)]);
      EXPECT_TRUE(fixture::SendScan(*session,
                                    fixture::EncodedRoom(ring_.truth[static_cast<size_t>(i)], 4),
                                    &prior)
                      .ok());
      session->WaitUntilIdle();
    };
    script_.SetVerdict(registration::RegistrationOutcome::kDoubtful);
    for (int i = 0; i < kScans; ++i) send(i);
    // One more of the first place, that comes and goes.
    send(0);
    std::vector<int> order(kScans);
    std::iota(order.begin(), order.end(), 1);
    std::mt19937_64 random(seed);
    if (seed > 0) std::shuffle(order.begin(), order.end(), random);
    for (const int i : order) {
      EXPECT_TRUE(session->scans().Accept(ScanNamed(i), {}, {}).ok());
      session->WaitUntilIdle();
    }
    EXPECT_TRUE(session->scans().Withdraw(ScanNamed(kScans), {}).ok());
    session->WaitUntilIdle();
    std::string model = BytesOf(*session);
    // Where scanners stood is told in the order in which they came.
    model.resize(model.size() - sizeof(double) * 3 * kScans);
    return Ended{model, PosesIn(*session)};
  };
  const Ended expected = run(0);
  EXPECT_GT(expected.model.size(), 100'000U);
  for (uint64_t seed = 1; seed <= test_support::Runs(4U); ++seed) {
    const Ended ended = run(seed);
    EXPECT_EQ(ended.poses, expected.poses) << "seed " << seed;
    EXPECT_EQ(ended.model, expected.model) << "seed " << seed;
  }
}

// A person's pose is not touched; the others go on without it.
TEST_F(PoseAdjusterTest, ScansThatPeopleSetStayWhereTheyAre) {
  for (int i = 0; i + 1 < kScans; ++i) Send(i);
  v1::PosePrior set = PriorOf(ring_.registered[2] + Eigen::Vector3d(0.02, 0, 0));
  ASSERT_TRUE(session_->scans().SetPose(ScanNamed(2), set, true, {}).ok());
  session_->WaitUntilIdle();
  Send(kScans - 1);
  EXPECT_TRUE(MessageDifferencer::Equals(Scan(2).pose(), set.pose()));
  EXPECT_FALSE(Scan(2).has_adjustment());
  const std::vector<v1::PosesAdjustedEvent> adjustments = AdjustmentsIn(*session_);
  ASSERT_FALSE(adjustments.empty());
  for (const v1::AdjustedPose& adjusted : adjustments.back().poses()) {
    EXPECT_NE(adjusted.scan(), ScanNamed(2));
  }
}

// A scan that came after the loop had closed goes back with the one that it was registered beside.
TEST_F(PoseAdjusterTest, WhatWasRegisteredBesideAMovedScanGoesAlong) {
  SendAll();
  const v1::Scan beside = Scan(kScans - 2);
  const Eigen::Vector3d moved = conversion::ReadOwnVector(beside.pose().translation());
  const Eigen::Vector3d apart(0.1, 0.05, 0.0);
  const v1::PosePrior prior = PriorOf(moved + apart);
  const std::string leaf =
      fixture::SendScan(*session_, fixture::EncodedRoom(ring_.truth[kScans - 2] + apart, 4), &prior)
          .value()
          .scan();
  session_->WaitUntilIdle();
  EXPECT_EQ(session_->scans().Get(leaf)->pose_reference().scan(), beside.name());
  Withdraw(kScans - 1);
  const v1::Scan now = session_->scans().Get(leaf).value();
  const Eigen::Vector3d at = conversion::ReadOwnVector(now.pose().translation());
  EXPECT_LT((at - ring_.registered[kScans - 2] - apart).norm(), 2e-5);
  EXPECT_TRUE(now.has_adjustment());
  EXPECT_EQ(now.adjustment().covariance_size(), 0);
}

class SmallDriftTest : public PoseAdjusterTest {
 protected:
  SmallDriftTest() : PoseAdjusterTest(Eigen::Vector3d(0.0005, 0, 0)) {}
};

// 2 mm where 10 mm are required.
TEST_F(SmallDriftTest, WhatDoesNotMatterMovesNothing) {
  SendAll();
  EXPECT_TRUE(AdjustmentsIn(*session_).empty());
  EXPECT_FALSE(Scan(kScans - 1).has_adjustment());
}

// A pose that is believed holds the others, where the first scan's was a guess.
TEST_F(PoseAdjusterTest, ControlHoldsAllThatIsTiedToIt) {
  for (int i = 0; i + 1 < kScans; ++i) Send(i);
  v1::PosePrior control = PriorOf(ring_.truth[kScans - 1]);
  for (int i = 0; i < 36; ++i) control.add_covariance(i % 7 == 0 ? 1e-8 : 0);
  control.set_trusted(true);
  const auto sent =
      fixture::SendScan(*session_, fixture::EncodedRoom(ring_.truth[kScans - 1], 4), &control);
  ASSERT_TRUE(sent.ok()) << sent.status();
  session_->WaitUntilIdle();
  ASSERT_EQ(AdjustmentsIn(*session_).size(), 1U);
  EXPECT_EQ(Scan(kScans - 1).pose_source(), v1::POSE_SOURCE_TRUSTED_PRIOR);
  // The ring does not close: its links share that out, seen from the control.
  for (int i = 0; i < kScans; ++i) {
    const Eigen::Vector3d at = conversion::ReadOwnVector(Scan(i).pose().translation());
    const Eigen::Vector3d expected =
        ring_.truth[static_cast<size_t>(i)] + (i - (kScans - 1)) * kDrift / kScans;
    EXPECT_LT((at - expected).norm(), 5e-4) << i;
  }
}

// Three targets of a control network, which the last scan sees, hold the chain where the network
// is: all poses move, are told, and go back when that scan is withdrawn.
TEST_F(PoseAdjusterTest, ControlTargetsMoveAllAndWithdrawingThemGivesBackWhatWas) {
  fixture::Script script;
  fixture::Script::Ties chain = ring_.Ties();
  chain.erase({ScanNamed(0), ScanNamed(kScans - 1)});  // it never closes
  script.TieScans(chain);
  store::MemoryStore store(size_t{256} << 20);
  fixture::SessionHost host(store, script.Make());
  const auto session = fixture::OpenSession(host.registry, "job");
  const auto send = [&](int i, const std::vector<v1::TargetSighting>& targets) {
    const Eigen::Vector3d truth = ring_.truth[static_cast<size_t>(i)];
    const v1::PosePrior prior = PriorOf(ring_.registered[static_cast<size_t>(i)]);
    const auto sent =
        fixture::SendScan(*session, fixture::EncodedRoom(truth, 4), &prior, "", "", targets);
    ASSERT_TRUE(sent.ok()) << sent.status();
    session->WaitUntilIdle();
  };
  for (int i = 0; i + 1 < kScans; ++i) send(i, {});
  ASSERT_TRUE(AdjustmentsIn(*session).empty());
  const std::string model = BytesOf(*session);
  std::vector<std::string> poses = PosesIn(*session);
  const Eigen::Vector3d last = ring_.truth[kScans - 1];
  std::vector<v1::TargetSighting> targets;
  for (const Eigen::Vector3d& in_world :
       {Eigen::Vector3d(4.9, 1, 2), Eigen::Vector3d(0.1, 3, 1), Eigen::Vector3d(2, 0.1, 1.5)}) {
    v1::TargetSighting& sighting = targets.emplace_back();
    sighting.set_name(absl::StrCat("C", targets.size()));
    sighting.set_sigma_m(0.0002);
    const auto write = [](const Eigen::Vector3d& from, v1::Vector3& to) {
      to.set_x(from.x());
      to.set_y(from.y());
      to.set_z(from.z());
    };
    write(in_world - last, *sighting.mutable_in_scan());
    write(in_world, *sighting.mutable_in_world());
  }
  send(kScans - 1, targets);
  const std::vector<v1::PosesAdjustedEvent> adjustments = AdjustmentsIn(*session);
  ASSERT_EQ(adjustments.size(), 1U);
  EXPECT_EQ(adjustments[0].moved_count(), kScans) << "the first one, too";
  for (int i = 0; i < kScans; ++i) {
    const v1::Scan scan = session->scans().Get(ScanNamed(i)).value();
    const Eigen::Vector3d at = conversion::ReadOwnVector(scan.pose().translation());
    const Eigen::Vector3d expected =
        ring_.truth[static_cast<size_t>(i)] + (i - (kScans - 1)) * kDrift;
    EXPECT_LT((at - expected).norm(), 1e-3) << i;
  }
  EXPECT_NE(BytesOf(*session), model);

  ASSERT_TRUE(session->scans().Withdraw(ScanNamed(kScans - 1), {}).ok());
  session->WaitUntilIdle();
  ASSERT_EQ(AdjustmentsIn(*session).size(), 2U);
  EXPECT_EQ(AdjustmentsIn(*session)[1].moved_count(), kScans - 1);
  poses.emplace_back();
  EXPECT_EQ(PosesIn(*session), poses);
  EXPECT_EQ(BytesOf(*session), model);
}

// Scans of earlier releases, of which no links are known, stay: what comes now goes to them.
TEST_F(PoseAdjusterTest, ScansWithoutLinksOfTheirOwnTimeStay) {
  fixture::Script earlier;
  session_.reset();
  host_.reset();
  store::MemoryStore store(size_t{256} << 20);
  {
    host_ = std::make_unique<fixture::SessionHost>(store, earlier.Make());
    session_ = fixture::OpenSession(host_->registry, "job");
    for (int i = 0; i + 1 < kScans; ++i) Send(i);
    session_.reset();
    host_.reset();
  }
  host_ = std::make_unique<fixture::SessionHost>(store, script_.Make());
  session_ = fixture::LoadSession(host_->registry, "job");
  EXPECT_TRUE(AdjustmentsIn(*session_).empty());
  Send(kScans - 1);
  for (int i = 0; i + 1 < kScans; ++i) EXPECT_FALSE(Scan(i).has_adjustment()) << i;
  const Eigen::Vector3d at = conversion::ReadOwnVector(Scan(kScans - 1).pose().translation());
  const Eigen::Vector3d between = (ring_.truth[kScans - 1] + ring_.registered[kScans - 1]) / 2;
  EXPECT_LT((at - between).norm(), 2e-4);
  session_.reset();
  host_.reset();
}

// What a snapshot has of scans that were moved since is moved, and stays where it was in the order:
// scan 3 belongs to no loop.
TEST_F(PoseAdjusterTest, ASnapshotFromBeforeIsBroughtUpToDate) {
  fixture::Script script;
  const auto apart = [&](size_t a, size_t b, const Eigen::Vector3d& off) {
    return Eigen::Isometry3d(Eigen::Translation3d(ring_.registered[b] - ring_.registered[a] + off));
  };
  script.TieScans({{{ScanNamed(0), ScanNamed(1)}, apart(0, 1, Eigen::Vector3d::Zero())},
                   {{ScanNamed(1), ScanNamed(3)}, apart(1, 3, Eigen::Vector3d::Zero())},
                   {{ScanNamed(0), ScanNamed(3)}, apart(0, 3, {0.04, 0, 0})}});
  session_.reset();
  host_.reset();
  store::MemoryStore store(size_t{256} << 20);
  host_ = std::make_unique<fixture::SessionHost>(store, script.Make());
  session_ = fixture::OpenSession(host_->registry, "job");
  for (int i = 0; i < 3; ++i) Send(i);
  const std::vector<store::SnapshotRecord> snapshots = store.Snapshots("job").value();
  ASSERT_FALSE(snapshots.empty());
  const std::string snapshot = store.GetBlob(snapshots.front().blob).value();
  Send(3);
  EXPECT_TRUE(Scan(1).has_adjustment());
  EXPECT_FALSE(Scan(2).has_adjustment());
  const std::string model = BytesOf(*session_);

  store::MemoryStore with_old_snapshot(size_t{256} << 20);
  const std::vector<storage::v1::LogEntry> log = store.Read("job", 0, 1000).value();
  for (const storage::v1::LogEntry& entry : log) {
    if (!entry.blob().empty()) {
      ASSERT_TRUE(with_old_snapshot.PutBlob(store.GetBlob(entry.blob()).value()).ok());
    }
    ASSERT_TRUE(with_old_snapshot.Append("job", entry).ok());
  }
  ASSERT_TRUE(with_old_snapshot.PutBlob(snapshot).ok());
  ASSERT_TRUE(with_old_snapshot.PutSnapshot("job", snapshots.front()).ok());
  fixture::SessionHost host(with_old_snapshot, script.Make());
  const auto loaded = fixture::LoadSession(host.registry, "job");
  EXPECT_EQ(BytesOf(*loaded), model);
  session_.reset();
  host_.reset();
}

// The log says that poses are due, and the server stopped before they were adjusted.
TEST_F(PoseAdjusterTest, WhatACrashCutOffIsDoneAfterTheRestart) {
  SendAll();
  const std::string model = BytesOf(*session_);
  const std::vector<std::string> poses = PosesIn(*session_);
  std::vector<storage::v1::LogEntry> log = store_.Read("job", 0, 1000).value();
  ASSERT_TRUE(log.back().event().has_poses_adjusted());
  store::MemoryStore crashed(size_t{256} << 20);
  log.pop_back();
  for (const storage::v1::LogEntry& entry : log) {
    if (!entry.blob().empty()) {
      ASSERT_TRUE(crashed.PutBlob(store_.GetBlob(entry.blob()).value()).ok());
    }
    ASSERT_TRUE(crashed.Append("job", entry).ok());
  }
  fixture::SessionHost host(crashed, script_.Make());
  const auto session = fixture::LoadSession(host.registry, "job");
  EXPECT_EQ(AdjustmentsIn(*session).size(), 1U);
  EXPECT_EQ(BytesOf(*session), model);
  EXPECT_EQ(PosesIn(*session), poses);
}

// An archive takes links and adjusted poses along: there a scan that is withdrawn gives back what
// was, too.
TEST_F(PoseAdjusterTest, AnArchiveTakesThemAlong) {
  for (int i = 0; i + 1 < kScans; ++i) Send(i);
  const std::string before = BytesOf(*session_);
  Send(kScans - 1);
  v1::ExportModelRequest request;
  request.set_format(v1::EXPORT_FORMAT_ARCHIVE);
  const auto source = Export::Create(session_, request).value();
  v1::ImportSessionRequest import;
  import.set_request_id("import");
  import.set_session_id("elsewhere");
  for (std::string part = source->Next().value(); !part.empty(); part = source->Next().value()) {
    import.mutable_data()->append(part);
  }
  import.set_crc32c(bytes::Crc32c(import.data()));
  store::MemoryStore store(size_t{256} << 20);
  fixture::SessionHost host(store, script_.Make());
  const auto imported = host.registry.Import(import, "");
  ASSERT_TRUE(imported.ok()) << imported.status();
  const auto there = host.registry.Find("elsewhere").value();
  there->WaitUntilIdle();
  EXPECT_EQ(BytesOf(*there), BytesOf(*session_));
  ASSERT_TRUE(there->scans().Withdraw("sessions/elsewhere/scans/scan-5", {}).ok());
  there->WaitUntilIdle();
  EXPECT_EQ(BytesOf(*there), before);
}

// Whose data are erased some time after the withdrawal left no trace before.
TEST_F(PoseAdjusterTest, AnErasedScanStaysWithoutConsequence) {
  SendAll();
  Withdraw(2);
  const std::string model = BytesOf(*session_);
  const std::vector<std::string> poses = PosesIn(*session_);
  const auto erased = session_->scans().EraseWithdrawn(
      absl::Hours(1), [](const std::string&) { return true; }, [](uint64_t) { return true; });
  ASSERT_TRUE(erased.ok()) << erased.status();
  EXPECT_EQ(*erased, 1);
  Restart();
  EXPECT_EQ(BytesOf(*session_), model);
  EXPECT_EQ(PosesIn(*session_), poses);
}

TEST_F(PoseAdjusterTest, TheGraphSaysHowWellEachScanIsTied) {
  SendAll();
  std::promise<absl::StatusOr<v1::GetPoseGraphResponse>> answer;
  session_->DescribePoseGraph([&](absl::StatusOr<v1::GetPoseGraphResponse> response) {
    answer.set_value(std::move(response));
  });
  const absl::StatusOr<v1::GetPoseGraphResponse> response = answer.get_future().get();
  ASSERT_TRUE(response.ok()) << response.status();
  const v1::PoseGraph& graph = response->graph();
  ASSERT_EQ(graph.scans_size(), kScans);
  EXPECT_EQ(graph.links_size(), kScans);
  EXPECT_EQ(graph.link_test_ratios_size(), kScans);
  EXPECT_TRUE(graph.scans(0).held());
  EXPECT_EQ(graph.scans(0).position_sigma_m(), 0);
  // Half way round two chains hold a scan: of two links, and of three. What the measurements of it
  // and of the first one share in all their links comes to half of a link's variance each.
  const double sigma = fixture::Script::kTieSigma * std::sqrt(2 * 3 / 5.0 + 2 * 0.5);
  EXPECT_NEAR(graph.scans(2).position_sigma_m(), sigma * std::sqrt(graph.variance_factor()),
              0.1 * sigma * std::sqrt(graph.variance_factor()));
  EXPECT_EQ(graph.model_version(), session_->model().Current().version);
  EXPECT_FALSE(graph.worst_scan().empty());
  // A ring: every scan can go, and every link.
  ASSERT_EQ(graph.link_sigmas_m_size(), kScans);
  for (const double sigma_of_link : graph.link_sigmas_m()) EXPECT_GT(sigma_of_link, 0);
  EXPECT_EQ(graph.connectivity().piece_count(), 1);
  EXPECT_EQ(graph.connectivity().tied_pair_count(), kScans * (kScans - 1) / 2);
  EXPECT_EQ(graph.connectivity().cut_scans_size(), 0);
  EXPECT_EQ(graph.connectivity().bridge_indexes_size(), 0);
  EXPECT_GE(graph.connectivity().mean_path_sigma_m(), graph.link_sigmas_m(0) * 0.99);
  // Without one of them it is a chain, which each scan within it cuts.
  Withdraw(2);
  std::promise<absl::StatusOr<v1::GetPoseGraphResponse>> chain;
  session_->DescribePoseGraph(
      [&](absl::StatusOr<v1::GetPoseGraphResponse> got) { chain.set_value(std::move(got)); });
  const absl::StatusOr<v1::GetPoseGraphResponse> open = chain.get_future().get();
  ASSERT_TRUE(open.ok()) << open.status();
  const v1::Connectivity& left = open->graph().connectivity();
  EXPECT_EQ(left.cut_scans_size(), kScans - 3);
  EXPECT_EQ(left.bridge_indexes_size(), kScans - 2);
  for (const int index : left.bridge_indexes()) EXPECT_LT(index, open->graph().links_size());
  // Sigmas have the variance factor: the ring's links disagree, of a chain nothing is known.
  EXPECT_EQ(open->graph().variance_factor(), 1);
  EXPECT_GT(left.mean_path_sigma_m(),
            graph.connectivity().mean_path_sigma_m() / std::sqrt(graph.variance_factor()));
}

}  // namespace
}  // namespace vantage::session

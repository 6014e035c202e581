// Scanners and claims of a session: who holds a claim, what ends it, and that all of it is in the
// log.
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <thread>

#include "absl/strings/str_cat.h"
#include "core/sensor/encoding.h"
#include "google/protobuf/util/message_differencer.h"
#include "google/rpc/error_details.pb.h"
#include "server/contract/error.h"
#include "server/conversion/fleet_proto.h"
#include "server/conversion/to_proto.h"
#include "server/store/memory_store.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"
#include "vantage/v1/error.pb.h"

namespace vantage::session {
namespace {

using google::protobuf::util::MessageDifferencer;

v1::ClaimConflict ConflictIn(const absl::Status& status) {
  v1::ClaimConflict conflict;
  const auto payload = status.GetPayload("type.googleapis.com/vantage.v1.ClaimConflict");
  EXPECT_TRUE(payload.has_value() && conflict.ParseFromString(std::string(*payload))) << status;
  return conflict;
}

google::rpc::ErrorInfo InfoIn(const absl::Status& status) {
  google::rpc::ErrorInfo info;
  status.ForEachPayload([&](absl::string_view url, const absl::Cord& bytes) {
    if (url.find("ErrorInfo") != absl::string_view::npos) info.ParseFromString(std::string(bytes));
  });
  return info;
}

class FleetSession : public testing::Test {
 protected:
  FleetSession() {
    script_.EndPlans();
    Start();
    session_ = fixture::OpenSession(host_->registry, "job");
  }

  void Start() {
    host_ = std::make_unique<fixture::SessionHost>(
        store_, script_.Make(), contract::Limits(),
        [this] { return fixture::FixtureTime() + absl::Seconds(seconds_.load()); });
  }
  void Restart() {
    session_.reset();
    host_.reset();
    Start();
    session_ = fixture::LoadSession(host_->registry, "job");
  }
  void Pass(int seconds) { seconds_ += seconds; }

  std::string Add(const std::string& id) {
    v1::CreateScannerRequest request;
    request.set_scanner_id(id);
    request.mutable_scanner()->set_operator_("somebody");
    return session_->scanners().Create(request).value().name();
  }
  absl::StatusOr<v1::Claim> Claim(const std::string& scanner, double x, double y,
                                  int ttl_seconds = 60, const std::string& request_id = "",
                                  const std::string& caller = "") {
    v1::ClaimViewRequest request;
    request.set_scanner(scanner);
    request.mutable_position()->set_x(x);
    request.mutable_position()->set_y(y);
    request.mutable_position()->set_z(1.4);
    request.mutable_ttl()->set_seconds(ttl_seconds);
    request.set_request_id(request_id);
    auto answer = std::make_shared<std::promise<absl::StatusOr<v1::ClaimViewResponse>>>();
    session_->claims().Take(
        request,
        [answer](absl::StatusOr<v1::ClaimViewResponse> response) {
          answer->set_value(std::move(response));
        },
        caller);
    absl::StatusOr<v1::ClaimViewResponse> response = answer->get_future().get();
    if (!response.ok()) return response.status();
    return response->claim();
  }
  absl::Status Release(const std::string& name) { return session_->claims().Release(name, {}); }
  std::vector<v1::Claim> Held() {
    bool more = false;
    return session_->claims().List("", 100, more).value();
  }
  v1::Scanner Scanner(const std::string& name) {
    bool more = false;
    const std::vector<v1::Scanner> scanners = session_->scanners().List("", 100, more).value();
    for (const v1::Scanner& scanner : scanners) {
      if (scanner.name() == name) return scanner;
    }
    return {};
  }
  // A scan of the room from a place, registered there; its name.
  std::string Scan(double x, double y, double degrees = 4, const std::string& by = "") {
    const v1::PosePrior prior = fixture::PriorAt(x, y, 1.4);
    const std::string bytes = fixture::EncodedRoom({x, y, 1.4}, degrees);
    std::string scan = fixture::SendScan(*session_, bytes, &prior, "", by).value().scan();
    session_->WaitUntilIdle();
    return scan;
  }
  std::vector<v1::SessionEvent> Events() { return session_->journal().Events(0, 10'000).value(); }
  // How a claim ended, as the log has it; empty: it did not.
  std::string EndOf(const std::string& claim) {
    std::string words;
    for (const v1::SessionEvent& event : Events()) {
      if (event.claim_ended().claim().name() == claim) {
        EXPECT_EQ(words, "") << "ended twice";
        words = conversion::Words(event.claim_ended().end_reason());
      }
    }
    return words;
  }

  fixture::Script script_;
  store::MemoryStore store_{size_t{256} << 20};
  std::atomic<int> seconds_{0};
  std::unique_ptr<fixture::SessionHost> host_;
  std::shared_ptr<Session> session_;
};

TEST_F(FleetSession, ScannersAreAddedOnceAndKnown) {
  EXPECT_EQ(Add("red"), "sessions/job/scanners/red");
  EXPECT_EQ(Add(""), "sessions/job/scanners/scanner-2");
  const v1::Scanner red = Scanner("sessions/job/scanners/red");
  EXPECT_EQ(red.speed_m_per_s(), 1);
  EXPECT_EQ(red.scan_duration().seconds(), 180);
  EXPECT_EQ(red.scanner_model_id(), "panoramic");
  EXPECT_FALSE(red.has_last_pose());
  v1::CreateScannerRequest again;
  again.set_scanner_id("red");
  again.mutable_scanner();
  EXPECT_EQ(contract::ReasonOf(session_->scanners().Create(again).status()), "SCANNER_EXISTS");
  again.set_scanner_id("green");
  again.mutable_scanner()->set_scanner_model_id("none");
  const absl::Status wrong = session_->scanners().Create(again).status();
  EXPECT_NE(wrong.ToString().find("scanner.scanner_model_id"), std::string::npos) << wrong;
}

TEST_F(FleetSession, OneHasItAndTheOtherIsToldWhyAndWhereElse) {
  const std::string red = Add("red");
  const std::string blue = Add("blue");
  Scan(2, 1.5);
  const auto first = Claim(red, 1, 1);
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(first->name(), "sessions/job/claims/claim-1");
  // The script says that two views share what a metre each way leaves of them.
  const auto second = Claim(blue, 1.8, 1);
  ASSERT_EQ(second.status().code(), absl::StatusCode::kAlreadyExists) << second.status();
  const auto info = InfoIn(second.status());
  EXPECT_EQ(info.reason(), "CLAIMED");
  EXPECT_EQ(info.metadata().at("claim"), first->name());
  EXPECT_EQ(info.metadata().at("scanner"), red);
  const v1::ClaimConflict conflict = ConflictIn(second.status());
  EXPECT_EQ(conflict.claim(), first->name());
  EXPECT_EQ(conflict.scanner(), red);
  EXPECT_NEAR(conflict.covered_share(), 0.6, 0.005);
  EXPECT_FALSE(conflict.same_place());
  EXPECT_EQ(conflict.expire_time().seconds(), first->expire_time().seconds());
  EXPECT_NEAR(conflict.alternative().position().x(), 1, 1e-3);
  EXPECT_NEAR(conflict.alternative().position().z(), 1.5, 1e-3);
  EXPECT_TRUE(ConflictIn(Claim(blue, 1.3, 1).status()).same_place());
  ASSERT_TRUE(Claim(blue, 2.2, 1).ok());
  EXPECT_EQ(Held().size(), 2u);
  // Given back, it can be had.
  ASSERT_TRUE(Release(first->name()).ok());
  EXPECT_EQ(EndOf(first->name()), "released");
  EXPECT_EQ(contract::ReasonOf(Release(first->name())), "CLAIM_ENDED");
  EXPECT_EQ(Release("sessions/job/claims/claim-99").code(), absl::StatusCode::kNotFound);
  EXPECT_TRUE(Claim(blue, 1, 1).ok());
  EXPECT_EQ(Claim("sessions/job/scanners/nobody", 5, 5).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST_F(FleetSession, OfManyAtTheSameTimeExactlyOneWins) {
  std::vector<std::string> scanners;
  scanners.reserve(8);
  for (int i = 0; i < 8; ++i) scanners.push_back(Add(absl::StrCat("s", i)));
  Scan(2, 1.5);
  for (int round = 0; round < 5; ++round) {
    std::atomic<int> won{0};
    std::vector<std::thread> threads;
    threads.reserve(scanners.size());
    for (const std::string& scanner : scanners) {
      threads.emplace_back([&, scanner] {
        const auto claim = Claim(scanner, 0.5 + 1.5 * round, 3);
        if (claim.ok()) ++won;
        EXPECT_TRUE(claim.ok() || contract::ReasonOf(claim.status()) == "CLAIMED" ||
                    contract::ReasonOf(claim.status()) == "CLAIMS_BUSY")
            << claim.status();
      });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(won, 1) << round;
  }
  EXPECT_EQ(Held().size(), 5u);
}

TEST_F(FleetSession, ClaimsExpireAndAreRenewed) {
  const std::string red = Add("red");
  const std::string blue = Add("blue");
  const auto first = Claim(red, 1, 1, 60);
  ASSERT_TRUE(first.ok());
  Pass(50);
  const auto renew = [&] {
    return session_->claims().Renew(first->name(), absl::Seconds(100), {});
  };
  const auto renewed = renew();
  ASSERT_TRUE(renewed.ok()) << renewed.status();
  EXPECT_EQ(conversion::ReadTime(renewed->expire_time()),
            fixture::FixtureTime() + absl::Seconds(150));
  Pass(99);
  EXPECT_EQ(Held().size(), 1u);
  EXPECT_EQ(contract::ReasonOf(Claim(blue, 1, 1).status()), "CLAIMED");
  Pass(1);
  EXPECT_EQ(contract::ReasonOf(renew().status()), "CLAIM_ENDED");
  EXPECT_TRUE(Claim(blue, 1, 1).ok());
  EXPECT_EQ(EndOf(first->name()), "expired");
  // Nobody has to ask for it.
  Pass(1000);
  session_->claims().Expire();
  EXPECT_EQ(EndOf("sessions/job/claims/claim-2"), "expired");
  EXPECT_TRUE(Held().empty());
}

// Whoever took it has it, also after a restart; what nobody in particular took is everybody's.
TEST_F(FleetSession, AClaimIsItsCallers) {
  const std::string red = Add("red");
  const std::string own = Claim(red, 1, 1, 60, "", "tablet").value().name();
  const std::string open = Claim(red, 4, 3).value().name();
  for (const bool again : {false, true}) {
    SCOPED_TRACE(again);
    if (again) Restart();
    Claims& claims = session_->claims();
    const absl::Status renewed = claims.Renew(own, absl::Seconds(90), {}, {"other"}).status();
    EXPECT_TRUE(absl::IsPermissionDenied(renewed)) << renewed;
    EXPECT_EQ(contract::ReasonOf(renewed), "CLAIM_OF_ANOTHER");
    EXPECT_EQ(contract::ReasonOf(claims.Release(own, {}, {"other"})), "CLAIM_OF_ANOTHER");
    EXPECT_EQ(Held().size(), 2U);
    EXPECT_TRUE(claims.Renew(own, absl::Seconds(90), {}, {"tablet"}).ok());
    EXPECT_TRUE(claims.Renew(own, absl::Seconds(90), {}, {"office", true}).ok());
    EXPECT_TRUE(claims.Renew(open, absl::Seconds(90), {}, {"other"}).ok());
  }
  EXPECT_TRUE(session_->claims().Release(open, {}, {"other"}).ok());
  EXPECT_TRUE(session_->claims().Release(own, {}, {"tablet"}).ok());
  EXPECT_EQ(EndOf(own), "released");
}

TEST_F(FleetSession, AScanFromThereEndsTheClaim) {
  const std::string red = Add("red");
  const std::string blue = Add("blue");
  Scan(2, 1.5);
  const auto first = Claim(red, 1, 1);
  const auto second = Claim(blue, 4, 3);
  ASSERT_TRUE(first.ok() && second.ok());
  const std::string scan = Scan(1.2, 0.9);
  EXPECT_EQ(EndOf(first->name()), "scan arrived");
  EXPECT_EQ(session_->scans().Get(scan)->scanner(), red);
  EXPECT_NEAR(Scanner(red).last_pose().translation().x(), 1.2, 1e-9);
  EXPECT_EQ(EndOf(second->name()), "");
  EXPECT_FALSE(Scanner(blue).has_last_pose());
  // The event names the scan, and comes after its merge.
  uint64_t merged = 0;
  for (const v1::SessionEvent& event : Events()) {
    if (event.scan_merged().scan().name() == scan) merged = event.sequence();
    if (event.has_claim_ended()) {
      EXPECT_EQ(event.claim_ended().scan(), scan);
      EXPECT_GT(merged, 0u);
    }
  }
  // A doubtful scan ends nothing: a person has to decide.
  script_.SetVerdict(registration::RegistrationOutcome::kDoubtful);
  Scan(4, 3);
  EXPECT_EQ(EndOf(second->name()), "");
}

TEST_F(FleetSession, LateOrTwiceAScanMergesAsIfNobodyHadClaimedAnything) {
  const std::string red = Add("red");
  Scan(2, 1.5);
  const auto claim = Claim(red, 1, 1, 60);
  ASSERT_TRUE(claim.ok());
  Pass(2 * 3600);
  const std::string late = Scan(1, 1);
  EXPECT_EQ(session_->scans().Get(late)->state(), v1::SCAN_STATE_MERGED);
  session_->claims().Expire();
  EXPECT_EQ(EndOf(claim->name()), "expired");
  const std::string twice = Scan(1.05, 1);
  EXPECT_EQ(session_->scans().Get(twice)->state(), v1::SCAN_STATE_MERGED);
  // The model is that of the scans alone, to the voxel.
  const auto plain = fixture::OpenSession(host_->registry, "plain");
  for (const auto& [x, y] : {std::pair(2.0, 1.5), std::pair(1.0, 1.0), std::pair(1.05, 1.0)}) {
    const v1::PosePrior prior = fixture::PriorAt(x, y, 1.4);
    ASSERT_TRUE(fixture::SendScan(*plain, fixture::EncodedRoom({x, y, 1.4}, 4), &prior).ok());
    plain->WaitUntilIdle();
  }
  const auto a = session_->model().Current().view;
  const auto b = plain->model().Current().view;
  ASSERT_EQ(a->SurfaceCount(), b->SurfaceCount());
  size_t differ = 0;
  a->ForEachSurface(
      [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& surface) {
        const std::optional<model::SurfaceVoxel> other = b->Surface(v);
        differ += b->State(v) != state || !other.has_value() ||
                  other->centroid != surface.centroid || other->density != surface.density;
      });
  EXPECT_EQ(differ, 0u);
}

TEST_F(FleetSession, ALateScanLeavesItsScannerWhereItIs) {
  const std::string red = Add("red");
  const auto stations = [&] {
    const v1::Vector3 at = Scanner(red).last_pose().translation();
    return std::pair(std::lround(at.x() * 100), std::lround(at.y() * 100));  // cm
  };
  Scan(2, 1.5);
  ASSERT_TRUE(Claim(red, 1, 1, 60).ok());
  Pass(100);
  ASSERT_TRUE(Claim(red, 4, 3, 60).ok());
  Scan(4, 3, 4, red);
  EXPECT_EQ(stations(), std::pair(400L, 300L));
  Pass(7200);
  const std::string late = Scan(1, 1, 4, red);
  EXPECT_EQ(session_->scans().Get(late)->state(), v1::SCAN_STATE_MERGED);
  EXPECT_EQ(session_->scans().Get(late)->scanner(), red);
  EXPECT_EQ(stations(), std::pair(400L, 300L)) << "where it stood two hours ago";
  // Sent there again, it stands there; and anywhere else where it never had a claim.
  ASSERT_TRUE(Claim(red, 1, 1, 60).ok());
  Scan(1.1, 1, 4, red);
  EXPECT_EQ(stations(), std::pair(110L, 100L));
  Pass(60);
  Scan(3, 2, 4, red);
  EXPECT_EQ(stations(), std::pair(300L, 200L));
}

TEST_F(FleetSession, TheFirstScanIsNeverLate) {
  const std::string red = Add("red");
  Scan(2, 1.5);
  ASSERT_TRUE(Claim(red, 1, 1, 60).ok());
  Pass(7200);
  Scan(1, 1, 4, red);
  EXPECT_NEAR(Scanner(red).last_pose().translation().x(), 1, 1e-9);
}

// A person as an upright cylinder, as a scanner at `from` sees it in the room.
std::string RoomWithPerson(const Eigen::Vector3d& from, const Eigen::Vector2d& person) {
  sensor::RangeImage image = fixture::ScanRoom(from, 2);
  for (int c = 0; c < image.columns(); ++c) {
    for (int r = 0; r < image.rows(); ++r) {
      const Eigen::Vector3d ray = image.Direction(c, r);
      const double across = ray.head<2>().norm();
      const Eigen::Vector2d heading = ray.head<2>() / across;
      const Eigen::Vector2d to = person - from.head<2>();
      const double beside = std::abs(heading.x() * to.y() - heading.y() * to.x());
      const double ahead = heading.dot(to);
      if (beside > 0.25 || ahead < 0) continue;
      const double range = (ahead - std::sqrt(0.0625 - beside * beside)) / across;
      const double z = from.z() + range * ray.z();
      if (z < 0 || z > 1.75 || range > static_cast<double>(image.at(c, r))) continue;
      image.range[image.Index(c, r)] = static_cast<float>(range);
    }
  }
  return sensor::EncodeRangeImage(image);
}

TEST_F(FleetSession, AColleagueSeenInAScanIsNoWall) {
  const Eigen::Vector2d colleague(3.5, 2.5);
  const auto send = [&](double x, double y, bool with) {
    const v1::PosePrior prior = fixture::PriorAt(x, y, 1.4);
    const Eigen::Vector3d from(x, y, 1.4);
    const std::string bytes = with ? RoomWithPerson(from, colleague)
                                   : sensor::EncodeRangeImage(fixture::ScanRoom(from, 2));
    ASSERT_TRUE(fixture::SendScan(*session_, bytes, &prior).ok());
    session_->WaitUntilIdle();
  };
  // Surface that is neither wall nor floor, around where the colleague stood.
  const auto left = [&] {
    const auto view = session_->model().Current().view;
    size_t count = 0;
    view->ForEachSurface(
        [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel&) {
          const Eigen::Vector3d p = view->Centre(v);
          count += state == model::VoxelState::kTrueSurface && p.z() > 0.3 && p.z() < 1.7 &&
                   (p.head<2>() - colleague).norm() < 0.45;
        });
    return count;
  };
  send(1.5, 1.5, true);
  const size_t seen = left();
  EXPECT_GT(seen, 20u);
  send(1.0, 3.0, false);
  send(2.5, 1.0, false);
  send(4.3, 3.3, false);
  EXPECT_LT(left(), seen / 10);
}

TEST_F(FleetSession, LoadedAgainFromTheLogItIsTheSame) {
  const std::string red = Add("red");
  const std::string blue = Add("blue");
  Scan(2, 1.5);
  const auto first = Claim(red, 1, 1, 60, "c1");
  const auto second = Claim(blue, 4, 3, 3600, "c2");
  ASSERT_TRUE(first.ok() && second.ok());
  Scan(1, 1);
  const auto third = Claim(red, 1, 3.5, 60);
  ASSERT_TRUE(third.ok()) << third.status();
  const v1::Session before = session_->Describe();
  const v1::Scanner red_before = Scanner(red);
  const auto held_before = Held();
  ASSERT_EQ(held_before.size(), 2u);
  Restart();
  EXPECT_TRUE(MessageDifferencer::Equals(session_->Describe(), before));
  EXPECT_TRUE(MessageDifferencer::Equals(Scanner(red), red_before));
  const auto held = Held();
  ASSERT_EQ(held.size(), 2u);
  for (size_t i = 0; i < held.size(); ++i) {
    EXPECT_TRUE(MessageDifferencer::Equals(held[i], held_before[i]));
  }
  // What was executed is known, ended or not.
  EXPECT_EQ(Claim(red, 1, 1, 60, "c1")->name(), first->name());
  EXPECT_EQ(Claim(blue, 4, 3, 3600, "c2")->name(), second->name());
  EXPECT_EQ(Claim(blue, 4, 2, 3600, "c2").status().code(), absl::StatusCode::kAlreadyExists);
  // What expired while nobody was there, has.
  Pass(100);
  Restart();
  EXPECT_EQ(EndOf(third->name()), "expired");
  EXPECT_EQ(Held().size(), 1u);
}

TEST_F(FleetSession, PlansAreMadeForScannersAndAroundClaims) {
  const std::string red = Add("red");
  const std::string blue = Add("blue");
  Scan(2, 1.5);
  const auto claim = Claim(blue, 4, 3);
  ASSERT_TRUE(claim.ok());
  v1::CreatePlanRequest request;
  request.mutable_plan()->set_work_limit_rays(1000);
  const auto plan_for = [&](const std::vector<std::string>& scanners) {
    request.mutable_plan()->clear_scanners();
    for (const std::string& scanner : scanners) request.mutable_plan()->add_scanners(scanner);
    const auto plan = session_->plans().Create(request);
    EXPECT_TRUE(plan.ok()) << plan.status();
    EXPECT_TRUE(host_->registry.WaitUntilIdle(std::chrono::seconds(60)));
    return plan.ok() ? session_->plans().Get(plan->name()).value() : v1::Plan();
  };
  // Whoever asks is planned around what others have, not around their own.
  const v1::Plan of_red = plan_for({red});
  ASSERT_EQ(of_red.result().joint().claims_size(), 1);
  EXPECT_EQ(of_red.result().joint().claims(0), claim->name());
  EXPECT_EQ(of_red.scanners(0), red);
  EXPECT_EQ(of_red.result().joint().assignments(0).scanner(), red);
  EXPECT_EQ(of_red.result().joint().assignments(0).view_index(), 0);
  EXPECT_EQ(plan_for({blue}).result().joint().claims_size(), 0);
  EXPECT_EQ(plan_for({}).result().joint().claims_size(), 1);
  const v1::Plan both = plan_for({blue, red});
  EXPECT_EQ(both.result().joint().claims_size(), 0);
  ASSERT_EQ(both.result().joint().assignments_size(), 2);
  EXPECT_FALSE(both.result().joint().assignments(1).has_view_index());
  EXPECT_EQ(both.result().joint().assignments(1).message(), "scripted");
  // When nobody has claimed anything, and nobody is named, it is a plan like any other.
  ASSERT_TRUE(Release(claim->name()).ok());
  EXPECT_FALSE(plan_for({}).result().has_joint());
  request.mutable_plan()->set_ranking(v1::RANKING_SCORE_PER_MINUTE);
  EXPECT_TRUE(plan_for({}).result().has_joint());
  EXPECT_EQ(plan_for({}).ranking(), v1::RANKING_SCORE_PER_MINUTE);

  request.mutable_plan()->clear_scanners();
  request.mutable_plan()->add_scanners(red);
  request.mutable_plan()->add_scanners(red);
  request.mutable_plan()->add_scanners("sessions/job/scanners/nobody");
  request.mutable_plan()->set_scanner_model_id("panoramic");
  const absl::Status wrong = session_->plans().Create(request).status();
  for (const char* field : {"plan.scanners[1]", "plan.scanners[2]", "plan.scanner_model_id"}) {
    EXPECT_NE(wrong.ToString().find(field), std::string::npos) << field << ": " << wrong;
  }
}

}  // namespace
}  // namespace vantage::session

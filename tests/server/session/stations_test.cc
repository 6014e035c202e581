// Pending stations of a session: what they count for, what ends them, and that all of it is in the
// log.
#include "server/session/stations.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <string>
#include <vector>

#include "server/contract/error.h"
#include "server/store/memory_store.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::session {
namespace {

using testing::HasSubstr;

class StationsTest : public testing::Test {
 protected:
  StationsTest() {
    script_.EndPlans();
    Start();
    session_ = fixture::OpenSession(host_->registry, "job");
  }
  void Start(contract::Limits limits = {}) {
    host_ = std::make_unique<fixture::SessionHost>(store_, script_.Make(), limits,
                                                   [] { return fixture::FixtureTime(); });
  }
  void Restart(const contract::Limits& limits = {}) {
    session_.reset();
    host_.reset();
    Start(limits);
    ASSERT_TRUE(host_->registry.LoadAll().ok());
    session_ = host_->registry.Find("job").value();
    session_->WaitUntilIdle();
  }
  static v1::CreateStationRequest Request(double x, double y, const std::string& scanner = "",
                                          const std::string& request_id = "") {
    v1::CreateStationRequest request;
    request.set_parent("sessions/job");
    request.set_request_id(request_id);
    v1::Station& station = *request.mutable_station();
    station.mutable_position()->set_x(x);
    station.mutable_position()->set_y(y);
    station.mutable_position()->set_z(1.4);
    station.set_scanner(scanner);
    return request;
  }
  absl::StatusOr<v1::Station> Create(const v1::CreateStationRequest& request) {
    auto answer = std::make_shared<std::promise<absl::StatusOr<v1::CreateStationResponse>>>();
    session_->stations().Create(request,
                                [answer](absl::StatusOr<v1::CreateStationResponse> response) {
                                  answer->set_value(std::move(response));
                                });
    absl::StatusOr<v1::CreateStationResponse> response = answer->get_future().get();
    if (!response.ok()) return response.status();
    return response->station();
  }
  std::vector<std::string> Pending() {
    bool more = false;
    std::vector<std::string> names;
    const std::vector<v1::Station> stations = session_->stations().List("", 100, more).value();
    names.reserve(stations.size());
    for (const v1::Station& station : stations) names.push_back(station.name());
    return names;
  }
  std::string Scan(double x, double y, const std::string& by = "") {
    const v1::PosePrior prior = fixture::PriorAt(x, y, 1.4);
    const std::string bytes = fixture::EncodedRoom({x, y, 1.4}, 4);
    std::string scan = fixture::SendScan(*session_, bytes, &prior, "", by).value().scan();
    session_->WaitUntilIdle();
    return scan;
  }
  std::string AddScanner(const std::string& id) {
    v1::CreateScannerRequest request;
    request.set_scanner_id(id);
    request.mutable_scanner();
    return session_->scanners().Create(request).value().name();
  }
  v1::StationEndedEvent EndOf(const std::string& station) {
    const std::vector<v1::SessionEvent> events = session_->journal().Events(0, 10'000).value();
    for (const v1::SessionEvent& event : events) {
      if (event.station_ended().station().name() == station) return event.station_ended();
    }
    return {};
  }
  v1::Plan Plan() {
    v1::CreatePlanRequest request;
    const v1::Plan plan = session_->plans().Create(request).value();
    EXPECT_TRUE(host_->registry.WaitUntilIdle(std::chrono::seconds(60)));
    return session_->plans().Get(plan.name()).value();
  }

  fixture::Script script_;
  store::MemoryStore store_{size_t{256} << 20};
  std::unique_ptr<fixture::SessionHost> host_;
  std::shared_ptr<Session> session_;
};

TEST_F(StationsTest, WaitsForItsScanAndEndsWithIt) {
  Scan(0, 0);
  const v1::Station station = Create(Request(2, 1)).value();
  EXPECT_EQ(station.model_gain_m2(), 12);
  EXPECT_EQ(station.loss_chance(), 0.25);
  EXPECT_THAT(station.message(), HasSubstr("12.0 m2"));
  EXPECT_THAT(Pending(), testing::ElementsAre(station.name()));
  EXPECT_EQ(session_->stations().Get(station.name())->position().x(), 2);
  Scan(-2, -1);  // from elsewhere
  EXPECT_THAT(Pending(), testing::ElementsAre(station.name()));
  const std::string scan = Scan(2.3, 1.2);
  EXPECT_THAT(Pending(), testing::IsEmpty());
  EXPECT_EQ(EndOf(station.name()).end_reason(), v1::STATION_END_REASON_SCAN_ARRIVED);
  EXPECT_EQ(EndOf(station.name()).scan(), scan);
  EXPECT_EQ(session_->stations().Get(station.name()).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(StationsTest, AScanThatDoesNotRegisterLeavesItPending) {
  Scan(0, 0);
  const v1::Station station = Create(Request(2, 1)).value();
  script_.SetVerdict(registration::RegistrationOutcome::kFailed);
  Scan(2, 1);
  EXPECT_THAT(Pending(), testing::ElementsAre(station.name()));
}

TEST_F(StationsTest, ItIsNotAnotherScannersScan) {
  const std::string red = AddScanner("red");
  const std::string blue = AddScanner("blue");
  Scan(0, 0);
  const v1::Station station = Create(Request(2, 1, red)).value();
  Scan(2, 1, blue);
  EXPECT_THAT(Pending(), testing::ElementsAre(station.name()));
  Scan(2.05, 1, red);
  EXPECT_THAT(Pending(), testing::IsEmpty());
}

// The room's scans face +x.
TEST_F(StationsTest, AScanThatFacesElsewhereIsNotThatOfItsSector) {
  v1::CreateSessionRequest create;
  create.set_session_id("front");
  create.mutable_session()->mutable_model_config()->set_voxel_size_m(0.1);
  create.mutable_session()->add_scanner_models()->set_azimuth_span_rad(2);
  session_ = host_->registry.Create(create, "").value();
  Scan(0, 0);
  v1::CreateStationRequest away = Request(2, 1);
  away.mutable_station()->set_heading_rad(3);
  const std::string behind = Create(away).value().name();
  Scan(2, 1);
  EXPECT_THAT(Pending(), testing::ElementsAre(behind));
  away.mutable_station()->set_heading_rad(0.3);
  Create(away).value();
  Scan(2.05, 1);
  EXPECT_THAT(Pending(), testing::ElementsAre(behind));
}

TEST_F(StationsTest, PlansAndCoverageKnowIt) {
  Scan(0, 0);
  EXPECT_FALSE(Plan().result().has_joint());
  const v1::GetCoverageResponse before = session_->MeasureCoverage().value();
  EXPECT_EQ(before.coverage().pending_station_count(), 0);
  EXPECT_FALSE(before.coverage().has_expected_coverage());
  const v1::Station first = Create(Request(2, 1)).value();
  const v1::Station second = Create(Request(-2, 1)).value();
  EXPECT_EQ(second.model_gain_m2(), 11) << "beyond the first";
  const v1::Plan plan = Plan();
  EXPECT_THAT(plan.result().joint().stations(), testing::ElementsAre(first.name(), second.name()));
  const v1::Coverage coverage = session_->MeasureCoverage()->coverage();
  EXPECT_EQ(coverage.pending_station_count(), 2);
  EXPECT_NEAR(coverage.area_pending_m2(), 0.75 * (12 + 11), 1e-9);
  // 20 of 50 m2 are at density.
  EXPECT_NEAR(coverage.expected_coverage(), (20 + 0.75 * 23) / 50, 1e-9);
  EXPECT_NEAR(coverage.estimated_coverage(), 0.4, 1e-9) << "marked, not mixed";
}

TEST_F(StationsTest, WhatIsDeletedCountsNoMore) {
  Scan(0, 0);
  const v1::Station station = Create(Request(2, 1)).value();
  v1::DeleteStationRequest request;
  request.set_name(station.name());
  request.set_request_id("again");
  const RequestKey key = RequestKey::Of("again", "DeleteStation", request);
  EXPECT_TRUE(session_->stations().Delete(station.name(), key).ok());
  EXPECT_TRUE(session_->stations().Delete(station.name(), key).ok()) << "the same request";
  EXPECT_EQ(session_->stations().Delete(station.name(), {}).code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(Pending(), testing::IsEmpty());
  EXPECT_EQ(EndOf(station.name()).end_reason(), v1::STATION_END_REASON_DELETED);
  EXPECT_FALSE(Plan().result().has_joint());
}

TEST_F(StationsTest, ARepeatedRequestCreatesOne) {
  Scan(0, 0);
  const v1::Station once = Create(Request(2, 1, "", "tap-1")).value();
  const v1::Station twice = Create(Request(2, 1, "", "tap-1")).value();
  EXPECT_EQ(once.SerializeAsString(), twice.SerializeAsString());
  EXPECT_EQ(Pending().size(), 1u);
  EXPECT_FALSE(Create(Request(3, 1, "", "tap-1")).ok()) << "another under the same id";
}

TEST_F(StationsTest, BeforeTheFirstScanNothingIsForeseen) {
  const v1::Station station = Create(Request(2, 1)).value();
  EXPECT_FALSE(station.has_model_gain_m2());
  EXPECT_EQ(station.loss_chance(), 0.5);
  EXPECT_EQ(Pending().size(), 1u);
  Scan(2, 1);
  EXPECT_THAT(Pending(), testing::IsEmpty());
}

TEST_F(StationsTest, OutlivesTheServer) {
  Scan(0, 0);
  const v1::Station first = Create(Request(2, 1)).value();
  const v1::Station second = Create(Request(-2, 1)).value();
  ASSERT_TRUE(session_->stations().Delete(second.name(), {}).ok());
  Restart();
  EXPECT_THAT(Pending(), testing::ElementsAre(first.name()));
  EXPECT_EQ(session_->stations().Get(first.name())->SerializeAsString(), first.SerializeAsString());
  const v1::Station third = Create(Request(-2, 1)).value();
  EXPECT_NE(third.name(), second.name()) << "names are not used again";
}

TEST_F(StationsTest, AreLimited) {
  Scan(0, 0);
  contract::Limits limits;
  limits.stations_per_session = 2;
  Restart(limits);
  ASSERT_TRUE(Create(Request(2, 1)).ok());
  ASSERT_TRUE(Create(Request(-2, 1)).ok());
  const absl::Status full = Create(Request(2, -1)).status();
  EXPECT_EQ(full.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(contract::ReasonOf(full), "STATIONS_FULL");
}

TEST_F(StationsTest, PagesGoOnAfterWhatHasEnded) {
  Scan(0, 0);
  std::vector<std::string> names(5);
  for (size_t i = 0; i < names.size(); ++i) {
    names[i] = Create(Request(static_cast<double>(i), 1)).value().name();
  }
  bool more = false;
  const auto page = session_->stations().List("", 2, more).value();
  ASSERT_EQ(page.size(), 2u);
  EXPECT_TRUE(more);
  ASSERT_TRUE(session_->stations().Delete(page[1].name(), {}).ok());
  const auto next = session_->stations().List(page[1].name(), 10, more).value();
  ASSERT_EQ(next.size(), 3u);
  EXPECT_EQ(next[0].name(), names[2]);
  EXPECT_FALSE(more);
  EXPECT_FALSE(session_->stations().List("sessions/job/stations/station-9", 10, more).ok());
  EXPECT_FALSE(session_->stations().List("nonsense", 10, more).ok());
}

TEST_F(StationsTest, WhatTheSessionDoesNotKnowIsNamed) {
  Scan(0, 0);
  EXPECT_THAT(std::string(Create(Request(2, 1, "sessions/job/scanners/none")).status().message()),
              HasSubstr("station.scanner"));
  v1::CreateStationRequest request = Request(2, 1);
  request.mutable_station()->set_scanner_model_id("none");
  EXPECT_THAT(std::string(Create(request).status().message()),
              HasSubstr("station.scanner_model_id"));
}

}  // namespace
}  // namespace vantage::session

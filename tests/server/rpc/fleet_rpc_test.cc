// CreateScanner, ListScanners, ClaimView, RenewClaim, ReleaseClaim, ListClaims; a plan for a fleet.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "tests/server/fixture/in_process.h"

namespace vantage::rpc {
namespace {

// A session with a room and two scanners, red and blue.
class FleetRpc : public testing::Test {
 protected:
  void SetUp() override {
    script_.EndPlans();
    for (const char* id : {"red", "blue"}) {
      grpc::ClientContext context;
      v1::CreateScannerRequest request;
      request.set_parent(session_);
      request.set_scanner_id(id);
      request.mutable_scanner();
      v1::CreateScannerResponse response;
      ASSERT_TRUE(server_.fleet->CreateScanner(&context, request, &response).ok());
      EXPECT_EQ(response.scanner().name(), Scanner(id));
    }
  }
  std::string Scanner(const std::string& id) const { return session_ + "/scanners/" + id; }

  // The place is the same for everybody.
  grpc::Status Claim(const std::string& scanner, v1::Claim& claim) {
    grpc::ClientContext context;
    v1::ClaimViewRequest request;
    request.set_parent(session_);
    request.set_scanner(Scanner(scanner));
    request.mutable_position()->set_z(1.5);
    v1::ClaimViewResponse response;
    grpc::Status status = server_.fleet->ClaimView(&context, request, &response);
    claim = response.claim();
    return status;
  }
  grpc::Status Release(const std::string& name) {
    grpc::ClientContext context;
    v1::ReleaseClaimRequest request;
    request.set_name(name);
    v1::ReleaseClaimResponse response;
    return server_.fleet->ReleaseClaim(&context, request, &response);
  }
  std::vector<std::string> Claims() {
    grpc::ClientContext context;
    v1::ListClaimsRequest request;
    request.set_parent(session_);
    v1::ListClaimsResponse response;
    EXPECT_TRUE(server_.fleet->ListClaims(&context, request, &response).ok());
    std::vector<std::string> names;
    for (const v1::Claim& claim : response.claims()) names.push_back(claim.name());
    return names;
  }

  // Covers are measured once `slow_` is over.
  session::Algorithms Make() {
    session::Algorithms algorithms = script_.Make();
    algorithms.measure_cover = [this, measure = algorithms.measure_cover](auto&&... of) {
      ++measured_;
      while (slow_) absl::SleepFor(absl::Milliseconds(2));
      return measure(std::forward<decltype(of)>(of)...);
    };
    return algorithms;
  }

  fixture::Script script_;
  std::atomic<bool> slow_{false};
  std::atomic<int> measured_{0};
  fixture::InProcess server_{Make()};
  const std::string session_ = server_.OpenRoom("job");
};

TEST_F(FleetRpc, ScannersAreListedAsTheyCame) {
  grpc::ClientContext context;
  v1::ListScannersRequest request;
  request.set_parent(session_);
  v1::ListScannersResponse response;
  ASSERT_TRUE(server_.fleet->ListScanners(&context, request, &response).ok());
  ASSERT_EQ(response.scanners_size(), 2);
  EXPECT_EQ(response.scanners(0).name(), Scanner("red"));
  EXPECT_EQ(response.scanners(1).name(), Scanner("blue"));
}

TEST_F(FleetRpc, AClaimIsHeldUntilItIsGivenBack) {
  v1::Claim claim;
  ASSERT_TRUE(Claim("red", claim).ok());
  EXPECT_EQ(claim.scanner(), Scanner("red"));
  EXPECT_THAT(Claims(), testing::ElementsAre(claim.name()));
  EXPECT_TRUE(Release(claim.name()).ok());
  EXPECT_THAT(Claims(), testing::IsEmpty());
}

TEST_F(FleetRpc, APlaceThatIsClaimedIsRefusedToOthers) {
  v1::Claim claim;
  ASSERT_TRUE(Claim("red", claim).ok());
  v1::Claim second;
  const grpc::Status refused = Claim("blue", second);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::ALREADY_EXISTS);
  EXPECT_EQ(fixture::InfoOf(refused).reason(), "CLAIMED");
  EXPECT_EQ(fixture::InfoOf(refused).metadata().at("claim"), claim.name());
  EXPECT_EQ(fixture::InfoOf(refused).metadata().at("scanner"), Scanner("red"));
  ASSERT_TRUE(Release(claim.name()).ok());
  EXPECT_TRUE(Claim("blue", second).ok());
}

// Nobody holds a place whom nobody told so.
TEST_F(FleetRpc, AClaimWhoseCallerGaveUpIsNotTaken) {
  v1::Claim red;
  ASSERT_TRUE(Claim("red", red).ok());
  v1::ClaimViewRequest request;
  request.set_parent(session_);
  request.set_scanner(Scanner("blue"));
  request.mutable_position()->set_x(3);
  request.mutable_position()->set_z(1.5);
  v1::ClaimViewResponse response;
  slow_ = true;
  {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(500));
    EXPECT_EQ(server_.fleet->ClaimView(&context, request, &response).error_code(),
              grpc::StatusCode::DEADLINE_EXCEEDED);
  }
  while (measured_ == 0) absl::SleepFor(absl::Milliseconds(2));
  absl::SleepFor(absl::Milliseconds(300));  // the server hears of it
  slow_ = false;
  // The same is taken for who waits: the one before has ended by then, one way or the other.
  grpc::ClientContext context;
  EXPECT_TRUE(server_.fleet->ClaimView(&context, request, &response).ok());
  EXPECT_EQ(Claims(), (std::vector<std::string>{red.name(), response.claim().name()}));
}

TEST_F(FleetRpc, AClaimOfASectorSaysWhereItFaces) {
  const auto claim = [&](const char* scanner, double x, double heading, v1::Claim& taken) {
    grpc::ClientContext context;
    v1::ClaimViewRequest request;
    request.set_parent(session_);
    request.set_scanner(Scanner(scanner));
    request.mutable_position()->set_x(x);
    request.set_heading_rad(heading);
    v1::ClaimViewResponse response;
    grpc::Status status = server_.fleet->ClaimView(&context, request, &response);
    taken = response.claim();
    return status;
  };
  v1::Claim taken;
  EXPECT_THAT(fixture::ViolatedFields(claim("red", 0, std::nan(""), taken)),
              testing::UnorderedElementsAre("heading_rad"));
  // It says nothing of a scanner that turns all around.
  ASSERT_TRUE(claim("red", 0, 2, taken).ok());
  EXPECT_FALSE(taken.has_heading_rad());

  grpc::ClientContext update;
  v1::UpdateSessionRequest sector;
  sector.mutable_session()->set_name(session_);
  sector.mutable_session()->add_scanner_models()->set_azimuth_span_rad(2);
  sector.mutable_update_mask()->add_paths("scanner_models");
  v1::UpdateSessionResponse updated;
  ASSERT_TRUE(server_.sessions->UpdateSession(&update, sector, &updated).ok());
  ASSERT_TRUE(claim("blue", 5, 2, taken).ok());
  EXPECT_EQ(taken.heading_rad(), 2);
  EXPECT_EQ(taken.azimuth_span_rad(), 2);
}

TEST_F(FleetRpc, ARenewedClaimHoldsForLonger) {
  v1::Claim claim;
  ASSERT_TRUE(Claim("red", claim).ok());
  grpc::ClientContext context;
  v1::RenewClaimRequest renew;
  renew.set_name(claim.name());
  renew.mutable_ttl()->set_seconds(72'000);
  v1::RenewClaimResponse renewed;
  const int64_t before = absl::ToUnixSeconds(absl::Now());
  ASSERT_TRUE(server_.fleet->RenewClaim(&context, renew, &renewed).ok());
  EXPECT_GE(renewed.claim().expire_time().seconds(), before + 72'000);
  EXPECT_LE(renewed.claim().expire_time().seconds(), absl::ToUnixSeconds(absl::Now()) + 72'001);
  EXPECT_LT(claim.expire_time().seconds(), before + 72'000);
}

TEST_F(FleetRpc, APlanIsMadeForItsScanners) {
  grpc::ClientContext context;
  v1::CreatePlanRequest request;
  request.set_parent(session_);
  request.mutable_plan()->add_scanners(Scanner("blue"));
  request.mutable_plan()->add_scanners(Scanner("red"));
  v1::CreatePlanResponse created;
  ASSERT_TRUE(server_.plans->CreatePlan(&context, request, &created).ok());
  EXPECT_THAT(created.plan().scanners(), testing::ElementsAre(Scanner("blue"), Scanner("red")));
}

TEST_F(FleetRpc, NobodysClaimIsNotFound) {
  EXPECT_EQ(Release("sessions/none/claims/claim-1").error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(Release(session_ + "/claims/claim-1").error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(FleetRpc, WhatIsWrongWithAStationIsNamed) {
  v1::CreateStationRequest request;
  request.set_parent(session_);
  const auto violated = [&] {
    grpc::ClientContext context;
    v1::CreateStationResponse response;
    return fixture::ViolatedFields(server_.fleet->CreateStation(&context, request, &response));
  };
  v1::Station& station = *request.mutable_station();
  station.set_heading_rad(std::nan(""));
  EXPECT_THAT(violated(), testing::UnorderedElementsAre("station.position", "station.heading_rad"));
  station.mutable_position()->set_x(std::nan(""));
  station.set_heading_rad(0.5);
  EXPECT_THAT(violated(), testing::UnorderedElementsAre("station.position.x"));
  station.mutable_position()->set_x(1);
  EXPECT_THAT(violated(), testing::IsEmpty());
}

}  // namespace
}  // namespace vantage::rpc

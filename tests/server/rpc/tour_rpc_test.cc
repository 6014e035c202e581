// CreateTour.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/server/fixture/in_process.h"
#include "tests/server/fixture/room_scan.h"

namespace vantage::rpc {
namespace {

using ::testing::HasSubstr;

class TourRpc : public testing::Test {
 protected:
  grpc::Status Ask(const v1::CreateTourRequest& request) {
    grpc::ClientContext context;
    const auto stream = server_.plans->CreateTour(&context, request);
    v1::CreateTourResponse step;
    steps_.clear();
    while (stream->Read(&step)) {
      if (step.has_tour()) steps_.push_back(step);
    }
    return stream->Finish();
  }
  v1::CreateTourRequest Request() {
    v1::CreateTourRequest request;
    request.set_parent(room_);
    request.mutable_wish()->set_work_limit_rays(5'000'000);
    request.mutable_wish()->set_max_candidate_count(60);
    return request;
  }

  fixture::Script script_;
  fixture::InProcess server_{script_.Make()};
  std::string room_ = server_.OpenRoom("room");
  std::vector<v1::CreateTourResponse> steps_;
};

TEST_F(TourRpc, ToldAsItGetsBetterAndAtLastWhole) {
  const v1::CreateTourRequest request = Request();
  const grpc::Status status = Ask(request);
  ASSERT_TRUE(status.ok()) << status.error_message();
  ASSERT_FALSE(steps_.empty());
  for (size_t i = 0; i + 1 < steps_.size(); ++i) EXPECT_FALSE(steps_[i].last());
  EXPECT_TRUE(steps_.back().last());
  const v1::Tour tour = steps_.back().tour();
  EXPECT_EQ(tour.model_version(), 1U);
  ASSERT_GT(tour.stops_size(), 0);
  EXPECT_THAT(tour.message(), HasSubstr(" % at 2 cm"));
  EXPECT_DOUBLE_EQ(tour.required_density_per_m2(), 2500);
  double area = 0;
  for (const v1::TourStop& stop : tour.stops()) {
    EXPECT_EQ(stop.verdict().outcome(), v1::REGISTRATION_OUTCOME_REGISTERED);
    area += stop.area_m2();
  }
  EXPECT_NEAR(area, tour.area_m2(), 1e-6);
  // The same again: a work limit leaves nothing to chance.
  ASSERT_TRUE(Ask(request).ok());
  EXPECT_EQ(steps_.back().tour().ray_count(), tour.ray_count());
  EXPECT_EQ(steps_.back().tour().message(), tour.message());
}

TEST_F(TourRpc, OfScannersThatAreNamed) {
  for (const char* id : {"red", "blue"}) {
    grpc::ClientContext context;
    v1::CreateScannerRequest create;
    create.set_parent(room_);
    create.set_scanner_id(id);
    create.mutable_scanner()->set_display_name(id);
    v1::CreateScannerResponse created;
    ASSERT_TRUE(server_.fleet->CreateScanner(&context, create, &created).ok());
  }
  v1::CreateTourRequest request = Request();
  request.mutable_wish()->add_scanners(room_ + "/scanners/red");
  request.mutable_wish()->add_scanners(room_ + "/scanners/blue");
  ASSERT_TRUE(Ask(request).ok());
  EXPECT_EQ(steps_.back().tour().scanner_durations_size(), 2);
  ASSERT_GT(steps_.back().tour().stops_size(), 0);
  for (const v1::TourStop& stop : steps_.back().tour().stops()) {
    EXPECT_THAT(stop.scanner(), HasSubstr("/scanners/"));
  }
  request.mutable_wish()->add_scanners(room_ + "/scanners/red");
  request.mutable_wish()->add_scanners(room_ + "/scanners/green");
  const grpc::Status refused = Ask(request);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(refused.error_message(), HasSubstr("named twice"));
  EXPECT_THAT(refused.error_message(), HasSubstr("green"));
}

TEST_F(TourRpc, SaysEverythingThatIsWrongWithAWish) {
  v1::CreateTourRequest request = Request();
  v1::TourWish& wish = *request.mutable_wish();
  wish.set_goal(2);
  wish.set_available_scan_count(0);
  wish.mutable_available_duration()->set_seconds(-5);
  wish.mutable_day_duration()->set_seconds(0);
  wish.set_max_candidate_count(3);
  wish.set_work_limit_rays(0);
  wish.add_previous_stations()->set_x(NAN);
  v1::RoomHours& hours = *wish.add_hours();
  hours.mutable_open_after()->set_seconds(10);
  hours.mutable_closed_after()->set_seconds(10);
  const grpc::Status status = Ask(request);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  for (const char* field :
       {"wish.goal", "wish.available_scan_count", "wish.available_duration", "wish.day_duration",
        "wish.max_candidate_count", "wish.work_limit_rays", "wish.previous_stations[0]",
        "wish.hours[0].region", "wish.hours[0].closed_after"}) {
    EXPECT_THAT(status.error_message(), HasSubstr(field));
  }
  v1::CreateTourRequest room = Request();
  room.mutable_wish()->add_hours()->set_region("vault");
  EXPECT_THAT(Ask(room).error_message(), HasSubstr("'vault' is none of the session's"));
  v1::CreateTourRequest model = Request();
  model.mutable_wish()->set_scanner_model_id("none-such");
  EXPECT_THAT(Ask(model).error_message(), HasSubstr("wish.scanner_model_id"));
}

TEST_F(TourRpc, BeforeTheFirstScanThereIsNothingToPlan) {
  v1::CreateTourRequest request = Request();
  request.set_parent(server_.OpenSession("empty"));
  const grpc::Status status = Ask(request);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  request.set_parent("sessions/none");
  EXPECT_EQ(Ask(request).error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(TourRpc, WhoLeavesCancelsIt) {
  v1::CreateTourRequest request = Request();
  request.mutable_wish()->clear_work_limit_rays();
  request.mutable_wish()->mutable_time_budget()->set_seconds(600);
  for (int i = 0; i < 8; ++i) {  // more than may be made at a time
    grpc::ClientContext context;
    const auto stream = server_.plans->CreateTour(&context, request);
    v1::CreateTourResponse step;
    ASSERT_TRUE(stream->Read(&step)) << i;
    context.TryCancel();
    while (stream->Read(&step)) {
    }
    stream->Finish();
  }
  // The session is not in use any more.
  ASSERT_TRUE(Ask(Request()).ok());
}

}  // namespace
}  // namespace vantage::rpc

// CreateTour.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/synchronization/notification.h"
#include "absl/time/clock.h"
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

TEST_F(TourRpc, WithinLimitsAndForASectorNothingIsKept) {
  v1::CreateTourRequest request = Request();
  request.mutable_wish()->set_available_scan_count(1);
  ASSERT_TRUE(Ask(request).ok());
  EXPECT_EQ(steps_.back().tour().stops_size(), 1);
  EXPECT_FALSE(steps_.back().tour().has_least_stop_count());
  request = Request();
  request.mutable_wish()->mutable_available_duration()->set_seconds(1);
  ASSERT_TRUE(Ask(request).ok());
  EXPECT_EQ(steps_.back().tour().stops_size(), 0);  // no scan is made in a second
  request.mutable_wish()->add_previous_stations()->set_x(1);
  grpc::Status refused = Ask(request);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(refused.error_message(), HasSubstr("wish.previous_stations"));
  // A scanner that sees a sector.
  grpc::ClientContext context;
  v1::UpdateSessionRequest update;
  update.mutable_session()->set_name(room_);
  v1::GetSessionRequest get;
  get.set_name(room_);
  v1::GetSessionResponse got;
  {
    grpc::ClientContext reading;
    ASSERT_TRUE(server_.sessions->GetSession(&reading, get, &got).ok());
  }
  *update.mutable_session() = got.session();
  update.mutable_session()->mutable_scanner_models(0)->set_azimuth_span_rad(2);
  update.mutable_update_mask()->add_paths("scanner_models");
  v1::UpdateSessionResponse updated;
  const grpc::Status set = server_.sessions->UpdateSession(&context, update, &updated);
  ASSERT_TRUE(set.ok()) << set.error_message();
  request = Request();
  ASSERT_TRUE(Ask(request).ok());
  ASSERT_GT(steps_.back().tour().stops_size(), 0);
  for (const v1::TourStop& stop : steps_.back().tour().stops()) {
    EXPECT_TRUE(stop.has_heading_rad());
  }
  request.mutable_wish()->add_previous_stations()->set_x(1);
  refused = Ask(request);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(refused.error_message(), HasSubstr("turn all around"));
}

// Tours that go on until they are cancelled.
class EndlessTourRpc : public TourRpc {
 protected:
  EndlessTourRpc() {
    session::Algorithms algorithms = script_.Make();
    algorithms.make_tour = [this](const session::PlanningTask&, const tour::TourRequest&,
                                  const parallel::Budget& budget, parallel::Parallel&,
                                  tour::TourProgress progress) -> absl::StatusOr<tour::Tour> {
      progress(tour::Tour());
      absl::Notification cancelled;
      const std::stop_callback call(budget.cancelled, [&] { cancelled.Notify(); });
      cancelled.WaitForNotification();
      if (!ended_.HasBeenNotified()) ended_.Notify();
      return absl::CancelledError("tour");
    };
    server::ServerOptions options;
    options.limits.running_plans_per_session = 1;
    endless_ = std::make_unique<fixture::InProcess>(algorithms, options);
    request_.set_parent(endless_->OpenRoom("room"));
  }
  // Until its first tour came; false where it was refused, with `status`.
  bool Begin(grpc::ClientContext& context,
             std::unique_ptr<grpc::ClientReader<v1::CreateTourResponse>>& stream,
             grpc::Status& status) {
    stream = endless_->plans->CreateTour(&context, request_);
    v1::CreateTourResponse step;
    while (stream->Read(&step)) {
      if (step.has_tour()) return true;
    }
    status = stream->Finish();
    return false;
  }

  absl::Notification ended_;
  std::unique_ptr<fixture::InProcess> endless_;
  v1::CreateTourRequest request_;
};

TEST_F(EndlessTourRpc, WhoLeavesCancelsIt) {
  grpc::ClientContext context;
  std::unique_ptr<grpc::ClientReader<v1::CreateTourResponse>> stream;
  grpc::Status status;
  ASSERT_TRUE(Begin(context, stream, status)) << status.error_message();
  EXPECT_FALSE(ended_.HasBeenNotified());
  context.TryCancel();
  stream->Finish();
  EXPECT_TRUE(ended_.WaitForNotificationWithTimeout(absl::Seconds(30)));
}

TEST_F(EndlessTourRpc, NoMoreAtATimeThanASessionMayMake) {
  grpc::ClientContext first;
  std::unique_ptr<grpc::ClientReader<v1::CreateTourResponse>> stream;
  grpc::Status status;
  ASSERT_TRUE(Begin(first, stream, status)) << status.error_message();
  {
    grpc::ClientContext second;
    std::unique_ptr<grpc::ClientReader<v1::CreateTourResponse>> other;
    EXPECT_FALSE(Begin(second, other, status));
    EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_EQ(fixture::InfoOf(status).reason(), "TOO_MANY_TOURS");
  }
  // Who leaves makes room for the next.
  first.TryCancel();
  stream->Finish();
  const absl::Time late = absl::Now() + absl::Seconds(30);
  bool begun = false;
  while (!begun && absl::Now() < late) {
    grpc::ClientContext next;
    begun = Begin(next, stream, status);
    next.TryCancel();
    if (begun) stream->Finish();
  }
  EXPECT_TRUE(begun) << status.error_message();
}

TEST_F(EndlessTourRpc, AServerThatShutsDownSaysSo) {
  grpc::ClientContext context;
  std::unique_ptr<grpc::ClientReader<v1::CreateTourResponse>> stream;
  grpc::Status status;
  ASSERT_TRUE(Begin(context, stream, status)) << status.error_message();
  endless_->Drain();
  v1::CreateTourResponse step;
  while (stream->Read(&step)) EXPECT_FALSE(step.last());
  status = stream->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(fixture::InfoOf(status).reason(), "DRAINING");
}

// Plans by the core itself, not by the script.
class FollowedTourRpc : public TourRpc {
 protected:
  FollowedTourRpc() {
    session::Algorithms algorithms = script_.Make();
    algorithms.make_plan = session::Algorithms::Core().make_plan;
    planner_ = std::make_unique<fixture::InProcess>(algorithms);
    room_ = planner_->OpenRoom("room");
  }
  v1::CreatePlanRequest PlanRequest() {
    v1::CreatePlanRequest request;
    request.set_parent(room_);
    request.mutable_plan()->set_work_limit_rays(20'000'000);
    return request;
  }
  grpc::Status Create(const v1::CreatePlanRequest& request, v1::Plan& plan) {
    grpc::ClientContext context;
    v1::CreatePlanResponse response;
    grpc::Status status = planner_->plans->CreatePlan(&context, request, &response);
    plan = response.plan();
    return status;
  }
  v1::Plan Made(const v1::CreatePlanRequest& request) { return planner_->Plan(request); }

  std::unique_ptr<fixture::InProcess> planner_;
};

TEST_F(FollowedTourRpc, APlanPutsTheNextStopFirst) {
  const v1::Plan greedy = Made(PlanRequest());
  ASSERT_GT(greedy.result().views_size(), 1) << greedy.result().message();
  EXPECT_FALSE(greedy.result().has_followed_tour());
  v1::CreatePlanRequest request = PlanRequest();
  v1::Vector3& nowhere = *request.mutable_plan()->add_tour_stations();
  nowhere.set_x(100);
  *request.mutable_plan()->add_tour_stations() =
      greedy.result().views(greedy.result().views_size() - 1).position();
  const v1::Plan plan = Made(request);
  EXPECT_EQ(plan.tour_stations_size(), 2);
  ASSERT_TRUE(plan.result().has_followed_tour());
  const v1::FollowedTour& followed = plan.result().followed_tour();
  ASSERT_TRUE(followed.has_station_index()) << followed.message();
  EXPECT_EQ(followed.station_index(), 1);
  EXPECT_THAT(followed.message(),
              HasSubstr("stop 2 of the tour (of the others 1 cannot be stood at) stands "
                        "first"));
  const v1::Vector3& first = plan.result().views(0).position();
  const v1::Vector3& stop = request.plan().tour_stations(1);
  EXPECT_LE(std::hypot(first.x() - stop.x(), first.y() - stop.y(), first.z() - stop.z()), 0.5);
  ASSERT_EQ(followed.otherwise_view_index(), 1);
  EXPECT_DOUBLE_EQ(plan.result().views(1).position().x(), greedy.result().views(0).position().x());
  EXPECT_EQ(plan.result().views(0).verdict().outcome(), v1::REGISTRATION_OUTCOME_REGISTERED);
}

TEST_F(FollowedTourRpc, SaysWhatATourDoesNotGoWith) {
  v1::Plan plan;
  v1::CreatePlanRequest request = PlanRequest();
  request.mutable_plan()->add_tour_stations()->set_x(NAN);
  grpc::Status status = Create(request, plan);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("plan.tour_stations[0]"));
  request = PlanRequest();
  for (int i = 0; i < 257; ++i) request.mutable_plan()->add_tour_stations();
  EXPECT_THAT(Create(request, plan).error_message(), HasSubstr("at most 256 fit"));
  request = PlanRequest();
  request.mutable_plan()->add_tour_stations()->set_x(1);
  request.mutable_plan()->set_ranking(v1::RANKING_SCORE_PER_MINUTE);
  status = Create(request, plan);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("plan.tour_stations"));
  grpc::ClientContext context;
  v1::CreateScannerRequest create;
  create.set_parent(room_);
  create.set_scanner_id("red");
  create.mutable_scanner()->set_display_name("red");
  v1::CreateScannerResponse created;
  ASSERT_TRUE(planner_->fleet->CreateScanner(&context, create, &created).ok());
  request.mutable_plan()->clear_ranking();
  request.mutable_plan()->add_scanners(room_ + "/scanners/red");
  status = Create(request, plan);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("does not go with named scanners"));
  request.mutable_plan()->clear_scanners();
  request.mutable_plan()->set_preset("leica-rtc360");
  request.mutable_plan()->set_choose_setting(true);
  status = Create(request, plan);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("does not go with choose_setting"));
}

}  // namespace
}  // namespace vantage::rpc

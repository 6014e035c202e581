// CreatePlan, WatchPlan, CancelPlan, GetPlan, ListPlans, EvaluateView, RejectView.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <string>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "tests/server/fixture/in_process.h"
#include "tests/server/fixture/room_scan.h"

namespace vantage::rpc {
namespace {

class PlanRpc : public testing::Test {
 protected:
  fixture::Script script_;
  fixture::InProcess server_{script_.Make()};
  std::string session_ = server_.OpenRoom("job");

  v1::CreatePlanRequest Request() const {
    v1::CreatePlanRequest request;
    request.set_parent(session_);
    request.mutable_plan()->mutable_time_budget()->set_seconds(600);
    return request;
  }
  grpc::Status Create(const v1::CreatePlanRequest& request, v1::Plan& plan) {
    grpc::ClientContext context;
    v1::CreatePlanResponse response;
    grpc::Status status = server_.plans->CreatePlan(&context, request, &response);
    plan = response.plan();
    return status;
  }
  grpc::Status Get(const v1::GetPlanRequest& request, v1::GetPlanResponse& response) {
    grpc::ClientContext context;
    return server_.plans->GetPlan(&context, request, &response);
  }
  v1::Plan WatchToTheEnd(const std::string& name) { return server_.WatchToTheEnd(name); }
};

TEST(PlanHeartbeats, AWatchOfASilentPlanSaysThatItIsAlive) {
  fixture::Script script;
  server::ServerOptions options;
  options.heartbeat = std::chrono::milliseconds(20);
  fixture::InProcess server(script.Make(), options);
  v1::CreatePlanRequest create;
  create.set_parent(server.OpenRoom("job"));
  create.mutable_plan()->mutable_time_budget()->set_seconds(600);
  v1::CreatePlanResponse created;
  {
    grpc::ClientContext context;
    ASSERT_TRUE(server.plans->CreatePlan(&context, create, &created).ok());
  }
  script.WaitForPlans(1);
  grpc::ClientContext context;
  v1::WatchPlanRequest request;
  request.set_name(created.plan().name());
  const auto stream = server.plans->WatchPlan(&context, request);
  v1::WatchPlanResponse step;
  for (int beats = 0; beats < 3; beats += step.has_heartbeat() ? 1 : 0) {
    ASSERT_TRUE(stream->Read(&step));
  }
  EXPECT_GT(step.heartbeat().time().seconds(), 0);
  EXPECT_FALSE(step.last());
  script.EndPlans();
  while (stream->Read(&step)) {
  }
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_TRUE(step.has_plan() && step.last());
}

TEST_F(PlanRpc, ReturnsAtOnceIsWatchedWhileItImprovesAndIsKept) {
  v1::Plan plan;
  ASSERT_TRUE(Create(Request(), plan).ok());
  EXPECT_EQ(plan.name(), session_ + "/plans/plan-1");
  script_.WaitForPlans(1);
  grpc::ClientContext context;
  v1::WatchPlanRequest request;
  request.set_name(plan.name());
  const auto stream = server_.plans->WatchPlan(&context, request);
  v1::WatchPlanResponse step;
  // It is running without an answer at first; then there is one, while it still runs.
  script_.Improve(100);
  do {
    ASSERT_TRUE(stream->Read(&step));
  } while (step.plan().result().views().empty());
  EXPECT_EQ(step.plan().state(), v1::PLAN_STATE_RUNNING);
  EXPECT_EQ(step.plan().result().views(0).score(), 100);
  // Nobody knows yet whether it will register, or has described where it is.
  EXPECT_FALSE(step.plan().result().views(0).has_verdict());
  EXPECT_FALSE(step.plan().result().views(0).has_location());
  EXPECT_FALSE(step.last());
  script_.EndPlans();
  while (stream->Read(&step)) {
  }
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_TRUE(step.last());
  EXPECT_EQ(step.plan().state(), v1::PLAN_STATE_SUCCEEDED);
  EXPECT_EQ(step.plan().result().model_version(), 1U);
  EXPECT_TRUE(step.plan().result().views(0).has_verdict());
  EXPECT_TRUE(step.plan().result().views(0).has_location());
  // The scripted plan measured no coverage and evaluated nothing: no figure stands for that.
  EXPECT_FALSE(step.plan().result().has_coverage());
  EXPECT_FALSE(step.plan().result().termination().has_best_score_upper());
  // Watched again, and read, it says the same.
  EXPECT_EQ(WatchToTheEnd(plan.name()).SerializeAsString(), step.plan().SerializeAsString());
  v1::GetPlanRequest get;
  get.set_name(plan.name());
  v1::GetPlanResponse got;
  ASSERT_TRUE(Get(get, got).ok());
  EXPECT_EQ(got.plan().SerializeAsString(), step.plan().SerializeAsString());
}

TEST_F(PlanRpc, TheFullViewHasPatchesAndTheMapOfScoresByPages) {
  script_.EndPlans();
  v1::Plan plan;
  ASSERT_TRUE(Create(Request(), plan).ok());
  const v1::Plan ended = WatchToTheEnd(plan.name());
  EXPECT_EQ(ended.result().patches_size(), 0);
  EXPECT_EQ(ended.result().patch_count(), 3);
  EXPECT_EQ(ended.result().stage_durations_size(), 6);
  EXPECT_EQ(ended.result().config().required_density_per_m2(), 2500);
  v1::GetPlanRequest request;
  request.set_name(plan.name());
  request.set_view(v1::PLAN_VIEW_FULL);
  request.set_score_map_page_size(2);
  v1::GetPlanResponse first;
  ASSERT_TRUE(Get(request, first).ok());
  EXPECT_EQ(first.plan().result().patches_size(), 3);
  EXPECT_THAT(first.plan().result().score_map().score(), testing::ElementsAre(10, 20));
  EXPECT_EQ(first.plan().result().score_map().total_viewcell_count(), 3);
  request.set_score_map_page_token(first.next_score_map_page_token());
  v1::GetPlanResponse second;
  ASSERT_TRUE(Get(request, second).ok());
  EXPECT_THAT(second.plan().result().score_map().score(), testing::ElementsAre(30));
  EXPECT_THAT(second.plan().result().score_map().x(), testing::ElementsAre(3));
  EXPECT_TRUE(second.next_score_map_page_token().empty());
}

TEST_F(PlanRpc, AScoreMapTokenBeyondTheEndIsRefused) {
  script_.EndPlans();
  v1::Plan plan;
  ASSERT_TRUE(Create(Request(), plan).ok());
  WatchToTheEnd(plan.name());
  v1::GetPlanRequest request;
  request.set_name(plan.name());
  request.set_view(v1::PLAN_VIEW_FULL);
  const auto token = [&](int place) {
    return absl::WebSafeBase64Escape(absl::StrCat(plan.name(), "/scores\n", place));
  };
  v1::GetPlanResponse got;
  request.set_score_map_page_token(token(2));
  EXPECT_TRUE(Get(request, got).ok());
  request.set_score_map_page_token(token(3));
  const grpc::Status refused = Get(request, got);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(refused.error_message(), testing::HasSubstr("score_map_page_token"));
}

TEST_F(PlanRpc, CancelledByNameItKeepsWhatItFound) {
  v1::Plan plan;
  ASSERT_TRUE(Create(Request(), plan).ok());
  script_.WaitForPlans(1);
  grpc::ClientContext context;
  v1::CancelPlanRequest request;
  request.set_name(plan.name());
  v1::CancelPlanResponse response;
  ASSERT_TRUE(server_.plans->CancelPlan(&context, request, &response).ok());
  const v1::Plan ended = WatchToTheEnd(plan.name());
  EXPECT_EQ(ended.state(), v1::PLAN_STATE_CANCELLED);
  EXPECT_EQ(ended.result().views_size(), 1);
  grpc::ClientContext again;
  EXPECT_TRUE(server_.plans->CancelPlan(&again, request, &response).ok());  // harmless
  EXPECT_EQ(response.plan().state(), v1::PLAN_STATE_CANCELLED);
}

TEST_F(PlanRpc, ALostStreamCancelsNothing) {
  v1::Plan plan;
  ASSERT_TRUE(Create(Request(), plan).ok());
  script_.WaitForPlans(1);
  {
    grpc::ClientContext context;
    v1::WatchPlanRequest request;
    request.set_name(plan.name());
    const auto stream = server_.plans->WatchPlan(&context, request);
    v1::WatchPlanResponse step;
    ASSERT_TRUE(stream->Read(&step));
    context.TryCancel();
    EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
  script_.EndPlans();
  EXPECT_EQ(WatchToTheEnd(plan.name()).state(), v1::PLAN_STATE_SUCCEEDED);
}

// A watch with a deadline ends OK before it, with the best so far; the plan goes on.
TEST_F(PlanRpc, AWatchWithADeadlineEndsBeforeIt) {
  v1::Plan plan;
  ASSERT_TRUE(Create(Request(), plan).ok());
  script_.WaitForPlans(1);
  script_.Improve(500);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(3));
  v1::WatchPlanRequest request;
  request.set_name(plan.name());
  const auto stream = server_.plans->WatchPlan(&context, request);
  v1::WatchPlanResponse step;
  while (stream->Read(&step)) {
  }
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_TRUE(step.last());
  EXPECT_EQ(step.plan().state(), v1::PLAN_STATE_RUNNING);
  EXPECT_EQ(step.plan().result().views_size(), 1);
  script_.EndPlans();
  EXPECT_EQ(WatchToTheEnd(plan.name()).state(), v1::PLAN_STATE_SUCCEEDED);
}

TEST_F(PlanRpc, ManyUnderWayAreRefusedWithARetryDelay) {
  v1::Plan plan;
  grpc::Status status;
  for (int i = 0; i < 9; ++i) {
    status = Create(Request(), plan);
    EXPECT_EQ(status.ok(), i < 8);
  }
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(fixture::InfoOf(status).reason(), "TOO_MANY_PLANS");
  google::rpc::RetryInfo retry;
  for (const auto& any : fixture::Details(status)) any.UnpackTo(&retry);
  EXPECT_EQ(retry.retry_delay().seconds(), 1);
  script_.EndPlans();
}

TEST_F(PlanRpc, TheTrailerCarriesThePushbackThatGrpcHeeds) {
  v1::Plan plan;
  for (int i = 0; i < 8; ++i) Create(Request(), plan);
  grpc::ClientContext context;
  v1::CreatePlanResponse response;
  server_.plans->CreatePlan(&context, Request(), &response);
  const auto& trailers = context.GetServerTrailingMetadata();
  const auto pushback = trailers.find("grpc-retry-pushback-ms");
  ASSERT_NE(pushback, trailers.end());
  EXPECT_EQ(std::string(pushback->second.data(), pushback->second.size()), "1000");
  script_.EndPlans();
}

TEST_F(PlanRpc, ARepeatedRequestIsOnePlan) {
  script_.EndPlans();
  v1::CreatePlanRequest request = Request();
  request.set_request_id("p");
  v1::Plan first;
  v1::Plan second;
  ASSERT_TRUE(Create(request, first).ok());
  ASSERT_TRUE(Create(request, second).ok());
  EXPECT_EQ(first.name(), second.name());
}

TEST_F(PlanRpc, WhatIsWrongIsNamed) {
  v1::Plan none;
  v1::CreatePlanRequest request = Request();
  request.mutable_plan()->mutable_time_budget()->set_seconds(-5);
  EXPECT_THAT(fixture::ViolatedFields(Create(request, none)),
              testing::UnorderedElementsAre("plan.time_budget"));
  request = Request();
  request.mutable_plan()->set_scanner_model_id("nobody");
  request.mutable_plan()->mutable_config_overrides()->set_max_view_count(0);
  EXPECT_THAT(fixture::ViolatedFields(Create(request, none)),
              testing::UnorderedElementsAre("plan.scanner_model_id",
                                            "plan.config_overrides.max_view_count"));
  request = Request();
  request.mutable_plan()->add_scanners(session_ + "/scanners/a");
  const grpc::Status joint = Create(request, none);
  EXPECT_THAT(fixture::ViolatedFields(joint), testing::UnorderedElementsAre("plan.scanners[0]"));
}

TEST_F(PlanRpc, WithoutAScanThereIsNothingToPlanIn) {
  v1::Plan none;
  v1::CreatePlanRequest request = Request();
  request.set_parent(server_.OpenSession("empty"));
  const grpc::Status empty = Create(request, none);
  EXPECT_EQ(empty.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(fixture::InfoOf(empty).reason(), "MODEL_EMPTY");
}

TEST_F(PlanRpc, ListedByPages) {
  script_.EndPlans();
  v1::Plan plan;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(Create(Request(), plan).ok());
    WatchToTheEnd(plan.name());
  }
  std::string token;
  std::vector<std::string> names;
  do {
    grpc::ClientContext context;
    v1::ListPlansRequest request;
    request.set_parent(session_);
    request.set_page_size(2);
    request.set_page_token(token);
    v1::ListPlansResponse response;
    ASSERT_TRUE(server_.plans->ListPlans(&context, request, &response).ok());
    for (const v1::Plan& listed : response.plans()) names.push_back(listed.name());
    token = response.next_page_token();
  } while (!token.empty());
  EXPECT_THAT(names, testing::ElementsAre(session_ + "/plans/plan-1", session_ + "/plans/plan-2",
                                          session_ + "/plans/plan-3"));
}

TEST_F(PlanRpc, EvaluatesAPositionAndRefusesNonsense) {
  grpc::ClientContext context;
  v1::EvaluateViewRequest request;
  request.set_parent(session_);
  request.mutable_position()->set_x(0.25);
  v1::EvaluateViewResponse response;
  ASSERT_TRUE(server_.plans->EvaluateView(&context, request, &response).ok());
  EXPECT_TRUE(response.feasible());
  EXPECT_EQ(response.view().position().x(), 0.25);
  EXPECT_EQ(response.view().model_gain_m2(), 2);
  EXPECT_EQ(response.model_version(), 1U);
  grpc::ClientContext other;
  request.mutable_position()->set_y(std::nan(""));
  EXPECT_THAT(fixture::ViolatedFields(server_.plans->EvaluateView(&other, request, &response)),
              testing::UnorderedElementsAre("position.y"));
}

TEST_F(PlanRpc, AWhatIfTakesAHeading) {
  v1::EvaluateViewRequest request;
  request.set_parent(session_);
  request.mutable_position()->set_x(0.25);
  request.set_heading_rad(1.5);
  v1::EvaluateViewResponse response;
  grpc::ClientContext context;
  ASSERT_TRUE(server_.plans->EvaluateView(&context, request, &response).ok());
  EXPECT_EQ(response.view().heading_rad(), 1.5);
  request.set_heading_rad(std::nan(""));
  grpc::ClientContext other;
  EXPECT_THAT(fixture::ViolatedFields(server_.plans->EvaluateView(&other, request, &response)),
              testing::UnorderedElementsAre("heading_rad"));
}

// Of a scanner that sees a sector: views are upright.
TEST_F(PlanRpc, AWhatIfRefusesAnOrientationThatTiltsTheScanner) {
  v1::UpdateSessionRequest sector;
  sector.mutable_session()->set_name(session_);
  sector.mutable_session()->add_scanner_models()->set_azimuth_span_rad(2);
  sector.mutable_update_mask()->add_paths("scanner_models");
  v1::UpdateSessionResponse updated;
  grpc::ClientContext update;
  ASSERT_TRUE(server_.sessions->UpdateSession(&update, sector, &updated).ok());

  v1::EvaluateViewRequest request;
  request.set_parent(session_);
  request.mutable_position()->set_x(0.25);
  const auto asked = [&](double w, double x, double z) {
    request.mutable_orientation()->set_w(w);
    request.mutable_orientation()->set_x(x);
    request.mutable_orientation()->set_z(z);
    v1::EvaluateViewResponse response;
    grpc::ClientContext context;
    return server_.plans->EvaluateView(&context, request, &response);
  };
  const grpc::Status side = asked(std::sqrt(0.5), std::sqrt(0.5), 0);
  EXPECT_THAT(fixture::ViolatedFields(side), testing::UnorderedElementsAre("orientation"));
  EXPECT_THAT(side.error_message(), testing::HasSubstr("tilts the scanner by 90 degrees"));
  EXPECT_THAT(fixture::ViolatedFields(asked(std::nan(""), 0, 0)),
              testing::UnorderedElementsAre("orientation"));
  EXPECT_TRUE(asked(std::sqrt(0.5), 0, std::sqrt(0.5)).ok());
}

TEST_F(PlanRpc, ASettingIsOfAPreset) {
  const auto violated = [&](const char* setting, bool choose) {
    grpc::ClientContext context;
    v1::CreatePlanRequest request;
    request.set_parent(session_);
    request.mutable_plan()->set_setting(setting);
    request.mutable_plan()->set_choose_setting(choose);
    v1::CreatePlanResponse created;
    return fixture::ViolatedFields(server_.plans->CreatePlan(&context, request, &created));
  };
  EXPECT_THAT(violated("3mm", false), testing::UnorderedElementsAre("plan.setting"));
  EXPECT_THAT(violated("", true), testing::UnorderedElementsAre("plan.choose_setting"));
  grpc::ClientContext update;
  v1::UpdateSessionRequest preset;
  preset.mutable_session()->set_name(session_);
  preset.mutable_session()->add_scanner_models()->set_preset("leica-rtc360");
  preset.mutable_update_mask()->add_paths("scanner_models");
  v1::UpdateSessionResponse updated;
  ASSERT_TRUE(server_.sessions->UpdateSession(&update, preset, &updated).ok());
  EXPECT_EQ(updated.session().scanner_models(0).setting(), "6mm");
  EXPECT_THAT(violated("7mm", false), testing::UnorderedElementsAre("plan.setting"));
  EXPECT_THAT(violated("3mm", true), testing::UnorderedElementsAre("plan.choose_setting"));
  EXPECT_THAT(violated("3mm", false), testing::IsEmpty());

  v1::CreatePlanRequest request;
  request.set_parent(session_);
  v1::CreatePlanResponse created;
  request.mutable_plan()->set_preset("faro");
  grpc::ClientContext unknown;
  EXPECT_THAT(fixture::ViolatedFields(server_.plans->CreatePlan(&unknown, request, &created)),
              testing::UnorderedElementsAre("plan.preset"));
  request.mutable_plan()->set_preset("faro-focus");
  request.mutable_plan()->set_setting("1/8");
  grpc::ClientContext known;
  ASSERT_TRUE(server_.plans->CreatePlan(&known, request, &created).ok());
  EXPECT_EQ(created.plan().preset(), "faro-focus");
  EXPECT_EQ(created.plan().setting(), "1/8");
}

TEST_F(PlanRpc, RejectedPlacesShowInTheSession) {
  v1::RejectViewRequest request;
  request.set_parent(session_);
  request.mutable_position()->set_x(1);
  request.set_reason("a piano");
  request.mutable_ttl()->set_seconds(3600);
  request.set_request_id("r");
  v1::RejectViewResponse response;
  for (int i = 0; i < 2; ++i) {
    grpc::ClientContext context;
    ASSERT_TRUE(server_.plans->RejectView(&context, request, &response).ok());
  }
  EXPECT_EQ(response.rejection().radius_m(), 0.5);
  grpc::ClientContext get;
  v1::GetSessionRequest read;
  read.set_name(session_);
  v1::GetSessionResponse session;
  ASSERT_TRUE(server_.sessions->GetSession(&get, read, &session).ok());
  ASSERT_EQ(session.session().rejections_size(), 1);
  EXPECT_EQ(session.session().rejections(0).reason(), "a piano");
  EXPECT_EQ(session.session().rejections(0).expire_time().seconds() -
                session.session().rejections(0).create_time().seconds(),
            3600);
  grpc::ClientContext bad;
  request.set_radius_m(-1);
  request.clear_position();
  request.set_request_id("");
  EXPECT_THAT(fixture::ViolatedFields(server_.plans->RejectView(&bad, request, &response)),
              testing::UnorderedElementsAre("position", "radius_m"));
}

}  // namespace
}  // namespace vantage::rpc

// A surveyor's plans against a server whose budgets do not suffice.
#include "client/simulated_job/surveyor.h"

#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <gtest/gtest.h>

#include <vector>

#include "client/library/duration.h"
#include "core/parallel/parallel.h"
#include "core/simulation/scenes/small_scenes.h"
#include "vantage/v1/plan_service.grpc.pb.h"

namespace vantage::simulated_job {
namespace {

// Knows an answer from 0.7 s or 3,000 rays on; each plan takes half of its budget.
class SlowPlanner final : public v1::PlanService::Service {
 public:
  std::vector<double> budgets;  // s or rays, as asked

 private:
  grpc::Status CreatePlan(grpc::ServerContext*, const v1::CreatePlanRequest* request,
                          v1::CreatePlanResponse* response) override {
    const v1::Plan& asked = request->plan();
    const bool by_work = asked.has_work_limit_rays();
    const double seconds = client::SecondsOf(asked.time_budget());
    budgets.push_back(by_work ? static_cast<double>(asked.work_limit_rays()) : seconds);
    last_.set_name("sessions/s/plans/p");
    last_.set_state(v1::PLAN_STATE_SUCCEEDED);
    last_.mutable_result()->set_outcome(budgets.back() < (by_work ? 3000 : 0.7)
                                            ? v1::PLAN_OUTCOME_SEARCH_UNFINISHED
                                            : v1::PLAN_OUTCOME_VIEWS);
    last_.mutable_result()->clear_stage_durations();
    *last_.mutable_result()->add_stage_durations()->mutable_duration() =
        client::DurationOf(0.5 * seconds);
    *response->mutable_plan() = last_;
    return grpc::Status::OK;
  }

  grpc::Status WatchPlan(grpc::ServerContext*, const v1::WatchPlanRequest*,
                         grpc::ServerWriter<v1::WatchPlanResponse>* stream) override {
    v1::WatchPlanResponse response;
    response.mutable_heartbeat();  // skipped
    stream->Write(response);
    *response.mutable_plan() = last_;
    response.set_last(true);
    stream->Write(response);
    return grpc::Status::OK;
  }

  v1::Plan last_;
};

class SurveyorTest : public ::testing::Test {
 protected:
  SurveyorTest() {
    int port = 0;
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&planner_);
    server_ = builder.BuildAndStart();
    client::ClientOptions connection;
    connection.server = "127.0.0.1:" + std::to_string(port);
    client_.emplace(connection);
    site_.mesh = simulation::BoxRoom({4, 3, 2.7}).mesh;
    scanner_.emplace(site_.mesh);
  }
  ~SurveyorTest() override { server_->Shutdown(); }

  SlowPlanner planner_;
  std::unique_ptr<grpc::Server> server_;
  std::optional<client::Client> client_;
  Site site_;
  std::optional<simulation::SimulatedScanner> scanner_;
  parallel::Serial serial_;
};

TEST_F(SurveyorTest, ALargerBudgetIsForOnePlanOnly) {
  JobOptions options;
  options.plan_seconds = 0.2;
  Surveyor surveyor(*client_, site_, *scanner_, options, serial_);
  for (int plan = 0; plan < 2; ++plan) {
    planner_.budgets.clear();
    const auto made = surveyor.Plan({}, v1::RANKING_UNSPECIFIED);
    ASSERT_TRUE(made.ok()) << made.status();
    EXPECT_EQ(planner_.budgets, (std::vector<double>{0.2, 0.4, 0.8})) << "plan " << plan;
    EXPECT_EQ(made->attempts, 3);
    EXPECT_DOUBLE_EQ(made->budget, 0.8);
    EXPECT_DOUBLE_EQ(made->seconds, 0.7) << "of all three";
    EXPECT_EQ(made->plan.result().outcome(), v1::PLAN_OUTCOME_VIEWS);
  }
}

TEST_F(SurveyorTest, MoreWorkToo) {
  JobOptions options;
  options.plan_work = 2000;
  Surveyor surveyor(*client_, site_, *scanner_, options, serial_);
  for (int plan = 0; plan < 2; ++plan) {
    planner_.budgets.clear();
    const auto made = surveyor.Plan({}, v1::RANKING_UNSPECIFIED);
    ASSERT_TRUE(made.ok()) << made.status();
    EXPECT_EQ(planner_.budgets, (std::vector<double>{2000, 4000})) << "plan " << plan;
    EXPECT_EQ(made->budget, 0) << "work was limited, not time";
  }
}

TEST_F(SurveyorTest, WhatNoBudgetSolvesEnds) {
  JobOptions options;
  options.plan_seconds = 0.001;
  Surveyor surveyor(*client_, site_, *scanner_, options, serial_);
  const auto made = surveyor.Plan({}, v1::RANKING_UNSPECIFIED);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->attempts, 8);
  EXPECT_DOUBLE_EQ(made->budget, 0.128) << "the last one's";
  EXPECT_EQ(made->plan.result().outcome(), v1::PLAN_OUTCOME_SEARCH_UNFINISHED);
}

}  // namespace
}  // namespace vantage::simulated_job

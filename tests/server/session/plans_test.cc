// What plans are made from and how they are kept, with a disk that may be full.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <latch>
#include <mutex>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/contract/error.h"
#include "server/conversion/to_proto.h"
#include "server/store/memory_store.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::session {
namespace {

using testing::HasSubstr;

class FullDisk : public store::MemoryStore {
 public:
  FullDisk() : store::MemoryStore(size_t{64} << 20) {}
  absl::Status Append(const std::string& session, const storage::v1::LogEntry& entry) override {
    if (full) return absl::ResourceExhaustedError("the disk is full");
    return store::MemoryStore::Append(session, entry);
  }
  std::atomic<bool> full{false};
};

class SessionPlans : public testing::Test {
 protected:
  SessionPlans() {
    Algorithms algorithms = script_.Make();
    algorithms.make_plan = [this](const PlanningTask& task, const parallel::Budget&,
                                  parallel::Parallel&,
                                  const planning::PlanProgress&) -> absl::StatusOr<planning::Plan> {
      during_plan_();
      const std::lock_guard<std::mutex> lock(mutex_);
      config_ = task.config;
      return plan_;
    };
    host_ = std::make_unique<fixture::SessionHost>(
        store_, std::move(algorithms), contract::Limits(),
        [this] { return fixture::FixtureTime() + absl::Seconds(seconds_.load()); });
    session_ = fixture::OpenSession(host_->registry, "job");
    const v1::PosePrior prior = fixture::PriorAt(2.0, 1.5, 1.4);
    EXPECT_TRUE(
        fixture::SendScan(*session_, fixture::EncodedRoom({2.0, 1.5, 1.4}, 3.0), &prior).ok());
    session_->WaitUntilIdle();
  }

  // The name of a plan, when it has come to what `plan` says.
  std::string MakePlan(const planning::Plan& plan = {}) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      plan_ = plan;
    }
    std::string name = session_->plans().Create({}).value().name();
    EXPECT_TRUE(host_->registry.WaitUntilIdle(std::chrono::seconds(60)));
    return name;
  }
  // What the last plan was made from.
  planning::PlanningConfig Config() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return config_;
  }
  absl::StatusOr<v1::Rejection> Reject(double x, int64_t ttl = 0) {
    v1::Rejection wanted;
    wanted.mutable_position()->set_x(x);
    wanted.set_radius_m(0.5);
    std::optional<absl::Duration> holds;
    if (ttl > 0) holds = absl::Seconds(ttl);
    return session_->rejections().Create(wanted, holds, {});
  }

  std::atomic<int> seconds_{0};
  std::function<void()> during_plan_ = [] {};
  std::mutex mutex_;
  planning::Plan plan_;
  planning::PlanningConfig config_;
  FullDisk store_;
  fixture::Script script_;
  std::unique_ptr<fixture::SessionHost> host_;
  std::shared_ptr<Session> session_;
};

TEST_F(SessionPlans, AvoidEveryRefusedPlaceAndTheSessionListsTheNewest) {
  for (int i = 0; i < 1100; ++i) ASSERT_TRUE(Reject(i).ok());
  MakePlan();
  ASSERT_EQ(Config().rejected.size(), 1100U);
  EXPECT_EQ(Config().rejected.back().position.x(), 1099);
  EXPECT_EQ(session_->Describe().rejections_size(), 0);  // as lists have it
  const v1::Session listed = session_->DescribeWithRejections();
  ASSERT_EQ(listed.rejections_size(), 1000);
  EXPECT_EQ(listed.rejections(0).position().x(), 100);
  EXPECT_EQ(listed.rejections(999).position().x(), 1099);
}

TEST_F(SessionPlans, ThatAreDeletedAreForgottenWithTheirDetails) {
  std::vector<std::string> names;
  for (uint64_t i = 0; i < 3; ++i) {
    planning::Plan plan;  // unlike the others, so that it has details of its own
    plan.rays = i;
    names.push_back(MakePlan(plan));
  }
  ASSERT_TRUE(session_->plans().GetFullResult(names[1]).ok());
  const size_t used = store_.used();
  v1::DeletePlanRequest request;
  request.set_name(names[1]);
  const RequestKey key = RequestKey::Of("once", "DeletePlan", request);
  ASSERT_TRUE(session_->plans().Delete(names[1], key).ok());
  EXPECT_TRUE(session_->plans().Delete(names[1], key).ok()) << "the same request";
  EXPECT_TRUE(absl::IsNotFound(session_->plans().Delete(names[1], {})));
  EXPECT_TRUE(absl::IsNotFound(session_->plans().Get(names[1]).status()));
  EXPECT_FALSE(session_->plans().GetFullResult(names[1]).ok());
  EXPECT_LT(store_.used(), used) << "its details are released";
  const auto listed = [](Session& session) {
    std::vector<std::string> all;
    std::string after;
    for (bool more = true; more;) {
      const std::vector<v1::Plan> page = session.plans().List(after, 1, more).value();
      for (const v1::Plan& plan : page) all.push_back(after = plan.name());
    }
    return all;
  };
  EXPECT_THAT(listed(*session_), testing::ElementsAre(names[0], names[2]));
  bool more = false;
  EXPECT_EQ(session_->plans().List(names[1], 9, more)->front().name(), names[2])
      << "a page goes on after one that was deleted";
  // A number is never given again, also where the last was deleted.
  ASSERT_TRUE(session_->plans().Delete(names[2], {}).ok());
  EXPECT_EQ(MakePlan(), "sessions/job/plans/plan-4");
  v1::ListPlansRequest failed;
  failed.add_states(v1::PLAN_STATE_FAILED);
  EXPECT_TRUE(session_->plans().List("", 9, more, failed)->empty());
  failed.add_states(v1::PLAN_STATE_SUCCEEDED);
  EXPECT_EQ(session_->plans().List("", 1, more, failed)->size(), 1U);
  EXPECT_TRUE(more);

  fixture::SessionHost next(store_, script_.Make());
  ASSERT_TRUE(next.registry.LoadAll().ok());
  EXPECT_THAT(listed(*next.registry.Find("job").value()),
              testing::ElementsAre(names[0], "sessions/job/plans/plan-4"));
}

TEST_F(SessionPlans, ThatRunAreNotDeletedAndACancellationIsRemembered) {
  std::latch begun(1);
  std::latch go_on(1);
  during_plan_ = [&] {
    begun.count_down();
    go_on.wait();
  };
  const std::string name = session_->plans().Create({}).value().name();
  begun.wait();
  EXPECT_EQ(contract::ReasonOf(session_->plans().Delete(name, {})), "PLAN_RUNNING");
  v1::CancelPlanRequest request;
  request.set_name(name);
  const RequestKey key = RequestKey::Of("stop", "CancelPlan", request);
  ASSERT_TRUE(session_->plans().Cancel(name, key).ok());
  go_on.count_down();
  ASSERT_TRUE(host_->registry.WaitUntilIdle(std::chrono::seconds(60)));
  EXPECT_EQ(session_->plans().Get(name)->state(), v1::PLAN_STATE_CANCELLED);
  EXPECT_TRUE(session_->journal().Knows(key));
  EXPECT_TRUE(session_->plans().Cancel(name, key).ok()) << "the same request";
  during_plan_ = [] {};
  request.set_name(MakePlan());
  EXPECT_EQ(
      contract::ReasonOf(session_->plans()
                             .Cancel(request.name(), RequestKey::Of("stop", "CancelPlan", request))
                             .status()),
      "REQUEST_ID_REUSED");
}

TEST_F(SessionPlans, ExpiredRejectionsCountForNothing) {
  constexpr int kMost = 10'000;
  for (int i = 0; i < kMost - 1; ++i) ASSERT_TRUE(Reject(i, 60).ok());
  ASSERT_TRUE(Reject(7).ok());
  EXPECT_EQ(contract::ReasonOf(Reject(1).status()), "TOO_MANY_REJECTIONS");
  seconds_ = 61;
  EXPECT_TRUE(Reject(8).ok());
  MakePlan();
  ASSERT_EQ(Config().rejected.size(), 2U);
  EXPECT_EQ(Config().rejected.front().position.x(), 7);
}

TEST_F(SessionPlans, ThatWouldTakeTooMuchMemoryAreRefused) {
  v1::CreateSessionRequest open;
  open.set_session_id("wide");
  v1::ModelConfig& model = *open.mutable_session()->mutable_model_config();
  model.set_voxel_size_m(0.1);
  model.mutable_max_half_extent()->set_x(2000);
  model.mutable_max_half_extent()->set_y(2000);
  model.mutable_max_half_extent()->set_z(50);
  // With floor everywhere between two rooms that are more than a kilometre apart.
  open.mutable_session()->mutable_planning_config()->set_floor_z_m(0);
  const auto wide = host_->registry.Create(open, "").value();
  for (const double at : {2.0, 1000.0}) {
    const v1::PosePrior prior = fixture::PriorAt(at, at, 1.4);
    ASSERT_TRUE(
        fixture::SendScan(*wide, fixture::EncodedRoom({at > 2 ? 3.0 : 2.0, 1.5, 1.4}, 3.0), &prior)
            .ok());
    wide->WaitUntilIdle();
  }
  ASSERT_EQ(wide->Describe().scan_counts().merged_count(), 2);
  const absl::Status refused = wide->plans().Create({}).status();
  EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
  EXPECT_EQ(contract::ReasonOf(refused), "PLAN_TOO_LARGE");
  bool more = false;
  EXPECT_TRUE(wide->plans().List("", 10, more).value().empty());
}

TEST_F(SessionPlans, ThatFoundOutNothingSayNothingOfWhatRemains) {
  planning::Plan nothing;
  nothing.required_density = 2500;
  nothing.outcome = planning::PlanOutcome::kSearchUnfinished;
  MakePlan(nothing);
  EXPECT_FALSE(session_->MeasureCoverage().value().has_best_remaining_model_gain_m2());
  planning::Plan found = nothing;
  found.outcome = planning::PlanOutcome::kViews;
  found.termination.best_upper = 5000;
  found.termination.best_gain_without_hidden_upper = 2;
  const std::string plan = MakePlan(found);
  MakePlan(nothing);
  nothing.outcome = planning::PlanOutcome::kNoFeasibleView;
  MakePlan(nothing);
  EXPECT_EQ(session_->MeasureCoverage()->plan(), plan);
  EXPECT_EQ(session_->MeasureCoverage()->best_remaining_model_gain_m2(), 2);
  EXPECT_EQ(session_->MeasureCoverage()->best_remaining_expected_gain_m2(), 2);
  // One that ran out of time later has evaluated views, and has a bound.
  found.outcome = planning::PlanOutcome::kSearchUnfinished;
  found.termination.best_gain_without_hidden_upper = 1;
  MakePlan(found);
  EXPECT_EQ(session_->MeasureCoverage()->best_remaining_model_gain_m2(), 1);
  nothing.outcome = planning::PlanOutcome::kNothingToGain;
  const std::string done = MakePlan(nothing);
  EXPECT_EQ(session_->MeasureCoverage()->plan(), done);
  EXPECT_EQ(session_->MeasureCoverage()->best_remaining_model_gain_m2(), 0);
}

// And one that is stopped waits for no turn.
TEST_F(SessionPlans, ThatWaitForTheirTurnSayWhen) {
  std::latch go(1);
  std::atomic<int> begun{0};
  during_plan_ = [&] {
    if (begun++ == 0) go.wait();
  };
  const std::string first = session_->plans().Create({}).value().name();
  while (begun == 0) std::this_thread::yield();
  EXPECT_FALSE(session_->plans().Get(first)->has_expected_start_time());
  std::vector<v1::Plan> waiting;
  waiting.reserve(2);
  for (int i = 0; i < 2; ++i) waiting.push_back(session_->plans().Create({}).value());
  const absl::Time now = fixture::FixtureTime();
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(waiting[static_cast<size_t>(i)].plans_ahead_count(), i);
    const absl::Time start =
        conversion::ReadTime(waiting[static_cast<size_t>(i)].expected_start_time());
    EXPECT_GE(start, now + i * absl::Seconds(1));  // by the budget of a plan that says nothing
    EXPECT_LE(start, now + absl::Seconds(2) + i * absl::Seconds(1));
  }
  const std::string last = waiting.back().name();
  ASSERT_TRUE(session_->plans().Cancel(last).ok());
  while (session_->plans().FindRun(last) != nullptr) std::this_thread::yield();
  EXPECT_EQ(session_->plans().Get(last)->state(), v1::PLAN_STATE_CANCELLED);
  go.count_down();
  EXPECT_TRUE(host_->registry.WaitUntilIdle(std::chrono::seconds(60)));
  const v1::Plan second = session_->plans().Get(waiting.front().name()).value();
  EXPECT_EQ(second.state(), v1::PLAN_STATE_SUCCEEDED);
  EXPECT_EQ(second.plans_ahead_count(), 0);
  EXPECT_FALSE(second.has_expected_start_time());
}

TEST_F(SessionPlans, EndWhenTheDiskHasRoom) {
  during_plan_ = [this] { store_.full = true; };
  planning::Plan found;
  found.outcome = planning::PlanOutcome::kViews;
  found.views.resize(1);
  found.patches.resize(3);
  const std::string plan = MakePlan(found);
  // What is shown as ended would have to survive a restart.
  const v1::Plan waits = session_->plans().Get(plan).value();
  EXPECT_EQ(waits.state(), v1::PLAN_STATE_RUNNING);
  EXPECT_THAT(waits.state_message(), HasSubstr("the disk is full"));
  EXPECT_EQ(waits.result().views_size(), 1);
  store_.full = false;
  while (session_->plans().Running() > 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  const v1::Plan ended = session_->plans().Get(plan).value();
  EXPECT_EQ(ended.state(), v1::PLAN_STATE_SUCCEEDED);
  EXPECT_EQ(ended.state_message(), "");
  EXPECT_EQ(ended.result().views_size(), 1);
  EXPECT_EQ(session_->plans().GetFullResult(plan).value().patches_size(), 3);
}

TEST_F(SessionPlans, ThatWaitForTheDiskGoWithTheirSession) {
  during_plan_ = [this] { store_.full = true; };
  const std::string plan = MakePlan();
  const std::shared_ptr<PlanRun> run = session_->plans().FindRun(plan);
  ASSERT_NE(run, nullptr);
  session_->Close();
  while (!run->Ended()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  EXPECT_EQ(session_->plans().Running(), 0U);
}

}  // namespace
}  // namespace vantage::session

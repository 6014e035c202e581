// Models that are not used are evicted and come back unchanged; work that does not fit in memory
// waits or is refused, and the server does not fail.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>

#include "core/planning/problem/planning_estimate.h"
#include "core/sensor/encoding.h"
#include "server/contract/error.h"
#include "server/store/disk_store.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::session {
namespace {

class Residence : public testing::Test {
 protected:
  Residence() : log_(telemetry::Log::Silent()) {
    std::string name = testing::TempDir() + "/residence-XXXXXX";
    folder_ = mkdtemp(name.data());
    store_ = store::DiskStore::Open(folder_).value();
  }
  ~Residence() override {
    timer_.reset();
    registry_.reset();
    pool_.reset();
    store_.reset();
    std::filesystem::remove_all(folder_);
  }

  // A host with so much memory for models, bytes.
  void Begin(int64_t budget, absl::Duration evict_after = absl::InfiniteDuration()) {
    memory_ = std::make_unique<MemoryAccount>(budget);
    pool_ = std::make_unique<execution::PlanningPool>(2, 8);
    timer_ = std::make_unique<execution::Timer>();
    contract::Limits limits;
    limits.evict_after = evict_after;
    const Journal::Clock clock = [this] { return absl::FromUnixSeconds(now_.load()); };
    registry_ = std::make_unique<SessionRegistry>(
        SessionDependencies{*store_, *pool_, *timer_, log_, limits, script_.Make(), clock, nullptr,
                            memory_.get(), fixture::SeenBy(clock)});
  }
  void Restart(int64_t budget, absl::Duration evict_after) {
    timer_.reset();
    registry_.reset();
    pool_.reset();
    store_.reset();
    store_ = store::DiskStore::Open(folder_).value();
    Begin(budget, evict_after);
    ASSERT_TRUE(registry_->LoadAll().ok());
  }

  std::shared_ptr<Session> OpenRooms(const std::string& id, const std::string& tenant = "") {
    auto session = fixture::OpenSession(*registry_, id, tenant);
    fixture::SendRoom(*session, {2.0, 1.5, 1.4}).value();
    fixture::SendRoom(*session, {3.0, 2.5, 1.4}).value();
    return session;
  }
  static void Evict(Session& session) {
    session.PostEvict();
    session.WaitUntilIdle();
  }

  static void ExpectSame(const ModelSnapshot& model, const ModelSnapshot& before) {
    EXPECT_EQ(model.version, before.version);
    ASSERT_NE(model.view, nullptr);
    ASSERT_EQ(model.view->bricks().size(), before.view->bricks().size());
    for (size_t i = 0; i < model.view->bricks().size(); ++i) {
      const model::Brick& brick = *model.view->bricks()[i].contents;
      const model::Brick& other = *before.view->bricks()[i].contents;
      EXPECT_EQ(brick.state, other.state);
      ASSERT_EQ(brick.surface.size(), other.surface.size());
      for (size_t k = 0; k < brick.surface.size(); ++k) {
        EXPECT_EQ(brick.surface[k].centroid, other.surface[k].centroid);
        EXPECT_EQ(brick.surface[k].density, other.surface[k].density);
      }
    }
  }

  std::string folder_;
  std::atomic<int64_t> now_{1'700'000'000};
  telemetry::Log log_;
  fixture::Script script_;
  std::unique_ptr<store::DiskStore> store_;
  std::unique_ptr<MemoryAccount> memory_;
  std::unique_ptr<execution::PlanningPool> pool_;
  std::unique_ptr<SessionRegistry> registry_;
  std::unique_ptr<execution::Timer> timer_;
};

TEST_F(Residence, AModelComesBackAsItWas) {
  Begin(0);
  const auto session = OpenRooms("job");
  const ModelSnapshot before = session->model().Current();
  EXPECT_GT(memory_->used(), 0);
  Evict(*session);
  EXPECT_FALSE(session->model().loaded());
  EXPECT_EQ(session->model().Current().view, nullptr);
  EXPECT_EQ(memory_->used(), 0);
  // Whatever needs no model needs no model.
  EXPECT_EQ(session->Describe().scan_counts().merged_count(), 2);
  bool more = false;
  EXPECT_EQ(session->scans().List("", 10, more).value().size(), 2U);
  EXPECT_FALSE(session->model().loaded());
  // The first that does is told to come again, and then it is there.
  EXPECT_EQ(contract::ReasonOf(session->MeasureCoverage().status()), "MODEL_LOADING");
  session->WaitUntilIdle();
  ExpectSame(session->model().Current(), before);
  EXPECT_TRUE(session->MeasureCoverage().ok());
  EXPECT_GT(memory_->used(), 0);
}

TEST_F(Residence, AScanForAModelThatIsAwayIsMergedIntoIt) {
  Begin(0);
  const auto stays = OpenRooms("stays");
  const auto leaves = OpenRooms("leaves");
  Evict(*leaves);
  fixture::SendRoom(*stays, {1.0, 2.0, 1.4}).value();
  fixture::SendRoom(*leaves, {1.0, 2.0, 1.4}).value();
  EXPECT_TRUE(leaves->model().loaded());
  ExpectSame(leaves->model().Current(), stays->model().Current());
}

TEST_F(Residence, WhoIsUsedStays) {
  Begin(0);
  const auto session = OpenRooms("job");
  v1::CreatePlanRequest create;
  create.set_parent("sessions/job");
  create.mutable_plan()->mutable_time_budget()->set_seconds(3000);
  const auto plan = session->plans().Create(create);
  ASSERT_TRUE(plan.ok()) << plan.status();
  script_.WaitForPlans(1);
  Evict(*session);
  EXPECT_TRUE(session->model().loaded());
  const int64_t with_plan = memory_->used();
  script_.EndPlans();
  while (session->plans().Running() > 0) std::this_thread::yield();
  Evict(*session);
  EXPECT_FALSE(session->model().loaded());
  EXPECT_LT(memory_->used(), with_plan);
}

TEST_F(Residence, UnusedModelsAreCollectedAfterTheirTime) {
  Begin(0, absl::Minutes(30));
  const auto idle = OpenRooms("idle");
  now_ += 29 * 60;
  const auto busy = OpenRooms("busy");
  registry_->Collect();
  idle->WaitUntilIdle();
  EXPECT_TRUE(idle->model().loaded());
  now_ += 2 * 60;
  registry_->Collect();
  idle->WaitUntilIdle();
  busy->WaitUntilIdle();
  EXPECT_FALSE(idle->model().loaded());
  EXPECT_TRUE(busy->model().loaded());
  EXPECT_EQ(registry_->Totals().loaded, 1U);
}

// What was not used for long is left on disk by a start, too.
TEST_F(Residence, AStartLoadsWhatIsUsed) {
  Begin(0);
  OpenRooms("old");
  now_ += 60 * 60;
  OpenRooms("new");
  Restart(0, absl::Minutes(30));
  const auto old = registry_->Find("old").value();
  const auto recent = registry_->Find("new").value();
  old->WaitUntilIdle();
  recent->WaitUntilIdle();
  EXPECT_FALSE(old->model().loaded());
  EXPECT_TRUE(recent->model().loaded());
  EXPECT_EQ(contract::ReasonOf(old->MeasureCoverage().status()), "MODEL_LOADING");
  old->WaitUntilIdle();
  EXPECT_TRUE(old->MeasureCoverage().ok());
}

TEST_F(Residence, WhatDoesNotFitIsRefusedAndComesWhenThereIsRoom) {
  Begin(0);
  int64_t one = 0;
  {
    const auto first = OpenRooms("first");
    one = first->model().Estimate();
    OpenRooms("second");
  }
  now_ += 60;
  // Room for one of the two.
  Restart(one + one / 2, absl::ZeroDuration());
  const auto first = registry_->Find("first").value();
  const auto second = registry_->Find("second").value();
  EXPECT_EQ(contract::ReasonOf(first->MeasureCoverage().status()), "MODEL_LOADING");
  first->WaitUntilIdle();
  ASSERT_TRUE(first->model().loaded());
  const absl::Status refused = second->MeasureCoverage().status();
  EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
  EXPECT_EQ(contract::ReasonOf(refused), "MEMORY_SHORT");
  second->WaitUntilIdle();
  EXPECT_FALSE(second->model().loaded());
  EXPECT_LE(memory_->used(), memory_->budget());
  // Used just now, the first one stays; after a while it makes room.
  registry_->FreeMemory({one, "", false});
  first->WaitUntilIdle();
  EXPECT_TRUE(first->model().loaded());
  now_ += 60;
  registry_->FreeMemory({one, "", false});
  first->WaitUntilIdle();
  EXPECT_FALSE(first->model().loaded());
  EXPECT_EQ(contract::ReasonOf(second->MeasureCoverage().status()), "MODEL_LOADING");
  second->WaitUntilIdle();
  EXPECT_TRUE(second->MeasureCoverage().ok());
}

// Models of one tenant that are used all the time do not keep another from its share.
TEST_F(Residence, WhoHasMoreThanItsShareMakesRoomForOneWhoLacksIt) {
  Begin(0);
  int64_t one = 0;
  for (const char* id : {"a", "b", "c"}) one = OpenRooms(id, "greedy")->model().Estimate();
  OpenRooms("q", "quiet");
  now_ += 60;  // so that a start loads none
  Restart(0, absl::ZeroDuration());
  const int64_t unloaded = registry_->Find("c").value()->model().Estimate();
  // Room for the greedy one's three beside the eighth that it has to leave, not for a fourth.
  Restart((2 * one + unloaded) * 8 / 7 + 8, absl::ZeroDuration());
  memory_->OnShortage(
      [this](const MemoryAccount::Shortage& shortage) { registry_->FreeMemory(shortage); });
  const auto load = [&](const char* id) {
    const auto session = registry_->Find(id).value();
    const absl::Status status = session->MeasureCoverage().status();
    for (const char* other : {"a", "b", "c", "q"}) registry_->Find(other).value()->WaitUntilIdle();
    return contract::ReasonOf(status);
  };
  for (const char* id : {"a", "b", "c"}) EXPECT_EQ(load(id), "MODEL_LOADING");
  ASSERT_EQ(registry_->Totals().loaded, 3U);
  std::string asked = load("q");
  EXPECT_FALSE(registry_->Find("a").value()->model().loaded());  // the longest unused
  if (asked == "MEMORY_SHORT") {  // the room came too late for that call
    EXPECT_EQ(registry_->Totals().loaded, 2U);
    EXPECT_EQ(load("a"), "MEMORY_SHORT");  // whoever asks first
    asked = load("q");
  }
  EXPECT_EQ(asked, "MODEL_LOADING");
  EXPECT_TRUE(registry_->Find("q").value()->model().loaded());
  memory_->OnNoShortage();
}

TEST_F(Residence, AScanThatDoesNotFitSaysSoAndComesWhenThereIsRoom) {
  Begin(0);
  OpenRooms("job");
  Restart(1, absl::InfiniteDuration());  // the model alone is more, and is tried alone
  auto session = registry_->Find("job").value();
  session->WaitUntilIdle();
  const v1::PosePrior prior = fixture::PriorAt(1.0, 2.0, 1.4);
  const std::string scan =
      fixture::SendScan(*session, fixture::EncodedRoom({1.0, 2.0, 1.4}, 3.0), &prior)
          .value()
          .scan();
  session->WaitUntilIdle();
  EXPECT_EQ(session->scans().Get(scan)->state(), v1::SCAN_STATE_RECEIVED);
  EXPECT_THAT(session->scans().Get(scan)->state_message(), ::testing::HasSubstr("memory"));
  bool more = false;
  EXPECT_THAT(
      session->scans().List("sessions/job/scans/scan-2", 1, more).value().at(0).state_message(),
      ::testing::HasSubstr("memory"));
  session = nullptr;
  Restart(0, absl::InfiniteDuration());
  session = registry_->Find("job").value();
  session->WaitUntilIdle();
  EXPECT_EQ(session->scans().Get(scan)->state(), v1::SCAN_STATE_MERGED);
  EXPECT_EQ(session->scans().Get(scan)->state_message(), "");
}

TEST_F(Residence, APlanTakesWhatItsCellsAndScannersNeed) {
  Begin(0);
  v1::CreateSessionRequest open;
  open.set_session_id("job");
  open.mutable_session()->mutable_model_config()->set_voxel_size_m(0.1);
  for (const char* id : {"a", "same", "far"}) {
    open.mutable_session()->add_scanner_models()->set_id(id);
  }
  open.mutable_session()->mutable_scanner_models(2)->set_max_range_m(50);
  const auto session = registry_->Create(open, "").value();
  fixture::SendRoom(*session, {2.0, 1.5, 1.4}).value();
  for (const char* id : {"a", "same", "far"}) {
    v1::CreateScannerRequest add;
    add.set_scanner_id(id);
    add.mutable_scanner()->set_scanner_model_id(id);
    ASSERT_TRUE(session->scanners().Create(add).ok());
  }
  const auto taken = [&](const v1::CreatePlanRequest& request) {
    const int64_t before = memory_->used();
    EXPECT_TRUE(session->plans().Create(request).ok());
    return memory_->used() - before;
  };
  v1::CreatePlanRequest plan;
  plan.mutable_plan()->mutable_time_budget()->set_seconds(3000);
  const int64_t one = taken(plan);
  EXPECT_EQ(one, static_cast<int64_t>(
                     planning::EstimatePlanningMemory(*session->model().Current().view, {})));
  plan.mutable_plan()->mutable_config_overrides()->set_viewcell_size_m(0.2);
  EXPECT_LT(taken(plan), one);
  plan.mutable_plan()->clear_config_overrides();
  plan.mutable_plan()->add_scanners("sessions/job/scanners/a");
  plan.mutable_plan()->add_scanners("sessions/job/scanners/same");
  EXPECT_EQ(taken(plan), one);
  plan.mutable_plan()->add_scanners("sessions/job/scanners/far");
  EXPECT_EQ(taken(plan), 2 * one);
  session->plans().Stop(PlanRun::StopReason::kCancelled);
  while (session->plans().Running() > 0) std::this_thread::yield();
}

TEST_F(Residence, APlanThatDoesNotFitIsRefused) {
  Begin(0);
  OpenRooms("job");
  Restart(1, absl::InfiniteDuration());  // the model alone is more, and is tried alone
  const auto session = registry_->Find("job").value();
  session->WaitUntilIdle();
  ASSERT_TRUE(session->model().loaded());
  v1::CreatePlanRequest create;
  create.set_parent("sessions/job");
  const absl::Status refused = session->plans().Create(create).status();
  EXPECT_EQ(contract::ReasonOf(refused), "PLAN_TOO_LARGE");
  EXPECT_EQ(session->plans().Running(), 0U);
}

// 8 kB as they are sent, and gigabytes when merged.
TEST_F(Residence, AScanThatTakesMoreThanThereIsFails) {
  constexpr int64_t kBudget = 256 << 20;
  Begin(kBudget);
  const auto session = fixture::OpenSession(*registry_, "job");
  sensor::RangeImage image = fixture::ScanRoom({2.0, 1.5, 1.4}, 2.0);
  std::fill(image.range.begin(), image.range.end(), 90.0F);
  v1::UpdateSessionRequest far;
  far.mutable_session()->add_scanner_models()->set_max_range_m(100);
  far.mutable_update_mask()->add_paths("scanner_models");
  ASSERT_TRUE(session->Update(far).ok());
  const v1::PosePrior prior = fixture::PriorAt(2.0, 1.5, 1.4);
  const std::string scan =
      fixture::SendScan(*session, sensor::EncodeRangeImage(image), &prior).value().scan();
  session->WaitUntilIdle();
  const v1::Scan failed = session->scans().Get(scan).value();
  EXPECT_EQ(failed.state(), v1::SCAN_STATE_FAILED);
  EXPECT_THAT(failed.state_message(), ::testing::HasSubstr("the server has 256 MiB"));
  EXPECT_LE(memory_->used(), kBudget);
  // Others go on.
  EXPECT_TRUE(fixture::SendRoom(*session, {2.0, 1.5, 1.4}).ok());
}

}  // namespace
}  // namespace vantage::session

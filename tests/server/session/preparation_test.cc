// What is made ready before anybody asks.
#include "server/session/preparation.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "server/store/memory_store.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::session {
namespace {

// How much there was to do.
class CountingParallel final : public parallel::Parallel {
 public:
  int width() const override { return 1; }
  void For(size_t count, absl::FunctionRef<void(size_t)> body) override {
    ++loops;
    serial_.For(count, body);
  }
  int loops = 0;

 private:
  parallel::Serial serial_;
};

class PreparationTest : public testing::Test {
 protected:
  PreparationTest() {
    Algorithms algorithms = script_.Make();
    algorithms.make_plan = [this](const PlanningTask& task, const parallel::Budget&,
                                  parallel::Parallel&,
                                  const planning::PlanProgress&) -> absl::StatusOr<planning::Plan> {
      CountingParallel parallel;
      EXPECT_TRUE(task.prepare(parallel, {}).ok());
      loops_ = parallel.loops;
      return planning::Plan();
    };
    host_ = std::make_unique<fixture::SessionHost>(store_, std::move(algorithms));
    session_ = fixture::OpenSession(host_->registry, "job");
  }
  void Scan(double x) {
    EXPECT_TRUE(fixture::SendRoom(*session_, {x, 1.5, 1.4}).ok());
    session_->WaitUntilIdle();
  }
  // Whether a plan finds its problem made.
  bool FindsItReady(std::optional<double> density = {}) {
    v1::CreatePlanRequest request;
    if (density.has_value()) {
      request.mutable_plan()->mutable_config_overrides()->set_required_density_per_m2(*density);
    }
    EXPECT_TRUE(session_->plans().Create(request).ok());
    EXPECT_TRUE(host_->registry.WaitUntilIdle(std::chrono::seconds(60)));
    return loops_ == 0;
  }

  std::atomic<int> loops_{-1};
  store::MemoryStore store_{size_t{64} << 20};
  fixture::Script script_;
  std::unique_ptr<fixture::SessionHost> host_;
  std::shared_ptr<Session> session_;
};

TEST_F(PreparationTest, IsDoneOrAwaitedByTheFirstPlanAfterEachMerge) {
  for (const double x : {1.5, 2.5, 3.5}) {
    Scan(x);
    EXPECT_TRUE(FindsItReady()) << x;
  }
}

TEST_F(PreparationTest, IsForWhatTheLastPlanAsked) {
  Scan(1.5);
  EXPECT_FALSE(FindsItReady(5000));
  Scan(2.5);
  EXPECT_TRUE(FindsItReady(5000));
  EXPECT_FALSE(FindsItReady());
  Scan(3.5);
  EXPECT_TRUE(FindsItReady());
}

TEST_F(PreparationTest, IsDoneAfterAScanWasWithdrawn) {
  Scan(1.5);
  const absl::StatusOr<std::string> second = fixture::SendRoom(*session_, {2.5, 1.5, 1.4});
  ASSERT_TRUE(second.ok());
  ASSERT_TRUE(session_->scans().Withdraw(*second, {}).ok());
  session_->WaitUntilIdle();
  EXPECT_TRUE(FindsItReady());
}

// What was being made when it was to be forgotten is of a model that is gone, or memory is short.
TEST_F(PreparationTest, IsForgottenWithTheModel) {
  Scan(1.5);
  session_->PostEvict();
  session_->WaitUntilIdle();
  EXPECT_TRUE(session_->preparation().Rests());
  EXPECT_EQ(session_->model().Current().view, nullptr);
}

TEST_F(PreparationTest, KeepsNobodyFromEnding) {
  Scan(1.5);
  host_->registry.BeginDrain();
  EXPECT_TRUE(host_->registry.WaitUntilIdle(std::chrono::seconds(60)));
}

}  // namespace
}  // namespace vantage::session

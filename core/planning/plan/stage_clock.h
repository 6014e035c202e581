// Measures how long the stages of a plan take.
#ifndef VANTAGE_CORE_PLANNING_PLAN_STAGE_CLOCK_H_
#define VANTAGE_CORE_PLANNING_PLAN_STAGE_CLOCK_H_

#include <array>
#include <chrono>
#include <cstddef>

#include "core/planning/plan/plan.h"

namespace vantage::planning {

// Books the time since the last call, or since it was made, on a stage. `seconds` outlive it.
class StageClock {
 public:
  using Clock = std::chrono::steady_clock;

  explicit StageClock(std::array<double, kPlanStages>& seconds) : seconds_(seconds) {}
  void Book(PlanStage stage) {
    const Clock::time_point now = Clock::now();
    seconds_[static_cast<size_t>(stage)] += std::chrono::duration<double>(now - last_).count();
    last_ = now;
  }

 private:
  std::array<double, kPlanStages>& seconds_;
  Clock::time_point last_ = Clock::now();
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PLAN_STAGE_CLOCK_H_

// The surface that predictions are made of, beside a plain walk over the model.
#include "core/planning/scoring/overlap_surface.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <memory>

#include "core/parallel/thread_pool.h"
#include "core/visibility/target.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/planning_problem.h"

namespace vantage::planning {
namespace {

test_support::PlanningProblem Room() {
  PlanningConfig config;
  config.viewcell_size = 0.5;
  return {std::make_shared<model::PlanningView>(
              test_support::BuildView(test_support::FurnishedRoom(3))),
          config};
}

TEST(OverlapSurfaceTest, IsEveryNthVoxelOfTrueSurface) {
  const test_support::PlanningProblem room = Room();
  size_t surface = 0;
  size_t expected = 0;
  const auto count = [&](size_t stride) {
    surface = expected = 0;
    room.model->ForEachSurface(
        [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& voxel) {
          if (state != model::VoxelState::kTrueSurface) return;
          if (surface++ % stride != 0 || !(voxel.area > 0)) return;
          expected += visibility::TargetOf(room.grid, v, voxel.normal).has_value() ? 1 : 0;
        });
  };
  count(1);
  const size_t stride = (surface + 15'999) / 16'000;
  EXPECT_GT(stride, 1);  // else nothing is thinned
  count(stride);
  EXPECT_EQ(room.problem->overlap().MostRays(), expected);
}

TEST(OverlapSurfaceTest, IsTheSameOnAnyNumberOfThreads) {
  const test_support::PlanningProblem room = Room();
  for (const int threads : {2, 7}) {
    parallel::ThreadPool pool(threads);
    const auto other =
        OverlapSurface::Create(*room.model, room.grid, room.problem->scene(), room.scanner, pool)
            .value();
    for (size_t i = 0; i < room.views.size(); i += 1 + room.views.size() / 8) {
      const auto predict = [&](const OverlapSurface& overlap) {
        return overlap
            .Predict(room.views[i], room.problem->scene(), room.config.registration,
                     parallel::Budget::Unlimited())
            ->verdict;
      };
      const registration::RegistrationVerdict one = predict(room.problem->overlap());
      const registration::RegistrationVerdict many = predict(other);
      EXPECT_EQ(one.overlap_share, many.overlap_share);
      EXPECT_EQ(one.judged_bound, many.judged_bound);
    }
  }
}

}  // namespace
}  // namespace vantage::planning

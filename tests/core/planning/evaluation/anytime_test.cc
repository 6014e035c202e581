#include "core/planning/evaluation/anytime.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stop_token>
#include <vector>

#include "core/parallel/thread_pool.h"
#include "core/planning/evaluation/confidence_bounds.h"
#include "core/planning/evaluation/view_lattice.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/planning_problem.h"

namespace vantage::planning {
namespace {

TEST(MeanBoundsTest, HoldTheBinomialTail) {
  // For a fair or unfair coin the failure probability can be summed exactly.
  for (const uint64_t n : {20u, 200u}) {
    for (const double p : {0.0, 0.03, 0.5, 0.9, 1.0}) {
      const double error = 0.01;
      MeanBounds bounds(n, -std::log(error));
      double above = 0;
      double below = 0;
      for (uint64_t k = 0; k <= n; ++k) {
        const auto x = static_cast<double>(k);
        const auto all = static_cast<double>(n);
        double log_chance = std::lgamma(all + 1) - std::lgamma(x + 1) - std::lgamma(all - x + 1);
        if (k > 0) log_chance += x * std::log(p);
        if (k < n) log_chance += (all - x) * std::log(1 - p);
        const double chance = std::exp(log_chance);
        const double average = x / all;
        EXPECT_LE(bounds.Lower(average), average);
        EXPECT_GE(bounds.Upper(average), average);
        if (bounds.Upper(average) < p) above += chance;
        if (bounds.Lower(average) > p) below += chance;
      }
      EXPECT_LE(above, error);
      EXPECT_LE(below, error);
    }
  }
}

TEST(MeanBoundsTest, TightenWithDraws) {
  MeanBounds few(100, 10);
  MeanBounds many(10000, 10);
  EXPECT_GT(few.Upper(0.2) - few.Lower(0.2), 5 * (many.Upper(0.2) - many.Lower(0.2)));
}

TEST(HashToUnitTest, FillsTheUnitInterval) {
  double sum = 0;
  for (uint64_t i = 0; i < 10000; ++i) {
    const double u = HashToUnit(1, 2, i);
    ASSERT_GE(u, 0);
    ASSERT_LT(u, 1);
    sum += u;
  }
  EXPECT_NEAR(sum / 10000, 0.5, 0.01);
}

struct AnytimeProblem : test_support::PlanningProblem {
  explicit AnytimeProblem(const test_support::ClosedFormScene& scene, double viewcell = 0.2)
      : test_support::PlanningProblem(
            std::make_shared<model::PlanningView>(test_support::BuildView(scene)),
            ConfigWith(viewcell)) {
    truth = BruteForce(serial);
  }
  static PlanningConfig ConfigWith(double viewcell) {
    PlanningConfig config;
    config.viewcell_size = viewcell;
    return config;
  }
  Evaluation Evaluate(const AnytimeOptions& options, const parallel::Budget& budget,
                      parallel::Parallel& parallel) const {
    return EvaluateViews(scoring->scorer(), feasible,
                         static_cast<const CellArrays&>(scoring->cells()), options, budget,
                         parallel, [](const Evaluation&) {});
  }
  double Best() const {
    double best = 0;
    for (const ViewScore& score : truth) best = std::max(best, score.score);
    return best;
  }

  std::vector<ViewScore> truth;
};

// All that is missing lies behind a slit: hardly any view sees any of it.
test_support::ClosedFormScene Slit() {
  test_support::ClosedFormScene scene;
  const Eigen::AlignedBox3d room(Eigen::Vector3d::Zero(), Eigen::Vector3d(5, 4, 2.6));
  scene.extent = Eigen::AlignedBox3d(room.min().array() - 0.1, room.max().array() + 0.1);
  scene.solid = [=](const Eigen::Vector3d& p) {
    return !room.contains(p) || (std::abs(p.x() - 3.5) < 0.1 && std::abs(p.y() - 1.97) > 0.06);
  };
  scene.density = [](const Eigen::Vector3d& p) { return p.x() < 3.55 ? 5000 : 0; };
  scene.stations = {test_support::MakeStation(Eigen::Vector3d(1.5, 2, 1.5))};
  return scene;
}

// One wall holds everything.
test_support::ClosedFormScene OneWall() {
  test_support::ClosedFormScene scene = test_support::FurnishedRoom(4);
  scene.density = [](const Eigen::Vector3d& p) { return p.x() < 0 ? 0 : 5000; };
  scene.known = [](const Eigen::Vector3d&) { return true; };
  return scene;
}

TEST(AnytimeTest, WithoutLimitIsBruteForceToTheBit) {
  const AnytimeProblem problem(test_support::FurnishedRoom(6));
  ASSERT_GT(problem.views.size(), 50u);
  parallel::Serial serial;
  const Evaluation evaluation = problem.Evaluate({}, parallel::Budget::Unlimited(), serial);
  EXPECT_TRUE(evaluation.complete);
  EXPECT_EQ(evaluation.exact, problem.views.size());
  for (size_t i = 0; i < problem.views.size(); ++i) {
    EXPECT_EQ(evaluation.views[i].score, problem.truth[i].score);
    EXPECT_EQ(evaluation.views[i].lower, problem.truth[i].score);
    EXPECT_EQ(evaluation.views[i].upper, problem.truth[i].score);
  }
}

TEST(AnytimeTest, SameBytesOnAnyNumberOfThreadsUnderAWorkLimit) {
  const AnytimeProblem problem(test_support::FurnishedRoom(6));
  parallel::Budget budget;
  for (const uint64_t limit : {20'000u, 200'000u, 1'000'000u}) {
    budget.work_limit = limit;
    AnytimeOptions options;
    options.race.first_draws = 128;
    parallel::Serial serial;
    const Evaluation one = problem.Evaluate(options, budget, serial);
    EXPECT_FALSE(one.complete);
    for (const int threads : {2, 16}) {
      parallel::ThreadPool pool(threads);
      const Evaluation other = problem.Evaluate(options, budget, pool);
      EXPECT_EQ(one.rays, other.rays);
      EXPECT_EQ(one.exact, other.exact);
      ASSERT_EQ(one.views.size(), other.views.size());
      for (size_t i = 0; i < one.views.size(); ++i) {
        ASSERT_EQ(one.views[i].score, other.views[i].score);
        ASSERT_EQ(one.views[i].lower, other.views[i].lower);
        ASSERT_EQ(one.views[i].upper, other.views[i].upper);
      }
    }
  }
}

TEST(AnytimeTest, WhereToGoFirstIsNoWorseThanItsSurroundings) {
  const AnytimeProblem problem(test_support::FurnishedRoom(6));
  parallel::Serial serial;
  AnytimeOptions options;
  options.complete = false;
  for (options.seed = 1; options.seed <= 10; ++options.seed) {
    const Evaluation evaluation = problem.Evaluate(options, parallel::Budget::Unlimited(), serial);
    ASSERT_TRUE(evaluation.decided);
    ASSERT_LT(evaluation.exact, problem.views.size() / 2);
    const uint32_t first = ByScore(evaluation).front();
    for (const int step : {1, 2}) {
      for (int k = 0; k < 6; ++k) {
        Eigen::Vector3i to = problem.feasible.cells()[first];
        to[k / 2] += k % 2 == 0 ? step : -step;
        const int i = problem.feasible.IndexOf(to);
        if (i < 0) continue;
        EXPECT_TRUE(evaluation.views[static_cast<size_t>(i)].exact);
        EXPECT_LE(problem.truth[static_cast<size_t>(i)].score, problem.truth[first].score);
      }
    }
  }
}

class HonestyTest : public ::testing::TestWithParam<int> {
 protected:
  static test_support::ClosedFormScene Scene(int which) {
    if (which == 0) return Slit();
    if (which == 1) return OneWall();
    return test_support::FurnishedRoom(static_cast<uint64_t>(which));
  }
  HonestyTest() : problem_(Coarse(Scene(GetParam())), 0.3) {}
  static test_support::ClosedFormScene Coarse(test_support::ClosedFormScene scene) {
    scene.voxel = 0.1;
    return scene;
  }
  // `rays_a_view`: the work limit.
  Evaluation Evaluate(uint64_t seed, uint64_t rays_a_view) {
    AnytimeOptions options;
    options.seed = seed;
    options.race.first_draws = 60;
    parallel::Budget budget;
    budget.work_limit = rays_a_view * problem_.views.size();
    return problem_.Evaluate(options, budget, serial_);
  }
  // The view that would be returned: the first of the ranking.
  static std::optional<uint32_t> Answer(const Evaluation& evaluation) {
    const std::vector<uint32_t> ranked = ByScore(evaluation);
    if (ranked.empty()) return std::nullopt;
    return ranked.front();
  }
  double Gain(uint32_t view) const { return problem_.truth[view].score; }

  AnytimeProblem problem_;
  parallel::Serial serial_;
};

// 200 plans of each of the five scenes.
TEST_P(HonestyTest, BoundsHoldTogetherAndTheBestIsWithinTheGap) {
  ASSERT_GT(problem_.views.size(), 30u);
  constexpr uint64_t kRays[] = {3, 20, 150};
  const double best = problem_.Best();
  int plans = 0;
  int outside_bounds = 0;
  int outside_gap = 0;
  int informative = 0;
  for (uint64_t seed = 1; seed <= 200; ++seed) {
    const Evaluation evaluation = Evaluate(seed, kRays[seed % 3]);
    ASSERT_FALSE(evaluation.complete);
    bool holds = true;
    double most = 0;
    for (uint32_t i = 0; i < problem_.views.size(); ++i) {
      const ViewEstimate& view = evaluation.views[i];
      ASSERT_LE(view.lower, view.upper);
      if (view.scored) {
        ASSERT_GE(view.score, view.lower);
        ASSERT_LE(view.score, view.upper);
      }
      if (view.exact) {
        ASSERT_EQ(view.score, Gain(i));
        ASSERT_EQ(view.error, 0);
      }
      holds = holds && Gain(i) >= view.lower - 1e-9 && Gain(i) <= view.upper + 1e-9;
      most = std::max(most, view.upper);
    }
    const std::optional<uint32_t> answer = Answer(evaluation);
    const double gap = answer ? 1 - evaluation.views[*answer].lower / most : 1;
    const double lost = answer ? 1 - Gain(*answer) / best : 1;
    ++plans;
    outside_bounds += !holds;
    outside_gap += lost > gap + 1e-9;
    informative += gap < 0.999;
  }
  // The confidence is 95 % and the bounds are conservative by far.
  EXPECT_LE(outside_bounds, plans / 20) << "of " << plans;
  EXPECT_LE(outside_gap, plans / 20) << "of " << plans;
  EXPECT_GT(informative, plans / 4);  // or the gap says nothing
}

// Over 200 seeds the mean is known to 0.15 %, no better than what it falls by on a plateau.
TEST_P(HonestyTest, MeanRegretDoesNotRiseWithTheBudget) {
  constexpr uint64_t kSeeds = 1000;
  double last = 1;
  for (const uint64_t rays : {1, 4, 16, 64, 256}) {
    double sum = 0;
    for (uint64_t seed = 1; seed <= kSeeds; ++seed) {
      const std::optional<uint32_t> answer = Answer(Evaluate(seed, rays));
      sum += answer ? 1 - Gain(*answer) / problem_.Best() : 1;
    }
    const double mean = sum / kSeeds;
    EXPECT_LE(mean, last + 1e-12) << rays << " rays a view";
    last = mean;
  }
  // Behind the slit a sample finds little, and no budget short of scoring every view is sure to.
  if (GetParam() != 0) {
    EXPECT_LT(last, 0.01);
  }
}
INSTANTIATE_TEST_SUITE_P(Scenes, HonestyTest, ::testing::Range(0, 5));

TEST(AnytimeTest, CancelledIsNotComplete) {
  const AnytimeProblem problem(test_support::FurnishedRoom(6));
  std::stop_source source;
  parallel::Budget budget;
  budget.cancelled = source.get_token();
  source.request_stop();
  parallel::ThreadPool pool(2);
  const Evaluation none = problem.Evaluate({}, budget, pool);
  EXPECT_FALSE(none.any());
  EXPECT_EQ(none.rays, 0u);
  // Cancelled from within, at the first sign of progress: what there is stays valid.
  std::stop_source later;
  budget.cancelled = later.get_token();
  AnytimeOptions options;
  options.race.first_draws = 128;
  const Evaluation some =
      EvaluateViews(problem.scoring->scorer(), problem.feasible, problem.scoring->cells(), options,
                    budget, pool, [&](const Evaluation&) { later.request_stop(); });
  EXPECT_TRUE(some.any());
  EXPECT_FALSE(some.complete);
  for (const ViewEstimate& view : some.views) EXPECT_LE(view.lower, view.upper);
}

// People want to see something soon; what is done until then changes nothing of what comes.
TEST(AnytimeTest, ShowsAFirstLookLongBeforeTheRaceEnds) {
  const test_support::PlanningProblem problem(
      std::make_shared<model::PlanningView>(
          test_support::BuildView(test_support::FurnishedRoom(6))),
      AnytimeProblem::ConfigWith(0.1));
  parallel::Serial serial;
  std::vector<uint64_t> shown;
  std::stop_source enough;
  parallel::Budget budget = parallel::Budget::Unlimited();
  budget.cancelled = enough.get_token();
  (void)EvaluateViews(problem.scoring->scorer(), problem.feasible, problem.scoring->cells(), {},
                      budget, serial, [&](const Evaluation& so_far) {
                        EXPECT_TRUE(so_far.any());
                        shown.push_back(so_far.rays);
                        if (shown.size() == 2) enough.request_stop();
                      });
  ASSERT_GE(shown.size(), 2u);
  EXPECT_LE(shown[0], uint64_t{1} << 20);
  EXPECT_LT(2 * shown[0], shown[1]);
}

TEST(ViewLatticeTest, StartsWithTheCoarsestLevel) {
  std::vector<Eigen::Vector3i> cells;
  for (int z = 0; z < 8; ++z) {
    for (int y = 0; y < 8; ++y) {
      for (int x = 0; x < 8; ++x) cells.emplace_back(x - 3, y + 5, z);
    }
  }
  ViewLattice lattice(cells, 1);
  std::vector<uint32_t> order;
  while (const auto next = lattice.Next()) order.push_back(*next);
  ASSERT_EQ(order.size(), cells.size());
  for (size_t k = 1; k < order.size(); ++k) {
    EXPECT_LE(lattice.Level(cells[order[k]]), lattice.Level(cells[order[k - 1]]));
  }
  // Eight cells in the box lie on a lattice of 4, wherever it begins.
  for (size_t k = 0; k < 8; ++k) {
    const Eigen::Vector3i c = cells[order[k]] - cells[order[0]];
    EXPECT_EQ((c.x() | c.y() | c.z()) & 3, 0) << k;
  }
  std::vector<uint32_t> sorted = order;
  std::sort(sorted.begin(), sorted.end());
  for (uint32_t i = 0; i < sorted.size(); ++i) EXPECT_EQ(sorted[i], i);
}

}  // namespace
}  // namespace vantage::planning

#include "core/tour/tour_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <optional>
#include <span>
#include <vector>

#include "core/cover/element_set.h"
#include "core/parallel/parallel.h"
#include "core/planning/evaluate_view.h"
#include "core/tour/spread_views.h"
#include "tests/core/tour/flat_tour.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/planning_problem.h"

namespace vantage::tour {
namespace {

class TourTableTest : public ::testing::Test {
 protected:
  static planning::PlanningConfig Config() {
    planning::PlanningConfig config;
    config.viewcell_size = 0.2;
    config.max_viewpoint_height = 1.7;
    return config;
  }
  bool SeeEachOther(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const {
    const double voxel = problem_.model().voxel_size();
    const Eigen::Vector3f to = problem_.scene().ToScene(b / voxel);
    visibility::TargetPacket packet{};
    packet.x[0] = to.x();
    packet.y[0] = to.y();
    packet.z[0] = to.z();
    return problem_.scene().Occluded(problem_.scene().ToScene(a / voxel), packet, 1) == 0;
  }
  parallel::Serial serial_;
  const test_support::PlanningProblem room_{
      std::make_shared<const model::PlanningView>(
          test_support::BuildView(test_support::FurnishedRoom(3))),
      Config()};
  const planning::PlanningProblem& problem_ = *room_.problem;
  const parallel::Budget unlimited_ = parallel::Budget::Unlimited();
};

TEST_F(TourTableTest, BringsWhatAPlanSaysThatAViewBrings) {
  const GainElements all = GainElements::Of(problem_, 10'000'000, 0, serial_);
  ASSERT_GT(all.weights.size(), 1000u);
  size_t compared = 0;
  for (const Candidate& candidate : SpreadViews(problem_, 1.0, 100)) {
    uint64_t rays = 0;
    const auto brought = Brought(problem_, candidate, all, unlimited_, rays);
    ASSERT_TRUE(brought.has_value());
    double area = 0;
    for (size_t i = 0; i < all.weights.size(); ++i) {
      if (((*brought)[i / 64] >> (i % 64) & 1) != 0) area += all.weights[i];
    }
    const auto evaluated = planning::EvaluateView(problem_, candidate.position).value();
    ASSERT_TRUE(evaluated.view.model_gain.has_value());
    EXPECT_NEAR(area, *evaluated.view.model_gain, 0.01 * area + 0.01);
    ++compared;
  }
  EXPECT_GT(compared, 5u);
}

TEST_F(TourTableTest, EveryNthElementWeighsNTimes) {
  const GainElements all = GainElements::Of(problem_, 10'000'000, 0, serial_);
  const GainElements few = GainElements::Of(problem_, all.weights.size() / 5, 0, serial_);
  EXPECT_LE(few.weights.size(), all.weights.size() / 5);
  EXPECT_NEAR(few.total, all.total, 0.02 * all.total);
}

TEST_F(TourTableTest, CandidatesSeeAllThatFeasibleViewsSee) {
  const double spacing = 0.8;
  const auto places = SpreadViews(problem_, spacing, 1000);
  ASSERT_GT(places.size(), 10u);
  // Those that see each other are apart; where two are nearer, something stands between them.
  size_t near = 0;
  for (size_t i = 0; i < places.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      const double apart = (places[i].position - places[j].position).norm();
      EXPECT_GE(apart, problem_.feasible().cell_size()) << i << " " << j;
      if (apart >= 0.75 * spacing) continue;
      EXPECT_FALSE(SeeEachOther(places[i].position, places[j].position)) << i << " " << j;
      ++near;
    }
  }
  EXPECT_LT(4 * near, places.size());
  // Nobody can stand farther from all candidates than a candidate lies from the next.
  for (const Eigen::Vector3d& view : room_.views) {
    double least = 1e9;
    for (const Candidate& place : places) {
      least = std::min(least, (place.position - view).head<2>().norm());
    }
    EXPECT_LE(least, spacing);
  }
  // So what all feasible views bring, the candidates bring, but for corners.
  const GainElements elements = GainElements::Of(problem_, 4000, 0, serial_);
  const auto brought = [&](std::span<const Candidate> by) {
    cover::ElementSet all = cover::EmptySet(elements.weights.size());
    uint64_t rays = 0;
    for (const Candidate& place : by) {
      cover::Unite(all, *Brought(problem_, place, elements, unlimited_, rays));
    }
    double area = 0;
    cover::ForEach(all, [&](size_t i) { area += elements.weights[i]; });
    return area;
  };
  std::vector<Candidate> views;
  for (size_t k = 0; k < room_.views.size(); k += 7) {
    views.push_back({room_.views[k], std::nullopt, 0});
  }
  EXPECT_GE(brought(places), 0.97 * brought(views));
  const std::vector<Candidate> few = SpreadViews(problem_, spacing, 12);
  EXPECT_LE(few.size(), 12u);
  EXPECT_LT(brought(std::span(few).first(1)), 0.9 * brought(places));
}

TEST_F(TourTableTest, LinksAreSymmetricAndTheSameOnTwoThreads) {
  const auto overlap = OverlapTable::Create(problem_, serial_);
  ASSERT_TRUE(overlap.ok());
  const GainElements elements = GainElements::Of(problem_, 4000, 0, serial_);
  const auto places = SpreadViews(problem_, 0.8, 60);
  TourTable table(problem_, *overlap, elements);
  ASSERT_TRUE(table.Add(places, unlimited_, serial_).ok());
  TourTable in_two(problem_, *overlap, elements);
  parallel::ThreadPool pool(2);
  const std::span<const Candidate> all(places);
  ASSERT_TRUE(in_two.Add(all.first(places.size() / 2), unlimited_, pool).ok());
  ASSERT_TRUE(in_two.Add(all, unlimited_, pool).ok());
  EXPECT_EQ(table.candidates(), in_two.candidates());
  EXPECT_EQ(table.cover().covers, in_two.cover().covers);
  EXPECT_EQ(table.cover().links, in_two.cover().links);
  EXPECT_EQ(table.cover().anchored, in_two.cover().anchored);
  size_t links = 0;
  for (uint32_t i = 0; i < places.size(); ++i) {
    EXPECT_TRUE(std::is_sorted(table.cover().links[i].begin(), table.cover().links[i].end()));
    for (const uint32_t j : table.cover().links[i]) {
      EXPECT_NE(i, j);
      EXPECT_TRUE(
          std::binary_search(table.cover().links[j].begin(), table.cover().links[j].end(), i));
      ++links;
    }
  }
  EXPECT_GT(links, 0u);
}

TEST_F(TourTableTest, JudgesOnWhatIsKnownAsAPlanDoes) {
  const auto overlap = OverlapTable::Create(problem_, serial_);
  ASSERT_TRUE(overlap.ok());
  std::vector<uint8_t> known(overlap->elements());
  for (size_t i = 0; i < known.size(); ++i) known[i] = overlap->Known(i);
  std::vector<uint8_t> nothing(overlap->elements(), 0);
  size_t registered = 0;
  for (const Candidate& candidate : SpreadViews(problem_, 1.2, 30)) {
    uint64_t rays = 0;
    using Judging = OverlapTable::Judging;
    const auto verdict = overlap->Judge(candidate, known, Judging::kWhole, unlimited_, rays);
    ASSERT_TRUE(verdict.has_value());
    const auto before_rivals =
        overlap->Judge(candidate, known, Judging::kBeforeRivals, unlimited_, rays);
    EXPECT_EQ(before_rivals->judged_bound, verdict->judged_bound);
    EXPECT_TRUE(before_rivals->registered() || !verdict->registered());
    const auto plan = planning::EvaluateView(problem_, candidate.position).value();
    EXPECT_EQ(verdict->outcome, plan.view.verdict.outcome);
    EXPECT_NEAR(verdict->overlap_share, plan.view.verdict.overlap_share, 1e-6);
    registered += verdict->registered();
    EXPECT_FALSE(
        overlap->Judge(candidate, nothing, Judging::kWhole, unlimited_, rays)->registered());
  }
  EXPECT_GT(registered, 0u);
}

TEST(ExpectedSurfaceTest, OfARoomThatIsExpectedNothingIsKnown) {
  FlatTour flat(3);
  ASSERT_NE(flat.problem().expectation(), nullptr);
  const auto overlap = OverlapTable::Create(flat.problem(), flat.pool());
  ASSERT_TRUE(overlap.ok());
  size_t known = 0;
  for (size_t i = 0; i < overlap->elements(); ++i) known += overlap->Known(i);
  EXPECT_GT(known, 1000u);
  EXPECT_LT(known, overlap->elements());
}

}  // namespace
}  // namespace vantage::tour

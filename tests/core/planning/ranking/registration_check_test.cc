// Compares step F with the verdict of every view.
#include "core/planning/ranking/registration_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include "core/parallel/thread_pool.h"
#include "core/planning/ranking/rank_views.h"
#include "core/registration/bound/prediction.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/planning_problem.h"

namespace vantage::planning {
namespace {

// A room whose accuracy is asked for so that a good part of its views is refused, most of them by
// little.
struct Room : test_support::PlanningProblem {
  explicit Room(uint64_t seed)
      : test_support::PlanningProblem(std::make_shared<model::PlanningView>(test_support::BuildView(
                                          test_support::FurnishedRoom(seed))),
                                      Config()),
        overlap(problem->overlap()) {
    for (const ViewScore& score : BruteForce(serial)) {
      evaluation.views.push_back({score.score, score.score, score.score, true, true, 0});
    }
    // Of every sixteenth view, which tell the third as well.
    std::vector<double> bounds;
    for (size_t i = 0; i < views.size(); i += 16)
      bounds.push_back(VerdictAt(views[i]).judged_bound);
    std::vector<double> sorted = bounds;
    const auto middle = sorted.begin() + static_cast<ptrdiff_t>(sorted.size() / 3);
    std::nth_element(sorted.begin(), middle, sorted.end());
    config.registration.required_accuracy = registration::kBoundMargin * *middle;
    asked = planning::PlanningProblem::Prepare({*model, scanner, config, problem.get()}, serial)
                .value();
    verdicts.resize(views.size());
    candidates = RankViews(evaluation, feasible, config.candidate_separation, 60);
  }
  static PlanningConfig Config() {
    PlanningConfig config;
    config.viewcell_size = 0.25;
    config.registration.minimum_overlap = 0.01;
    return config;
  }
  registration::RegistrationVerdict VerdictAt(const Eigen::Vector3d& view) const {
    return overlap
        .Predict(view, scoring->scene(), config.registration, parallel::Budget::Unlimited())
        ->verdict;
  }
  RegistrationCheck Check(parallel::Parallel& parallel,
                          const parallel::Budget& budget = parallel::Budget::Unlimited()) const {
    return CheckRegistration(*asked, overlap, evaluation, candidates, 10, budget, parallel);
  }
  // Whether a view registers with that accuracy. Judged when it is asked for: a test asks for few.
  bool Registers(uint32_t view) {
    std::optional<registration::RegistrationVerdict>& verdict = verdicts[view];
    if (!verdict.has_value()) verdict = VerdictAt(views[view]);
    return verdict->registered();
  }
  double Score(uint32_t view) const { return evaluation.views[view].score; }
  bool Near(uint32_t a, uint32_t b) const {
    return (views[a] - views[b]).norm() < config.candidate_separation;
  }

  const OverlapSurface& overlap;
  std::shared_ptr<const planning::PlanningProblem> asked;  // with that accuracy
  Evaluation evaluation;
  std::vector<std::optional<registration::RegistrationVerdict>> verdicts;  // of those asked for
  std::vector<uint32_t> candidates;
};

TEST(RegistrationCheckTest, ADoubtfulViewDoesNotStandForThoseAroundIt) {
  constexpr size_t kTried = 16;
  int doubtful = 0;
  int better = 0;
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Room room(seed);
    const RegistrationCheck check = room.Check(room.serial);
    ASSERT_TRUE(check.finished);
    ASSERT_FALSE(check.registrable.empty());
    for (size_t i = 0; i < check.registrable.size(); ++i) {
      const uint32_t view = check.registrable[i].view;
      EXPECT_TRUE(room.Registers(view));
      for (size_t j = 0; j < i; ++j) {
        EXPECT_GE(room.Score(check.registrable[j].view), room.Score(view));
        EXPECT_FALSE(room.Near(check.registrable[j].view, view));
      }
    }
    for (const uint32_t view : check.refused_around) {
      EXPECT_FALSE(room.Registers(view));
    }
    const double first = room.Score(check.registrable.front().view);
    // Never worse than the best candidate that registers.
    const auto plain = std::find_if(room.candidates.begin(), room.candidates.end(),
                                    [&](uint32_t i) { return room.Registers(i); });
    if (plain != room.candidates.end()) {
      EXPECT_GE(first, room.Score(*plain));
      better += first > room.Score(*plain) ? 1 : 0;
    }
    for (const CheckedView& refused : check.refused) {
      EXPECT_FALSE(room.Registers(refused.view));
      if (refused.verdict.outcome != registration::RegistrationOutcome::kDoubtful) {
        EXPECT_FALSE(refused.alone);
        continue;
      }
      ++doubtful;
      std::vector<uint32_t> around;
      for (uint32_t i = 0; i < room.views.size(); ++i) {
        if (i != refused.view && room.Score(i) > 0 && room.Near(i, refused.view)) {
          around.push_back(i);
        }
      }
      std::sort(around.begin(), around.end(),
                [&](uint32_t a, uint32_t b) { return room.Score(a) > room.Score(b); });
      around.resize(std::min(kTried, around.size()));
      for (const uint32_t i : around) {
        EXPECT_TRUE(!room.Registers(i) || room.Score(i) <= first);
      }
    }
  }
  EXPECT_GT(doubtful, 5);
  EXPECT_GT(better, 0);  // or nothing was tested
}

// Where the best views do not register, others do that lie apart from them.
TEST(RegistrationCheckTest, LooksFartherAwayUntilOneRegisters) {
  int rooms = 0;
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Room room(seed);
    std::vector<uint32_t> failing;  // of those around which none registers
    for (size_t k = 0; k < room.candidates.size() && failing.size() < 2; ++k) {
      bool any = false;
      for (uint32_t i = 0; i < room.views.size() && !any; ++i) {
        any = room.Near(i, room.candidates[k]) && room.Registers(i);
      }
      if (!any) failing.push_back(room.candidates[k]);
    }
    if (failing.empty()) continue;
    ++rooms;
    const auto budget = parallel::Budget::Unlimited();
    const RegistrationCheck near = CheckRegistration(*room.asked, room.overlap, room.evaluation,
                                                     failing, 10, budget, room.serial);
    ASSERT_TRUE(near.registrable.empty());
    KnownVerdicts known;
    const RegistrationCheck check = CheckUntilOneRegisters(*room.asked, room.evaluation, failing,
                                                           10, budget, budget, room.serial, known);
    EXPECT_TRUE(check.finished);
    ASSERT_FALSE(check.registrable.empty());
    EXPECT_GT(check.checked, failing.size());
    for (const CheckedView& view : check.registrable) {
      EXPECT_TRUE(room.Registers(view.view));
      for (const uint32_t other : failing) {
        EXPECT_GE((room.views[view.view] - room.views[other]).norm(),
                  room.config.candidate_separation);  // that of a doubtful one, tried around
      }
    }
  }
  EXPECT_GT(rooms, 1);
}

// What was found out before is not found out again, and changes nothing but the time.
TEST(RegistrationCheckTest, SameWhereVerdictsAreKnown) {
  Room room(3);
  parallel::Budget some;
  some.work_limit = 30 * room.overlap.MostRays();
  for (const parallel::Budget& budget : {parallel::Budget::Unlimited(), some}) {
    const auto check = [&](KnownVerdicts& known) {
      return CheckUntilOneRegisters(*room.asked, room.evaluation, room.candidates, 10, budget,
                                    budget, room.serial, known);
    };
    KnownVerdicts known;
    const RegistrationCheck anew = check(known);
    ASSERT_GT(anew.checked, 3u);
    // The same verdicts, but for one: it can be seen that they are not asked for again.
    KnownVerdicts others;
    size_t noted = 0;
    for (const uint32_t view : room.candidates) {
      const KnownVerdicts::Known* found = known.Find(view);
      if (found == nullptr) continue;
      KnownVerdicts::Known other = *found;
      if (noted++ == 0) other.view.verdict.overlap_share = 0.123;
      others.Note(other);
    }
    const RegistrationCheck again = check(others);
    EXPECT_EQ(again.rays, anew.rays);
    EXPECT_EQ(again.checked, anew.checked);
    EXPECT_EQ(again.finished, anew.finished);
    ASSERT_EQ(again.registrable.size(), anew.registrable.size());
    size_t changed = 0;
    const auto compare = [&](const CheckedView& a, const CheckedView& b) {
      EXPECT_EQ(a.view, b.view);
      changed += a.verdict.overlap_share != b.verdict.overlap_share;
    };
    for (size_t k = 0; k < anew.registrable.size(); ++k) {
      compare(again.registrable[k], anew.registrable[k]);
    }
    ASSERT_EQ(again.refused.size(), anew.refused.size());
    for (size_t k = 0; k < anew.refused.size(); ++k) compare(again.refused[k], anew.refused[k]);
    EXPECT_EQ(changed, 1u);
  }
}

// A view that was found to register on the way is an answer, when the time ends before the best
// have been checked.
TEST(RegistrationCheckTest, WhatIsKnownToRegisterIsAnAnswerWhenTimeEnds) {
  Room room(3);
  std::vector<uint32_t> failing;
  std::vector<uint32_t> registering;  // the best first
  for (const uint32_t view : room.candidates) {
    (room.Registers(view) ? registering : failing).push_back(view);
  }
  ASSERT_FALSE(failing.empty());
  ASSERT_GT(registering.size(), 1u);
  const auto unlimited = parallel::Budget::Unlimited();
  KnownVerdicts known;
  (void)CheckRegistration(*room.asked, room.overlap, room.evaluation, registering, 2, unlimited,
                          room.serial, &known);
  const parallel::Budget ended = parallel::Budget::Seconds(-1);
  const RegistrationCheck check = CheckUntilOneRegisters(*room.asked, room.evaluation, failing, 10,
                                                         ended, ended, room.serial, known);
  EXPECT_FALSE(check.finished);
  ASSERT_EQ(check.registrable.size(), 1u);
  EXPECT_EQ(check.registrable.front().view, registering.front());
  ASSERT_FALSE(check.refused.empty());  // the first is checked whatever is left
  // By a work limit the answer must not depend on what was looked at on the way.
  parallel::Budget little;
  little.work_limit = 1;
  const RegistrationCheck limited = CheckUntilOneRegisters(*room.asked, room.evaluation, failing,
                                                           10, little, little, room.serial, known);
  EXPECT_FALSE(limited.finished);
  EXPECT_TRUE(limited.registrable.empty());
}

TEST(RegistrationCheckTest, SameOnAnyNumberOfThreads) {
  Room room(3);
  parallel::Budget some;
  some.work_limit = 30 * room.overlap.MostRays();
  for (const parallel::Budget& budget : {parallel::Budget::Unlimited(), some}) {
    const RegistrationCheck one = room.Check(room.serial, budget);
    for (const int threads : {2, 16}) {
      parallel::ThreadPool pool(threads);
      const RegistrationCheck other = room.Check(pool, budget);
      EXPECT_EQ(one.rays, other.rays);
      EXPECT_EQ(one.checked, other.checked);
      EXPECT_EQ(one.refused_around, other.refused_around);
      ASSERT_EQ(one.registrable.size(), other.registrable.size());
      for (size_t i = 0; i < one.registrable.size(); ++i) {
        EXPECT_EQ(one.registrable[i].view, other.registrable[i].view);
      }
    }
  }
}

TEST(RegistrationCheckTest, WithoutTimeForMoreTheCandidatesAreChecked) {
  Room room(3);
  const RegistrationCheck all = room.Check(room.serial);
  for (const uint64_t views : {1, 4, 9}) {
    parallel::Budget budget;
    budget.work_limit = views * room.overlap.MostRays();
    const RegistrationCheck check = room.Check(room.serial, budget);
    EXPECT_LT(check.checked, all.checked);
    EXPECT_GE(check.checked, views);
    for (const CheckedView& view : check.refused) {
      EXPECT_NE(std::find(room.candidates.begin(), room.candidates.end(), view.view),
                room.candidates.end());
    }
  }
}

}  // namespace
}  // namespace vantage::planning

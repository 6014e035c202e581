#include "core/fleet/look_ahead.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "core/fleet/pending_surface.h"
#include "core/fleet/remaining_gain.h"
#include "core/planning/ranking/view_report.h"

namespace vantage::fleet {
namespace {

using planning::RankedView;

// How many of the plan's views are tried as the first of two, and refused ones as the second. Each
// first costs the scores of six views and a few predictions. A choice.
constexpr size_t kMostFirst = 6;
constexpr size_t kMostRefused = 2;
// Views that may follow the first instead of a refused one: the best, and the next in case the best
// is the first.
constexpr size_t kFollowers = 3;
// A refused view is looked at where it scores so much more than the best that registers: less is
// within what a second scan of the same place would bring anyway. Share, a choice.
constexpr double kMuchMore = 1.2;
// Of the two scans' score: less is no reason to leave the order. Share, a choice.
constexpr double kBetter = 1.05;
// That a refused view registers after the first, where that is predicted: what the first is
// expected to see is a guess. Of 5 such views in furnished flats 3 did; no other sites were tried.
constexpr double kRegistersAfter = 0.6;
constexpr double kTimeLeft = 0.1;  // share of the budget

// What comes after a view.
struct Follower {
  double score = 0;               // samples, times its chances
  std::optional<size_t> enabled;  // index of the refused view that it is
};

std::vector<size_t> RefusedThatGainMore(const planning::Plan& plan) {
  std::vector<size_t> refused;
  for (size_t i = 0; i < plan.refused.size() && refused.size() < kMostRefused; ++i) {
    const RankedView& view = plan.refused[i];
    if (view.exact && view.score > kMuchMore * plan.views[0].score) refused.push_back(i);
  }
  return refused;
}

double Chance(const RankedView& view) {
  return view.expected.has_value() ? view.expected->chance : 1;
}

class Followers {
 public:
  Followers(const planning::PlanningProblem& problem, const planning::Plan& plan,
            std::vector<size_t> refused, const parallel::Budget& budget)
      : problem_(problem), plan_(plan), refused_(std::move(refused)), budget_(budget) {}

  // The best follower of the plan's view `first`; nothing when the budget expired. Adds to `rays`.
  std::optional<Follower> Of(size_t first, uint64_t& rays) const {
    const RankedView& view = plan_.views[first];
    const planning::BruteForceScorer& scorer = problem_.scoring().scorer();
    RemainingGain remaining(problem_.scoring().cells());
    if (!remaining.Take(view.position, scorer, budget_, rays, view.heading)) return std::nullopt;
    Follower best;
    for (size_t j = 0; j < std::min(kFollowers, plan_.views.size()); ++j) {
      if (j == first) continue;
      const auto score = ScoreAfter(plan_.views[j], remaining, rays);
      if (!score.has_value()) return std::nullopt;
      best.score = std::max(best.score, *score);
    }
    PendingSurface surface(problem_, problem_.overlap(), ExpectedRooms::kCount);
    for (const size_t i : refused_) {
      const RankedView& other = plan_.refused[i];
      const auto gained = ScoreAfter(other, remaining, rays);
      if (!gained.has_value()) return std::nullopt;
      const double score = kRegistersAfter * *gained;
      if (score <= best.score) continue;
      const auto judged = surface.Judge(other.position, remaining, problem_.config().registration,
                                        budget_, rays, {}, other.heading);
      if (!judged.has_value()) return std::nullopt;
      if (judged->verdict.registered()) best = {score, i};
    }
    return best;
  }

 private:
  // What a view gains after the first, by its chance.
  std::optional<double> ScoreAfter(const RankedView& view, const RemainingGain& remaining,
                                   uint64_t& rays) const {
    const planning::CellArrays& left = remaining.left();
    std::vector<float> by_cell(left.size());
    const planning::ViewScore score =
        problem_.scoring().scorer().ScoreCells(view.position, left, budget_, by_cell);
    rays += score.rays;
    if (!score.finished) return std::nullopt;
    const planning::Sector sector(problem_.scanner(), view.heading);
    const double gained = sector.everything()
                              ? score.score
                              : planning::KeepSector(sector, view.position, left, by_cell);
    return Chance(view) * gained;
  }

  const planning::PlanningProblem& problem_;
  const planning::Plan& plan_;
  const std::vector<size_t> refused_;
  const parallel::Budget& budget_;
};

}  // namespace

void LookAhead(const planning::PlanningProblem& problem, const parallel::Budget& budget,
               parallel::Parallel& parallel, planning::Plan& plan) {
  if (plan.views.empty() || !plan.views[0].exact || plan.rays >= budget.work_limit) return;
  std::vector<size_t> refused = RefusedThatGainMore(plan);
  if (refused.empty()) return;
  const size_t count = std::min(kMostFirst, plan.views.size());
  const Followers followers(problem, plan, std::move(refused), budget);
  std::vector<std::optional<Follower>> after(count);
  std::vector<uint64_t> rays(count, 0);
  parallel.For(count, [&](size_t k) {
    if (plan.views[k].exact) after[k] = followers.Of(k, rays[k]);
  });
  for (const uint64_t each : rays) plan.rays += each;
  if (!after[0].has_value()) return;
  const auto together = [&](size_t k) {
    return Chance(plan.views[k]) * plan.views[k].score + after[k]->score;
  };
  size_t best = 0;
  double most = kBetter * together(0);
  for (size_t k = 1; k < count; ++k) {
    if (!after[k].has_value()) return;
    if (!after[k]->enabled.has_value() || together(k) <= most) continue;
    best = k;
    most = together(k);
  }
  plan.views[best].enables = after[best]->enabled;
  const auto begin = plan.views.begin();
  std::rotate(begin, begin + static_cast<ptrdiff_t>(best),
              begin + static_cast<ptrdiff_t>(best) + 1);
  planning::ViewReport::NameFallback(plan.views);
  for (RankedView& view : plan.refused) {
    if (!view.targets.has_value() || !view.targets->first_view.has_value()) continue;
    size_t& first = *view.targets->first_view;
    if (first <= best) first = first == best ? 0 : first + 1;
  }
}

planning::Plan MakePlanLookingAhead(const planning::PlanningProblem& problem,
                                    const parallel::Budget& budget, parallel::Parallel& parallel,
                                    planning::PlanProgress progress) {
  parallel::Budget shorter = budget;
  shorter.deadline = budget.Part(1 - kTimeLeft, 0).deadline;
  planning::Plan plan = planning::MakePlan(problem, shorter, parallel, progress);
  LookAhead(problem, budget.Concluding(), parallel, plan);
  return plan;
}

}  // namespace vantage::fleet

#include "core/planning/ranking/registration_check.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "absl/container/flat_hash_set.h"
#include "absl/functional/function_ref.h"
#include "core/planning/ranking/rank_views.h"

namespace vantage::planning {
namespace {

constexpr size_t kBatch = 4;  // candidates checked at a time, whatever the number of threads
static_assert(kBestFirst % kBatch == 0);

class Checking {
 public:
  Checking(const PlanningProblem& problem, const OverlapSurface& surface,
           const Evaluation& evaluation, const parallel::Budget& budget,
           const parallel::Budget& until_one, parallel::Parallel& parallel, bool first_anyway,
           KnownVerdicts* known)
      : surface_(surface),
        scoring_(problem.scoring()),
        scene_(problem.scene()),
        evaluation_(evaluation),
        feasible_(problem.feasible()),
        config_(problem.config()),
        stations_(problem.model().stations()),
        budget_(budget),
        until_one_(until_one),
        parallel_(parallel),
        first_anyway_(first_anyway),
        known_(known) {}

  RegistrationCheck Run(std::span<const uint32_t> candidates, size_t wanted) {
    const size_t best = std::min(candidates.size(), kBestFirst);
    CheckBestFirst(candidates.first(best), wanted);
    std::vector<uint32_t> left(candidates.begin() + static_cast<ptrdiff_t>(best), candidates.end());
    if (!left.empty() && check_.registrable.empty() && !check_.refused.empty() && !ended_) {
      LookNearer(wanted);
      std::erase_if(left, [this](uint32_t view) { return NearOneRefused(view); });
    }
    if (!ended_) CheckBestFirst(left, wanted);
    if (!headings().all_around()) check_.facing = check_.registrable;
    KeepBestApart(wanted);
    if (ended_) return check_;
    check_.finished = true;
    TryAroundDoubtful(wanted);
    return check_;
  }

  // The candidates alone.
  RegistrationCheck RunThese(std::span<const uint32_t> candidates, size_t wanted) {
    CheckBestFirst(candidates, wanted);
    if (!headings().all_around()) check_.facing = check_.registrable;
    KeepBestApart(wanted);
    check_.finished = !ended_;
    return check_;
  }

 private:
  // Checks the first few of `views` and returns how many; 0 when the budget ended.
  size_t Check(std::span<const uint32_t> views, absl::FunctionRef<void(const CheckedView&)> note) {
    const bool late = NoTimeLeft();
    ended_ = late && !CheckedAnyway();
    if (ended_) return 0;
    const uint64_t affordable = late ? 1 : (Left().work_limit - check_.rays) / MostRays();
    const size_t count =
        std::min(static_cast<size_t>(std::clamp<uint64_t>(affordable, 1, kBatch)), views.size());
    std::vector<std::optional<Judged>> judged(count);
    const parallel::Budget first = CheckedAnyway() ? Untimed() : Left();
    parallel_.For(count, [&](size_t k) {
      const Judged* before = known_ == nullptr ? nullptr : known_->Find(views[k]);
      judged[k] = before != nullptr ? *before : Judge(views[k], k == 0 ? first : Left());
    });
    for (size_t k = 0; k < count; ++k) {
      ended_ = !judged[k].has_value();
      if (ended_) return 0;
      check_.rays += judged[k]->rays;
      ++check_.checked;
      if (known_ != nullptr) known_->Note(*judged[k]);
      note(judged[k]->view);
    }
    return count;
  }

  // Checks `candidates`, best first, until `wanted` register that gain as much as the next may.
  void CheckBestFirst(std::span<const uint32_t> candidates, size_t wanted) {
    size_t count = 0;
    for (size_t begin = 0; begin < candidates.size(); begin += count) {
      if (AsGoodAs(candidates[begin]) >= wanted) break;
      count = Check(candidates.subspan(begin), [&](const CheckedView& view) {
        (view.verdict.registered() ? check_.registrable : check_.refused).push_back(view);
      });
      if (count == 0) break;
    }
  }

  // Where the best were all refused: the nearer to a station, the more is overlapped, and what
  // gains most often lies too far from all. The best of those half as far from the nearest station
  // as most that were refused; again, until one registers; then the best of those up to twice as
  // far as that.
  void LookNearer(size_t wanted) {
    if (stations_.empty()) return;
    const std::vector<double> away = DistancesToStations();
    double radius = MedianOfRefused(away);
    while (check_.registrable.empty() && radius > feasible_.cell_size()) {
      radius /= 2;
      CheckBestFirst(BestWithin(away, radius), wanted);
      if (ended_) return;
    }
    CheckBestFirst(BestWithin(away, 2 * radius), wanted);
  }
  // Of each view to the nearest station, m.
  std::vector<double> DistancesToStations() const {
    std::vector<double> away(feasible_.cells().size(), std::numeric_limits<double>::max());
    for (uint32_t i = 0; i < away.size(); ++i) {
      for (const model::Station& station : stations_) {
        away[i] = std::min(away[i], (feasible_.Centre(i) - station.position).norm());
      }
    }
    return away;
  }
  double MedianOfRefused(const std::vector<double>& away) const {
    std::vector<double> refused;
    for (const CheckedView& view : check_.refused) refused.push_back(away[view.view]);
    const auto middle = refused.begin() + static_cast<ptrdiff_t>(refused.size() / 2);
    std::nth_element(refused.begin(), middle, refused.end());
    return *middle;
  }
  std::vector<uint32_t> BestWithin(const std::vector<double>& away, double radius) const {
    std::vector<uint32_t> checked;
    for (const CheckedView& view : check_.refused) checked.push_back(view.view);
    for (const CheckedView& view : check_.registrable) checked.push_back(view.view);
    return RankViews(evaluation_, feasible_, config_.candidate_separation, kBestFirst, checked,
                     [&](uint32_t i) { return away[i] <= radius; });
  }
  bool NearOneRefused(uint32_t view) const {
    return std::any_of(check_.refused.begin(), check_.refused.end(),
                       [&](const CheckedView& other) { return Near(other.view, view); });
  }

  // Not all were checked best first, and views may be worth less with the headings that register
  // than their ranks say.
  void KeepBestApart(size_t wanted) {
    std::vector<CheckedView> all = std::move(check_.registrable);
    std::stable_sort(all.begin(), all.end(), [this](const CheckedView& a, const CheckedView& b) {
      return Score(a) > Score(b);
    });
    check_.registrable.clear();
    for (const CheckedView& view : all) {
      const bool near = std::any_of(check_.registrable.begin(), check_.registrable.end(),
                                    [&](const CheckedView& o) { return Near(o.view, view.view); });
      if (!near && check_.registrable.size() < wanted) check_.registrable.push_back(view);
    }
  }

  using Judged = KnownVerdicts::Known;
  // Nothing when the budget ended.
  std::optional<Judged> Judge(uint32_t view, const parallel::Budget& budget) const {
    const Eigen::Vector3d at = feasible_.Centre(view);
    if (stations_.empty() && headings().all_around())
      return Judged{{view, FirstScan(), std::nullopt, 0}, 0};
    if (headings().all_around()) {
      const auto seen = surface_.Predict(at, scene_, config_.registration, budget);
      if (!seen.has_value()) return std::nullopt;
      return Judged{{view, seen->verdict, std::nullopt, 0}, seen->rays};
    }
    std::vector<double> by_heading(headings().size());
    const ViewScore score =
        scoring_.scorer().ScoreHeadings(at, scoring_.cells(), budget, by_heading);
    if (!score.finished) return std::nullopt;
    if (stations_.empty()) {
      const auto best = std::max_element(by_heading.begin(), by_heading.end());
      return Judged{{view, FirstScan(), static_cast<size_t>(best - by_heading.begin()), *best},
                    score.rays};
    }
    const auto seen = surface_.PredictBest(at, by_heading, scene_, config_.registration, budget);
    if (!seen.has_value()) return std::nullopt;
    return Judged{{view, seen->verdict, seen->heading, by_heading[seen->heading]},
                  score.rays + seen->rays};
  }

  // There is nothing yet that it would have to be aligned to: it makes the model's frame.
  static registration::RegistrationVerdict FirstScan() {
    registration::RegistrationVerdict verdict;
    verdict.outcome = registration::RegistrationOutcome::kRegistered;
    return verdict;
  }

  const Headings& headings() const { return scoring_.scorer().headings(); }
  uint64_t MostRays() const {
    return surface_.MostRays() +
           (headings().all_around() ? 0 : scoring_.scorer().MostRays(scoring_.cells()));
  }
  // How many of the views that register gain as much as a candidate may.
  size_t AsGoodAs(uint32_t candidate) const {
    return static_cast<size_t>(
        std::count_if(check_.registrable.begin(), check_.registrable.end(),
                      [&](const CheckedView& view) { return Score(view) >= Score(candidate); }));
  }

  // The budget, for work that ends only when it is cancelled.
  parallel::Budget Untimed() const {
    parallel::Budget untimed = budget_;
    untimed.deadline = parallel::Budget::Clock::time_point::max();
    return untimed;
  }
  // Where no view is known that registers, more is left.
  const parallel::Budget& Left() const { return check_.registrable.empty() ? until_one_ : budget_; }
  bool NoTimeLeft() const { return check_.rays >= Left().work_limit || Left().Expired(); }
  bool CheckedAnyway() const {
    return first_anyway_ && check_.checked == 0 && !budget_.cancelled.stop_requested();
  }
  double Score(uint32_t view) const { return evaluation_.views[view].Rank(); }
  double Score(const CheckedView& view) const {
    return view.heading.has_value() ? view.score : Score(view.view);
  }
  bool Near(uint32_t a, uint32_t b) const {
    return (feasible_.Centre(a) - feasible_.Centre(b)).norm() < config_.candidate_separation;
  }

  // The views around a candidate that were not tried yet, the best first.
  std::vector<uint32_t> BestAround(uint32_t candidate) const {
    std::vector<uint32_t> around;
    for (uint32_t i = 0; i < evaluation_.views.size(); ++i) {
      if (i == candidate || !evaluation_.views[i].scored || !Near(i, candidate)) continue;
      if (Score(i) > 0 && Score(i) <= Score(candidate) && !tried_.contains(i)) around.push_back(i);
    }
    const size_t count = std::min(kTriedAround, around.size());
    std::partial_sort(around.begin(), around.begin() + static_cast<ptrdiff_t>(count), around.end(),
                      [this](uint32_t a, uint32_t b) {
                        return Score(a) != Score(b) ? Score(a) > Score(b) : a < b;
                      });
    around.resize(count);
    return around;
  }

  void TryAroundDoubtful(size_t wanted) {
    const size_t most = check_.checked + static_cast<size_t>(config_.max_checked);
    std::vector<CheckedView> found;
    for (CheckedView& refused : check_.refused) {
      if (refused.verdict.outcome != registration::RegistrationOutcome::kDoubtful) continue;
      if (check_.checked >= most || NoTimeLeft()) break;
      const std::vector<uint32_t> around = BestAround(refused.view);
      std::span<const uint32_t> left = around;
      std::vector<uint32_t> tried;
      while (!left.empty() && !refused.alone && check_.checked < most) {
        const size_t count = Check(left, [&](const CheckedView& view) {
          tried_.insert(view.view);
          if (!view.verdict.registered()) {
            tried.push_back(view.view);
          } else if (!refused.alone) {
            refused.alone = true;
            found.push_back(view);
          }
        });
        if (count == 0) break;
        left = left.subspan(count);
      }
      if (refused.alone) {
        check_.refused_around.insert(check_.refused_around.end(), tried.begin(), tried.end());
      }
    }
    if (found.empty()) return;
    check_.registrable.insert(check_.registrable.end(), found.begin(), found.end());
    KeepBestApart(wanted);
  }

  const OverlapSurface& surface_;
  const Scoring& scoring_;
  const visibility::OcclusionScene& scene_;
  const Evaluation& evaluation_;
  const FeasibleViews& feasible_;
  const PlanningConfig& config_;
  const std::vector<model::Station>& stations_;
  const parallel::Budget& budget_;
  const parallel::Budget& until_one_;
  parallel::Parallel& parallel_;
  const bool first_anyway_;  // the first candidate is checked even where no time is left
  KnownVerdicts* const known_;
  RegistrationCheck check_;
  bool ended_ = false;                   // the budget did
  absl::flat_hash_set<uint32_t> tried_;  // around doubtful candidates
};

}  // namespace

const KnownVerdicts::Known* KnownVerdicts::BestRegistrable(const Evaluation& evaluation) const {
  const Known* best = nullptr;
  const auto rank = [&](const Known& known) { return evaluation.views[known.view.view].Rank(); };
  for (const auto& [view, known] : by_view_) {
    if (!known.view.verdict.registered()) continue;
    const bool better = best == nullptr || rank(known) > rank(*best) ||
                        (rank(known) == rank(*best) && view < best->view.view);
    if (better) best = &known;
  }
  return best;
}

RegistrationCheck CheckRegistration(const PlanningProblem& problem, const OverlapSurface& surface,
                                    const Evaluation& evaluation,
                                    std::span<const uint32_t> candidates, size_t wanted,
                                    const parallel::Budget& budget, parallel::Parallel& parallel,
                                    KnownVerdicts* known) {
  return Checking(problem, surface, evaluation, budget, budget, parallel, false, known)
      .Run(candidates, wanted);
}

RegistrationCheck CheckThese(const PlanningProblem& problem, const OverlapSurface& surface,
                             const Evaluation& evaluation, std::span<const uint32_t> candidates,
                             size_t wanted, const parallel::Budget& budget,
                             parallel::Parallel& parallel) {
  return Checking(problem, surface, evaluation, budget, budget, parallel, false, nullptr)
      .RunThese(candidates, wanted);
}

RegistrationCheck CheckUntilOneRegisters(const PlanningProblem& problem,
                                         const Evaluation& evaluation,
                                         std::span<const uint32_t> candidates, size_t wanted,
                                         const parallel::Budget& budget,
                                         const parallel::Budget& until_one,
                                         parallel::Parallel& parallel, KnownVerdicts& known) {
  const OverlapSurface& surface = problem.overlap();
  RegistrationCheck check =
      Checking(problem, surface, evaluation, budget, until_one, parallel, true, &known)
          .Run(candidates, wanted);
  const PlanningConfig& config = problem.config();
  double separation = config.candidate_separation;
  while (check.finished && check.registrable.empty() && separation > 0) {
    separation *= 2;
    std::vector<uint32_t> refused;
    for (const CheckedView& view : check.refused) refused.push_back(view.view);
    const std::vector<uint32_t> farther =
        RankViews(evaluation, problem.feasible(), separation,
                  static_cast<size_t>(config.max_checked), refused);
    if (farther.empty()) break;
    const auto left = [&](parallel::Budget after) {
      after.work_limit -= std::min(after.work_limit, check.rays);
      return after;
    };
    const parallel::Budget more = left(budget);
    const parallel::Budget more_until_one = left(until_one);
    RegistrationCheck next =
        Checking(problem, surface, evaluation, more, more_until_one, parallel, false, &known)
            .Run(farther, wanted);
    check.registrable = std::move(next.registrable);
    check.facing = std::move(next.facing);
    check.refused.insert(check.refused.end(), next.refused.begin(), next.refused.end());
    check.refused_around.insert(check.refused_around.end(), next.refused_around.begin(),
                                next.refused_around.end());
    check.checked += next.checked;
    check.rays += next.rays;
    check.finished = next.finished;
  }
  // Which views were looked at on the way is a matter of time, so it decides only where time did.
  if (check.registrable.empty() && !check.finished && until_one.Expired()) {
    const KnownVerdicts::Known* best = known.BestRegistrable(evaluation);
    if (best != nullptr) check.registrable.push_back(best->view);
  }
  return check;
}

}  // namespace vantage::planning

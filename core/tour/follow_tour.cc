#include "core/tour/follow_tour.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "core/planning/outcome.h"
#include "core/planning/ranking/open_doors.h"
#include "core/planning/ranking/registration_check.h"
#include "core/planning/ranking/view_report.h"
#include "core/tour/tour.h"

namespace vantage::tour {
namespace {

using planning::RankedView;

// Views around a station that are scored exactly, besides the one nearest to it: a flat's take a
// hundredth of a second each.
constexpr size_t kScoredAround = 6;
// Stations that are looked at, by the one best view of each, when the budget has ended before one
// was found: who follows a tour is better served late than by a view that follows none. Each costs
// a prediction, and the one that registers two exact scores.
constexpr size_t kMostLate = 8;

// The scores that a plan's map has, as the evaluation that it was made of.
planning::Evaluation EvaluationOf(const planning::Plan& plan,
                                  const planning::FeasibleViews& feasible) {
  planning::Evaluation evaluation;
  evaluation.views.resize(feasible.cells().size());
  for (const planning::ScoredCell& cell : plan.score_map) {
    const int i = feasible.IndexOf(feasible.CellOf(cell.centre.cast<double>()));
    if (i < 0) continue;
    planning::ViewEstimate& view = evaluation.views[static_cast<size_t>(i)];
    view.score = cell.score;
    view.lower = cell.lower;
    view.upper = cell.upper;
    view.scored = true;
  }
  return evaluation;
}

// Why stations are not gone to.
struct PassedOver {
  size_t made = 0;      // a scan stands there
  size_t nowhere = 0;   // nobody can stand there
  size_t done = 0;      // bring less than a scan is worth
  size_t refused = 0;   // would not register
  size_t not_seen = 0;  // the budget ended before

  std::string Words(double worth) const {
    std::vector<std::string> parts;
    const auto add = [&](size_t count, const std::string& one, const std::string& several) {
      if (count > 0) parts.push_back(absl::StrCat(count, " ", count == 1 ? one : several));
    };
    const std::string less = absl::StrFormat("less than %.3g m\u00b2 by now", worth);
    add(made, "was made", "were made");
    add(nowhere, "cannot be stood at", "cannot be stood at");
    add(done, absl::StrCat("brings ", less), absl::StrCat("bring ", less));
    add(refused, "does not register", "do not register");
    add(not_seen, "was not looked at for want of time", "were not looked at for want of time");
    return absl::StrJoin(parts, ", ");
  }
};

// A station that was not made yet.
struct Stop {
  size_t station = 0;            // of the tour
  std::vector<uint32_t> around;  // views no farther than kSamePlace
  std::optional<uint32_t> nearest;
  double score = 0;   // of the best of them, by the plan's map, samples
  size_t storey = 0;  // by the order in which the tour comes to them
};

class Follower {
 public:
  Follower(const planning::PlanningProblem& problem, const parallel::Budget& budget,
           parallel::Parallel& parallel, planning::Plan& plan)
      : problem_(problem),
        feasible_(problem.feasible()),
        budget_(budget),
        parallel_(parallel),
        plan_(plan),
        report_(problem, parallel),
        evaluation_(EvaluationOf(plan, feasible_)) {}

  planning::FollowedTour Follow(std::span<const Eigen::Vector3d> stations) {
    const double worth = problem_.config().terminate_below;
    PassedOver passed;
    const std::vector<Stop> stops = StopsOf(stations, passed);
    size_t late = 0;
    for (size_t k = 0; k < stops.size(); ++k) {
      if (Ended() && (late++ == kMostLate || budget_.cancelled.stop_requested())) {
        passed.not_seen += stops.size() - k;
        break;
      }
      std::optional<RankedView> view = ViewAt(stations[stops[k].station], stops[k], passed);
      if (!view.has_value()) continue;
      planning::FollowedTour followed;
      followed.station = stops[k].station;
      const std::string others = passed.Words(worth);
      followed.message =
          absl::StrCat("stop ", stops[k].station + 1, " of the tour",
                       others.empty() ? "" : " (of the others ", others, others.empty() ? "" : ")");
      PutFirst(*std::move(view), followed);
      return followed;
    }
    planning::FollowedTour none;
    none.message = absl::StrCat("the tour is not followed: of its ", stations.size(),
                                stations.size() == 1 ? " stop " : " stops ", passed.Words(worth));
    return none;
  }

 private:
  bool Ended() const { return budget_.Expired() || plan_.rays >= budget_.work_limit; }
  parallel::Budget Untimed() const {
    parallel::Budget untimed = parallel::Budget::Unlimited();
    untimed.cancelled = budget_.cancelled;
    return untimed;
  }

  // What is left of a tour: storey by storey as it has them, and of each storey what brings most
  // first. Counts the others.
  std::vector<Stop> StopsOf(std::span<const Eigen::Vector3d> stations, PassedOver& passed) const {
    std::vector<Stop> stops;
    std::vector<int> storeys;
    for (size_t k = 0; k < stations.size(); ++k) {
      if (Made(stations[k])) {
        ++passed.made;
        continue;
      }
      Stop stop = StopAt(k, stations[k]);
      if (!stop.nearest.has_value()) {
        ++passed.nowhere;
        continue;
      }
      const int storey = feasible_.Storey(feasible_.Centre(*stop.nearest)).value_or(0);
      const auto known = std::find(storeys.begin(), storeys.end(), storey);
      stop.storey = static_cast<size_t>(known - storeys.begin());
      if (known == storeys.end()) storeys.push_back(storey);
      stops.push_back(std::move(stop));
    }
    std::stable_sort(stops.begin(), stops.end(), [](const Stop& a, const Stop& b) {
      return a.storey != b.storey ? a.storey < b.storey : a.score > b.score;
    });
    return stops;
  }

  // A scan stands there. What it left open nearby is for the ranking to judge.
  bool Made(const Eigen::Vector3d& station) const {
    const std::vector<model::Station>& made = problem_.model().stations();
    return std::any_of(made.begin(), made.end(), [&](const model::Station& scan) {
      return (scan.position - station).norm() <= kSamePlace;
    });
  }

  Stop StopAt(size_t station, const Eigen::Vector3d& place) const {
    Stop stop;
    stop.station = station;
    double least = kSamePlace;
    for (uint32_t i = 0; i < evaluation_.views.size(); ++i) {
      const double away = (feasible_.Centre(i) - place).norm();
      if (away > kSamePlace) continue;
      if (away <= least) {
        least = away;
        stop.nearest = i;
      }
      if (!evaluation_.views[i].scored) continue;
      stop.around.push_back(i);
      stop.score = std::max(stop.score, evaluation_.views[i].score);
    }
    return stop;
  }

  // The best view at a station, described; nothing where it is not acceptable, which is counted.
  std::optional<RankedView> ViewAt(const Eigen::Vector3d& place, const Stop& stop,
                                   PassedOver& passed) {
    if (!plan_.views.empty() && (plan_.views[0].position - place).norm() <= kSamePlace &&
        Pays(plan_.views[0])) {
      return plan_.views[0];
    }
    std::vector<uint32_t> views = ToScore(stop);
    if (Ended() || !Score(views)) views.resize(1);
    // What nothing can be gained at needs no prediction. Of what was not scored nobody knows.
    std::erase_if(views, [&](uint32_t i) {
      return evaluation_.views[i].scored && !(evaluation_.views[i].score > 0);
    });
    if (views.empty()) {
      ++passed.done;
      return std::nullopt;
    }
    parallel::Budget enough = budget_;
    if (Ended()) {
      enough = Untimed();
    } else if (enough.work_limit != std::numeric_limits<uint64_t>::max()) {
      enough.work_limit -= plan_.rays;
    }
    const planning::RegistrationCheck check =
        CheckThese(problem_, problem_.overlap(), evaluation_, views, 1, enough, parallel_);
    plan_.rays += check.rays;
    if (check.registrable.empty()) {
      ++(check.finished ? passed.refused : passed.not_seen);
      return std::nullopt;
    }
    std::vector<RankedView> described =
        report_.Describe(check.registrable, evaluation_, 1, Untimed(), parallel_);
    if (!described.front().gain_without_hidden.has_value()) {
      ++passed.not_seen;
      return std::nullopt;
    }
    if (!Pays(described.front())) {
      ++passed.done;
      return std::nullopt;
    }
    return std::move(described.front());
  }

  bool Pays(const RankedView& view) const {
    return view.gain_without_hidden.value_or(0) >= problem_.config().terminate_below;
  }

  // The best views at a station by the plan's map, and the nearest.
  std::vector<uint32_t> ToScore(const Stop& stop) const {
    std::vector<uint32_t> views = stop.around;
    const size_t count = std::min(kScoredAround, views.size());
    std::partial_sort(views.begin(), views.begin() + static_cast<ptrdiff_t>(count), views.end(),
                      [&](uint32_t a, uint32_t b) {
                        const double x = evaluation_.views[a].score;
                        const double y = evaluation_.views[b].score;
                        return x != y ? x > y : a < b;
                      });
    views.resize(count);
    if (std::find(views.begin(), views.end(), *stop.nearest) == views.end()) {
      views.push_back(*stop.nearest);
    }
    return views;
  }

  // Scores views exactly and sorts them, the best first. False when the budget ended: then they
  // stay as they are.
  bool Score(std::vector<uint32_t>& views) {
    const planning::BruteForceScorer& scorer = problem_.scoring().scorer();
    const planning::CellArrays& cells = problem_.scoring().cells();
    std::vector<planning::ViewScore> scores(views.size());
    parallel_.For(views.size(), [&](size_t k) {
      const Eigen::Vector3d at = feasible_.Centre(views[k]);
      if (scorer.headings().all_around()) {
        scores[k] = scorer.Score(at, cells, budget_);
      } else {
        std::vector<double> by_heading(scorer.headings().size());
        scores[k] = scorer.ScoreHeadings(at, cells, budget_, by_heading);
      }
    });
    bool finished = true;
    for (const planning::ViewScore& score : scores) {
      plan_.rays += score.rays;
      finished = finished && score.finished;
    }
    if (!finished) return false;
    for (size_t k = 0; k < views.size(); ++k) {
      planning::ViewEstimate& view = evaluation_.views[views[k]];
      view.score = view.lower = view.upper = scores[k].score;
      view.heading = scores[k].heading;
      view.scored = view.exact = true;
    }
    std::stable_sort(views.begin(), views.end(), [&](uint32_t a, uint32_t b) {
      return evaluation_.views[a].score > evaluation_.views[b].score;
    });
    return true;
  }

  void PutFirst(RankedView view, planning::FollowedTour& followed) {
    std::vector<RankedView>& views = plan_.views;
    const auto gain = [](const RankedView& of) {
      return of.expected_gain.has_value()
                 ? absl::StrFormat(", which is expected to bring %.3g m\u00b2", *of.expected_gain)
                 : std::string();
    };
    if (!views.empty() && views[0].position == view.position) {
      followed.otherwise = 0;
      followed.message += " is the first view without the tour, too";
      // Its gain was not known where the plan's time was short.
      if (!views[0].gain_without_hidden.has_value() && view.gain_without_hidden.has_value()) {
        view.enables = views[0].enables;
        view.doors = std::move(views[0].doors);
        views[0] = std::move(view);
        planning::ViewReport::NameFallback(views);
      }
      return;
    }
    if (views.empty()) {
      followed.message += " stands first; without the tour there would be no view";
      planning::Conclude(planning::ViewsFound(1, plan_.refused.size()), plan_);
      plan_.attainable_accuracy.reset();
    } else {
      absl::StrAppend(&followed.message, " stands first", gain(view),
                      "; without the tour it would be ",
                      problem_.config().candidates > 1 ? "rank 2" : "another", gain(views[0]));
    }
    planning::Plan alone;
    alone.views.push_back(std::move(view));
    plan_.rays += planning::NoteOpenDoors(problem_, budget_, alone);
    // What stands too near to it is no choice of its own, but for the view that would be first.
    std::vector<RankedView> ranked = std::move(alone.views);
    const auto wanted = static_cast<size_t>(problem_.config().candidates);
    std::vector<std::optional<size_t>> place(views.size());  // in `ranked`
    for (size_t k = 0; k < views.size() && ranked.size() < wanted; ++k) {
      if (k > 0 && (views[k].position - ranked[0].position).norm() <
                       problem_.config().candidate_separation) {
        continue;
      }
      place[k] = ranked.size();
      ranked.push_back(std::move(views[k]));
    }
    if (!place.empty()) followed.otherwise = place[0];
    for (RankedView& refused : plan_.refused) {
      if (!refused.targets.has_value() || !refused.targets->first_view.has_value()) continue;
      const std::optional<size_t> now = place[*refused.targets->first_view];
      // Its advice is to scan from a view that the plan does not return any more.
      if (!now.has_value()) {
        refused.targets.reset();
      } else {
        refused.targets->first_view = now;
      }
    }
    views = std::move(ranked);
    planning::ViewReport::NameFallback(views);
  }

  const planning::PlanningProblem& problem_;
  const planning::FeasibleViews& feasible_;
  const parallel::Budget& budget_;
  parallel::Parallel& parallel_;
  planning::Plan& plan_;
  const planning::ViewReport report_;
  planning::Evaluation evaluation_;
};

}  // namespace

void FollowTour(const planning::PlanningProblem& problem, std::span<const Eigen::Vector3d> stations,
                const parallel::Budget& budget, parallel::Parallel& parallel,
                planning::Plan& plan) {
  if (stations.empty()) return;
  if (plan.score_map.empty()) {
    plan.followed_tour.emplace().message =
        "the tour is not followed: no view was evaluated in this plan";
    return;
  }
  if (plan.termination.suggested) {
    plan.followed_tour.emplace().message = "the tour is not followed: another scan is not worth it";
    return;
  }
  plan.followed_tour = Follower(problem, budget, parallel, plan).Follow(stations);
}

}  // namespace vantage::tour

#include "core/fleet/joint_plan.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <tuple>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "core/fleet/joint_choice.h"
#include "core/fleet/joint_plan_estimate.h"
#include "core/fleet/member_routes.h"
#include "core/fleet/ways_for_members.h"
#include "core/planning/budget_shares.h"
#include "core/planning/evaluation/anytime.h"
#include "core/planning/outcome.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/plan/stage_clock.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/ranking/gain_bounds.h"
#include "core/planning/ranking/gain_search.h"
#include "core/planning/ranking/rank_views.h"
#include "core/planning/ranking/score_map.h"
#include "core/planning/ranking/termination.h"
#include "core/planning/ranking/view_report.h"
#include "core/planning/scoring/gain_cells.h"
#include "core/planning/scoring/ordered_cells.h"

namespace vantage::fleet {
namespace {

auto Figures(const sensor::ScannerModel& m) {
  return std::tie(m.azimuth_span, m.elevation_min, m.elevation_max, m.azimuth_step,
                  m.elevation_step, m.range_min, m.range_max, m.range_noise, m.range_noise_ppm,
                  m.max_incidence, m.clearance, m.positioning_error);
}

absl::Status Validate(const model::PlanningView& model, const FleetRequest& request,
                      const planning::PlanningConfig& config) {
  if (request.scanners.empty()) {
    return absl::InvalidArgumentError("joint plan: name at least one scanner");
  }
  std::vector<sensor::ScannerModel> models;
  for (size_t s = 0; s < request.scanners.size(); ++s) {
    const FleetMember& member = request.scanners[s];
    if (absl::Status valid = planning::ValidateFor(model, member.model, config); !valid.ok())
      return valid;
    if (!(member.speed > 0) || !std::isfinite(member.speed) || !(member.scan_seconds >= 0) ||
        !std::isfinite(member.scan_seconds) || (member.at.has_value() && !member.at->allFinite())) {
      return absl::InvalidArgumentError(
          absl::StrCat("joint plan: scanners[", s,
                       "] needs a speed above 0 m/s, scan_seconds of at least 0 and a finite "
                       "place"));
    }
    if (std::none_of(models.begin(), models.end(), [&](const sensor::ScannerModel& other) {
          return Figures(other) == Figures(member.model);
        })) {
      models.push_back(member.model);
    }
  }
  for (size_t i = 0; i < request.pledged.size(); ++i) {
    absl::Status valid = request.pledged[i].model.Validate();
    if (!valid.ok()) return valid;
    if (!request.pledged[i].position.allFinite()) {
      return absl::InvalidArgumentError(
          absl::StrCat("joint plan: pledged[", i, "] needs a finite position"));
    }
    if (request.pledged[i].heading.has_value() && !std::isfinite(*request.pledged[i].heading)) {
      return absl::InvalidArgumentError(
          absl::StrCat("joint plan: pledged[", i, "] needs a finite heading"));
    }
  }
  return CheckJointPlanSize(model, config, models.size());
}

// The budget of an evaluation, which counts its rays from 0: a share of a budget of which `rays`
// are spent.
parallel::Budget Fresh(const parallel::Budget& budget, double share, uint64_t rays) {
  parallel::Budget part = budget.Evaluating().Part(share, rays);
  if (part.work_limit != std::numeric_limits<uint64_t>::max()) part.work_limit -= rays;
  return part;
}

class JointPlanner {
 public:
  JointPlanner(const model::PlanningView& model, const FleetRequest& request,
               const planning::PlanningConfig& config, const parallel::Budget& budget,
               parallel::Parallel& parallel, planning::PlanProgress progress)
      : model_(model),
        request_(request),
        config_(config),
        budget_(budget),
        parallel_(parallel),
        progress_(progress),
        clock_(joint_.plan.seconds) {
    joint_.plan = planning::BeginPlan(model, config);
    joint_.assignments.resize(request.scanners.size());
    for (size_t s = 0; s < request.scanners.size(); ++s) joint_.assignments[s].scanner = s;
  }

  // Errors as of MakeJointPlan().
  absl::StatusOr<JointPlan> Make() {
    if (absl::Status prepared = Prepare(); !prepared.ok()) {
      if (!absl::IsCancelled(prepared)) return prepared;
      EndEarly(prepared.message());
      return std::move(joint_);
    }
    if (!FindRoutes()) return std::move(joint_);
    if (NothingDeficient() || EveryoneNowhere()) return std::move(joint_);
    if (!Pledge() || !Evaluate()) return std::move(joint_);
    Choose();
    return std::move(joint_);
  }

 private:
  bool Single() const { return request_.scanners.size() == 1; }

  bool EndEarly(absl::string_view during) {
    EndWithoutViews(planning::EndedDuring(during, budget_).message);
    planning::EndWithoutEvaluation(planning::EndedDuring(during, budget_), joint_.plan);
    return false;
  }
  void EndWithoutViews(const std::string& reason) {
    for (Assignment& assignment : joint_.assignments) assignment.reason = reason;
    joint_.guarantee_reason = "none: no view was chosen";
  }
  const planning::PlanningProblem& First() const { return *classes_.front().problem; }

  // A to C, for each scanner model: what does not depend on it is made once. Errors as of
  // PlanningProblem::Prepare().
  absl::Status Prepare() {
    for (const FleetMember& member : request_.scanners) {
      const size_t of = ClassOf(member);
      if (of < classes_.size()) continue;
      auto problem = planning::PlanningProblem::Prepare(
          {model_, member.model, config_, classes_.empty() ? nullptr : &First(), request_.site},
          parallel_, parallel::Cancellation(budget_.cancelled));
      if (!problem.ok()) return problem.status();
      if (classes_.empty()) joint_.plan = planning::BeginPlan(**problem);
      ScannerClass& mine = classes_.emplace_back();
      mine.problem = *std::move(problem);
      const planning::FeasibleViews& feasible = mine.problem->feasible();
      for (size_t i = 0; i < feasible.cells().size(); ++i) {
        mine.views.push_back(feasible.Centre(i));
      }
    }
    clock_.Book(planning::PlanStage::kEvaluate);
    // Preparing has no deadline. Where it took the time, some is left for an answer.
    budget_ = planning::WithTimeToAnswer(budget_);
    longest_ = planning::Overrun(budget_);
    return absl::OkStatus();
  }

  size_t ClassOf(const FleetMember& member) const {
    size_t of = 0;
    while (of < classes_.size() &&
           Figures(classes_[of].problem->scanner()) != Figures(member.model)) {
      ++of;
    }
    return of;
  }

  // Each scanner's ways to the views of its class.
  bool FindRoutes() {
    const bool needs_way =
        config_.require_reachable || request_.ranking == FleetRanking::kScorePerMinute;
    for (const FleetMember& member : request_.scanners) {
      const size_t of = ClassOf(member);
      members_.push_back(
          {MemberRoutes(member, model_, classes_[of].problem->feasible(), needs_way, budget_), of});
    }
    clock_.Book(planning::PlanStage::kFeasible);
    return !budget_.Expired() || EndEarly("feasible views");
  }

  bool NothingDeficient() {
    if (!First().patches().cells.empty()) return false;
    planning::Termination termination =
        planning::JudgeTermination(First().patches(), {}, config_, std::nullopt, std::nullopt);
    EndWithoutViews(termination.reason);
    planning::Outcome outcome = planning::NothingDeficient(termination);
    planning::EndCertain(std::move(outcome), std::move(termination), joint_.plan);
    return true;
  }

  // Records the scanners that can go nowhere; true when none can go anywhere.
  bool EveryoneNowhere() {
    bool all = true;
    for (size_t s = 0; s < members_.size(); ++s) {
      joint_.assignments[s].reason = members_[s].routes.WhyNowhere();
      all = all && !joint_.assignments[s].reason.empty();
    }
    if (!all) return false;
    planning::Outcome outcome =
        classes_.front().views.empty()
            ? planning::NowhereToStand(First().feasible(), First().scanner(), config_)
            : planning::NowhereToGo(joint_.assignments.front().reason);
    planning::EndCertain(
        std::move(outcome),
        planning::JudgeTermination(First().patches(), {}, config_, std::nullopt, std::nullopt),
        joint_.plan);
    joint_.guarantee_reason = "none: no view was chosen";
    if (TakePledged(longest_)) NoteNarrowWays();
    return true;
  }

  bool Pledge() { return TakePledged(budget_) || EndEarly("evaluate views"); }

  // Claimed views count as scanned. False when the budget ended on the way.
  bool TakePledged(const parallel::Budget& budget) {
    remaining_.emplace(First().scoring().cells());
    if (!remaining_->TakeAll(request_.pledged, First().scene(), model_.voxel_size(), budget,
                             rays_)) {
      return false;
    }
    left_ = Left();
    return true;
  }

  // What is left to gain, as the hierarchy wants it.
  planning::OrderedCells Left() const {
    const planning::OrderedCells& all = First().scoring().cells();
    const planning::CellArrays& left = remaining_->left();
    if (request_.pledged.empty() && left.size() == all.size()) return all;
    return planning::OrderedCells::Order(left, parallel_).value();
  }

  // D. Evaluate views.
  bool Evaluate() {
    const planning::OrderedCells& cells = left_;
    const planning::ViewReport report(First());
    // Choosing needs about a quarter of the evaluation's time for every further scanner.
    // Beside views that count as scanned, many are refused before one registers.
    const double most = request_.pledged.empty() ? 0.8 : 0.4;
    const double rounds = most / (1 + 0.25 * static_cast<double>(members_.size() - 1));
    bool any = false;
    joint_.plan.complete = true;
    for (size_t of = 0; of < classes_.size(); ++of) {
      ScannerClass& mine = classes_[of];
      const auto show = [&](const planning::Evaluation& so_far) {
        if (of == 0) progress_(planning::StillEvaluating(report.Interim(joint_.plan, so_far)));
      };
      if (cells.size() == 0 || mine.views.empty()) {
        mine.evaluation.views.assign(mine.views.size(), {0, 0, 0, true, true, 0});
        mine.evaluation.complete = true;
      } else {
        const std::vector<double> worth = Worth(of, nullptr);
        const double share =
            rounds / (static_cast<double>(classes_.size() - of) * rounds + (1 - rounds));
        const auto evaluate = [&](const parallel::Budget& part) {
          return planning::EvaluateViews(mine.problem->scoring().scorer(), mine.problem->feasible(),
                                         cells, First().grid(), Options(true, worth), part,
                                         parallel_, show);
        };
        const parallel::Budget part = Fresh(budget_, share, rays_);
        mine.evaluation = evaluate(part);
        if (!mine.evaluation.any()) mine.evaluation = evaluate(planning::LeastEvaluation(part));
      }
      rays_ += mine.evaluation.rays;
      any = any || mine.evaluation.any();
      joint_.plan.complete = joint_.plan.complete && mine.evaluation.complete;
      mine.gains = std::make_unique<LazyGains>(mine.views, mine.problem->scoring().scorer(),
                                               *remaining_, mine.evaluation);
      mine.pending_surface = std::make_unique<PendingSurface>(
          *mine.problem, mine.problem->overlap(), ExpectedRooms::kLeaveOut);
    }
    if (joint_.plan.complete) joint_.plan.confidence = 1;
    joint_.plan.score_map = planning::ScoreMap(classes_.front().evaluation, First().feasible());
    clock_.Book(planning::PlanStage::kEvaluate);
    return any || EndEarly("evaluate views");
  }

  // By view: the largest factor of its score in the ranking among the scanners without a view.
  std::vector<double> Worth(size_t of, const JointChoice* choice) const {
    std::vector<double> worth(classes_[of].views.size(), 0);
    for (size_t s = 0; s < members_.size(); ++s) {
      if (members_[s].of != of || (choice != nullptr && choice->assigned(s))) continue;
      for (uint32_t i = 0; i < worth.size(); ++i) {
        worth[i] = std::max(worth[i], WorthTo(members_[s].routes, i, request_.ranking));
      }
    }
    return worth;
  }

  planning::AnytimeOptions Options(bool complete, std::span<const double> worth) {
    planning::AnytimeOptions options;
    // The bounds of all evaluations hold together; each evaluation has its own draws.
    const auto evaluations = static_cast<double>(classes_.size() * members_.size());
    options.confidence = 1 - (1 - config_.confidence) / evaluations;
    options.seed = config_.seed + uint64_t{1'000'003} * evaluations_++;
    options.separation = config_.candidate_separation;
    options.leaders = complete ? config_.candidates : 2;
    options.complete = complete;
    options.worth = worth;
    return options;
  }

  // Views that were not scored exactly are raced again on what is left to gain; where the time is
  // over, a little, since the gains of before say nothing about it.
  void EvaluateAgain(JointChoice& choice, size_t rounds_left) {
    const bool over = budget_.Expired();
    for (ScannerClass& mine : classes_) {
      if (mine.evaluation.complete || remaining_->left().size() == 0) continue;
      const parallel::Budget part =
          Fresh(budget_, 0.8 / static_cast<double>(rounds_left * classes_.size()), choice.rays());
      const std::vector<double> worth =
          Worth(static_cast<size_t>(&mine - classes_.data()), &choice);
      const planning::Evaluation anew = planning::EvaluateViews(
          mine.problem->scoring().scorer(), mine.problem->feasible(), remaining_->left(),
          Options(false, worth), over ? planning::LeastEvaluation(part) : part, parallel_,
          [](const planning::Evaluation&) {});
      choice.AddRays(anew.rays);
      mine.gains->Merge(anew);
    }
  }

  // E and F. The views in order, each checked for registration when its turn comes.
  void Choose() {
    std::vector<Eigen::Vector3d> taken;
    for (const PledgedView& pledged : request_.pledged) taken.push_back(pledged.position);
    // What came before may have taken the time to answer, too.
    budget_ = planning::WithTimeToAnswer(budget_);
    const parallel::Budget rest = budget_.Concluding();
    JointChoice choice(classes_, members_, *remaining_, request_.ranking, config_, taken, rest,
                       parallel_);
    choice.AddRays(rays_);
    choice.record().alike = Alike();
    std::vector<Assignment> made;
    if (Single()) {
      for (int k = 0; k < config_.candidates; ++k) {
        const auto next = choice.Next(config_.candidate_separation);
        if (!next.has_value()) break;
        if (k == 0) made.push_back(Assign(*next, made));
        Add(*next);
      }
    } else {
      for (size_t k = 0; k < members_.size(); ++k) {
        if (k > 0) EvaluateAgain(choice, members_.size() - k);
        const auto next = choice.Next(0);
        if (!next.has_value()) break;
        made.push_back(Assign(*next, made));
        Add(*next);
        joint_.score += joint_.plan.views.back().score;
        AddGain(joint_.plan.views.back());
        if (!choice.Commit(*next)) break;
      }
    }
    // The views of several scanners are all taken: none of them is left for another.
    if (Single()) planning::ViewReport::NameFallback(joint_.plan.views);
    if (Single() && !joint_.plan.views.empty()) {
      joint_.score = joint_.plan.views.front().score;
      joint_.model_gain = joint_.plan.views.front().model_gain;
    }
    Conclude(choice, std::move(made));
    clock_.Book(planning::PlanStage::kCheck);
  }

  // Of a view that counts what those before it leave.
  void AddGain(const planning::RankedView& view) {
    const bool first = joint_.plan.views.size() == 1;
    if (first) joint_.model_gain = 0;
    if (!joint_.model_gain.has_value()) return;
    if (view.model_gain.has_value()) {
      *joint_.model_gain += *view.model_gain;
    } else {
      joint_.model_gain.reset();
    }
  }

  bool Alike() const {
    if (classes_.size() > 1) return false;
    for (size_t i = 0; i < classes_.front().views.size(); ++i) {
      for (const ClassedMember& other : members_) {
        if (other.routes.Can(i) != members_.front().routes.Can(i)) return false;
      }
    }
    return true;
  }

  Assignment Assign(const ChosenView& chosen, const std::vector<Assignment>& before) const {
    Assignment assignment;
    assignment.scanner = chosen.scanner;
    assignment.view = joint_.plan.views.size();
    for (const size_t step : chosen.waits_for) {
      if (step < request_.pledged.size()) {
        assignment.waits_for_pledged.push_back(step);
      } else {
        assignment.waits_for.push_back(std::min(step - request_.pledged.size(), before.size()));
      }
    }
    return assignment;
  }

  planning::RankedView Describe(const ChosenView& chosen) {
    const ScannerClass& mine = classes_[chosen.of];
    const planning::CellArrays& left = remaining_->left();
    planning::RankedView view;
    const planning::FeasibleViews& feasible = mine.problem->feasible();
    const planning::ViewReport report(*mine.problem);
    report.Place(mine.views[chosen.view], view);
    view.travel = members_[chosen.scanner].routes.Length(view.position);
    view.verdict = chosen.verdict;
    view.heading = chosen.heading;
    view.location = planning::DescribeLocation(*mine.problem, view);
    // Regions are read from the map of scores before anything was chosen.
    const planning::Headings& headings = mine.problem->scoring().scorer().headings();
    if (remaining_->steps() == request_.pledged.size() && headings.all_around()) {
      view.region = planning::EquivalentRegionOf(mine.evaluation, feasible, chosen.view);
    } else {
      view.region = planning::RegionOfCell(feasible, feasible.cells()[chosen.view]);
    }
    view.score = mine.gains->Value(chosen.view);
    view.lower = 0;
    view.upper = mine.gains->Upper(chosen.view);
    std::vector<float> cell_scores(left.size());
    const planning::ViewScore exact =
        mine.problem->scoring().scorer().ScoreCells(view.position, left, budget_, cell_scores);
    if (exact.finished) {
      view.score = exact.score;
      if (!headings.all_around()) {
        view.score =
            planning::FaceHeading(headings, mine.problem->scanner(), left, cell_scores, view);
      }
      view.lower = view.upper = view.score;
      view.exact = true;
      planning::SplitScore(left, cell_scores, First().patches(), view);
    }
    AddModelGain(mine, view);
    return view;
  }

  // What a view with an exact score brings to density of what is left; of others the most that it
  // may bring.
  void AddModelGain(const ScannerClass& mine, planning::RankedView& view) {
    const planning::CellArrays& left = remaining_->left();
    const planning::CellArrays gains = planning::GainCells(left, First().patches());
    view.model_gain_upper =
        std::min(planning::MostGainPerSample(left, gains) * view.upper, First().patches().area);
    if (!view.exact) return;
    std::vector<float> cell_gains(gains.size());
    if (!mine.problem->scoring()
             .scorer()
             .ScoreCells(view.position, gains, budget_, cell_gains)
             .finished) {
      return;
    }
    planning::KeepSector(planning::Sector(mine.problem->scanner(), view.heading), view.position,
                         gains, cell_gains);
    planning::ViewReport::SetGain(gains, First().patches(), cell_gains, view);
  }

  void Add(const ChosenView& chosen) {
    joint_.plan.views.push_back(Describe(chosen));
    const planning::RankedView& view = joint_.plan.views.back();
    Journey& journey = joint_.journeys.emplace_back();
    journey.length = view.travel;
    journey.unreachable = members_[chosen.scanner].routes.WhyUnreachable(view.position);
    journey.minutes = chosen.minutes;
    if (chosen.minutes.has_value()) {
      journey.per_minute = view.score / std::max(0.01, *chosen.minutes);
    }
  }

  void Conclude(JointChoice& choice, std::vector<Assignment> made) {
    planning::Plan& plan = joint_.plan;
    plan.rays = choice.rays();
    plan.optimality_gap = plan.views.empty() ? 1 : 1 - choice.record().exactness;
    const size_t most = std::min(choice.refused().size(), static_cast<size_t>(config_.candidates));
    for (size_t k = 0; k < most; ++k) plan.refused.push_back(Describe(choice.refused()[k]));
    for (size_t s = 0; s < members_.size(); ++s) {
      if (std::any_of(made.begin(), made.end(),
                      [&](const Assignment& done) { return done.scanner == s; })) {
        continue;
      }
      Assignment none;
      none.scanner = s;
      none.reason = WhyNone(choice, s);
      made.push_back(std::move(none));
    }
    joint_.assignments = std::move(made);
    std::tie(joint_.guarantee, joint_.guarantee_reason) = Promise(choice);
    Terminate();
    NoteNarrowWays();
    SetOutcome(choice);
  }

  std::pair<std::optional<double>, std::string> Promise(JointChoice& choice) const {
    if (joint_.plan.views.empty()) return {std::nullopt, "none: no view was chosen"};
    Guarantee guarantee = GuaranteeOf(choice.record());
    return {guarantee.share, std::move(guarantee.reason)};
  }

  std::string WhyNone(JointChoice& choice, size_t s) const {
    std::string nowhere = members_[s].routes.WhyNowhere();
    if (!nowhere.empty()) return nowhere;
    if (choice.record().cut_short) return "the budget ended before a view was found for it";
    const char* const none = choice.record().unchecked
                                 ? "as many views as may be were checked, and none registers"
                                 : "no view that gains anything registers";
    for (const ChosenView& refused : choice.refused()) {
      if (refused.of != members_[s].of || !members_[s].routes.Can(refused.view)) continue;
      return absl::StrCat(none, "; the best refused one: ", refused.verdict.reason,
                          "; remedy: ", refused.verdict.remedy);
    }
    if (choice.crowded_out()) {
      return "what is left to gain for it lies nearer than two clearances to a tripod that stands "
             "or will stand there";
    }
    return "nothing is left to gain for it: the views of the others and the claims cover it";
  }

  void Terminate() {
    planning::Evaluation all;
    planning::GainBounds gains;
    gains.lower = planning::LargestGainWithoutHidden(joint_.plan.views);
    gains.model_gain = planning::LargestModelGain(joint_.plan.views);
    const planning::CellArrays left_gains = planning::GainCells(left_, First().patches());
    for (const ScannerClass& mine : classes_) {
      const planning::GainBounds own = planning::BoundGainWithoutHidden(
          {*mine.problem, left_, left_gains, mine.evaluation, gains.lower, gains.model_gain},
          rays_ + gains.rays, budget_.Concluding(), parallel_);
      gains.lower = std::max(gains.lower, own.lower);
      gains.upper = std::max(gains.upper, own.upper);
      gains.rays += own.rays;
      all.views.insert(all.views.end(), mine.evaluation.views.begin(), mine.evaluation.views.end());
    }
    planning::Termination& termination = joint_.plan.termination;
    termination = planning::JudgeTermination(First().patches(), all, config_, std::nullopt, gains);
    if (request_.pledged.empty()) return;
    const bool certain = termination.largest_patch_area < config_.min_patch_area;
    if (termination.suggested && !certain) {
      termination.suggested = false;
      termination.reason = absl::StrCat("not before the ", request_.pledged.size(),
                                        " claimed views have been scanned: ", termination.reason);
    }
  }

  // Of what the claims leave. Where there is no view, a way to one is all there is to say, so that
  // the budget is overrun.
  void NoteNarrowWays() {
    planning::Plan& plan = joint_.plan;
    const parallel::Budget& budget = plan.views.empty() ? longest_ : budget_;
    plan.narrow_ways = WaysForMembers(classes_, members_, left_,
                                      plan.termination.best_gain_without_hidden.value_or(0),
                                      std::max(rays_, plan.rays), budget.Concluding(), parallel_);
  }

  planning::Outcome OutcomeOf(JointChoice& choice) const {
    const planning::Plan& plan = joint_.plan;
    const size_t refused = choice.refused().size();
    if (budget_.cancelled.stop_requested()) return planning::CancelledAfter(choice.checked());
    if (!plan.views.empty()) {
      if (Single()) return planning::ViewsFound(plan.views.size(), refused);
      return planning::ViewsFoundForFleet(plan.views.size(), members_.size(), joint_.model_gain,
                                          refused);
    }
    if (choice.record().cut_short) {
      return planning::UnfinishedAfter(choice.checked(),
                                       refused > 0 ? &choice.refused().front().verdict : nullptr,
                                       std::nullopt, budget_);
    }
    if (refused > 0) {
      return planning::NoneRegisters(choice.checked(), choice.refused().front().verdict);
    }
    if (plan.complete && choice.crowded_out()) return planning::CrowdedOut();
    return planning::NothingGains(plan.complete,
                                  request_.pledged.empty() ? "" : "beyond the claimed ones");
  }

  void SetOutcome(JointChoice& choice) {
    planning::Plan& plan = joint_.plan;
    planning::Conclude(OutcomeOf(choice), plan);
    planning::AddScansNotIn(request_.pledged.size(), plan);
    const MemberRoutes& first = members_.front().routes;
    if (Single() && first.reachable() < first.within_reach()) {
      planning::AddNoWayTo(first.within_reach() - first.reachable(), first.within_reach(), plan);
    }
  }

  const model::PlanningView& model_;
  const FleetRequest& request_;
  const planning::PlanningConfig& config_;
  parallel::Budget budget_;
  parallel::Budget longest_;  // as long as there is no view
  parallel::Parallel& parallel_;
  planning::PlanProgress progress_;
  JointPlan joint_;
  planning::StageClock clock_;
  std::vector<ScannerClass> classes_;
  std::vector<ClassedMember> members_;
  std::optional<RemainingGain> remaining_;
  planning::OrderedCells left_;  // what the claims leave
  uint64_t rays_ = 0;
  uint64_t evaluations_ = 0;  // number of evaluations that were begun
};

}  // namespace

absl::StatusOr<JointPlan> MakeJointPlan(const model::PlanningView& model,
                                        const FleetRequest& request,
                                        const planning::PlanningConfig& config,
                                        const parallel::Budget& budget,
                                        parallel::Parallel& parallel,
                                        planning::PlanProgress progress) {
  if (absl::Status valid = Validate(model, request, config); !valid.ok()) return valid;
  return JointPlanner(model, request, config, budget, parallel, progress).Make();
}

}  // namespace vantage::fleet

#include "core/fleet/joint_choice.h"

#include <algorithm>
#include <limits>

#include "core/fleet/horizontal_distance.h"
#include "core/planning/budget_shares.h"

namespace vantage::fleet {
namespace {

constexpr size_t kBatch = 16;  // views brought up to date together, whatever the number of threads

constexpr double kLeastMinutes = 0.01;  // no view is free

}  // namespace

double WorthTo(const MemberRoutes& routes, uint32_t view, FleetRanking ranking) {
  if (!routes.Can(view)) return 0;
  if (ranking == FleetRanking::kScore) return 1;
  const std::optional<double> minutes = routes.Minutes(view);
  return minutes.has_value() ? 1 / std::max(kLeastMinutes, *minutes) : 0;
}

JointChoice::JointChoice(std::vector<ScannerClass>& classes, std::vector<ClassedMember>& members,
                         RemainingGain& remaining, FleetRanking ranking,
                         const planning::PlanningConfig& config,
                         const std::vector<Eigen::Vector3d>& taken, const parallel::Budget& budget,
                         parallel::Parallel& parallel)
    : classes_(classes),
      members_(members),
      remaining_(remaining),
      ranking_(ranking),
      config_(config),
      budget_(budget),
      parallel_(parallel),
      taken_(taken),
      given_(taken.size()),
      assigned_(members.size(), false),
      done_after_(remaining.steps()),
      near_first_(classes.front().problem->feasible().cell_size()) {
  record_.scanners = members.size();
  record_.by_minutes = ranking == FleetRanking::kScorePerMinute;
}

std::optional<size_t> JointChoice::BestScanner(size_t of, uint32_t view) const {
  std::optional<size_t> best;
  double least = std::numeric_limits<double>::infinity();
  for (size_t s = 0; s < members_.size(); ++s) {
    if (assigned_[s] || members_[s].of != of || !members_[s].routes.Can(view)) continue;
    const std::optional<double> minutes = members_[s].routes.Minutes(view);
    if (!minutes.has_value() && ranking_ == FleetRanking::kScorePerMinute) continue;
    const double cost = minutes.value_or(1e9);
    if (cost >= least) continue;
    least = cost;
    best = s;
  }
  return best;
}

double JointChoice::Key(size_t of, uint32_t view, double score) const {
  const std::optional<size_t> scanner = BestScanner(of, view);
  if (!scanner.has_value() || !(score > 0)) return -1;
  double worth = WorthTo(members_[*scanner].routes, view, ranking_);
  const auto judged = judged_.find({of, view});
  if (judged != judged_.end() && judged->second.heading.has_value()) {
    score = std::min(score, judged->second.score);
  }
  if (ranking_ == FleetRanking::kScorePerMinute && judged != judged_.end() &&
      judged->second.minutes.has_value()) {
    worth = std::min(worth, 1 / std::max(kLeastMinutes, *judged->second.minutes));
  }
  return score * worth;
}

void JointChoice::Fill(double apart) {
  std::vector<Entry> entries;
  for (size_t of = 0; of < classes_.size(); ++of) {
    for (uint32_t i = 0; i < classes_[of].views.size(); ++i) {
      if (!classes_[of].gains->Ranked(i)) continue;
      const double key = Key(of, i, classes_[of].gains->Value(i));
      if (!(key > 0)) continue;
      if (!near_first_.all() && Away(of, i) > near_first_.within()) continue;
      if (NearListed(of, i, apart)) continue;
      entries.push_back({key, of, i});
    }
  }
  queue_ = std::priority_queue<Entry>(std::less<Entry>(), std::move(entries));
}

bool JointChoice::NearListed(size_t of, uint32_t view, double apart) const {
  const Eigen::Vector3d& at = classes_[of].views[view];
  return std::any_of(listed_.begin(), listed_.end(),
                     [&](const Eigen::Vector3d& p) { return (p - at).norm() < apart; });
}

parallel::Budget JointChoice::Share(double share) const {
  const auto waiting = std::count(assigned_.begin(), assigned_.end(), false);
  return budget_.Evaluating().Part(share / static_cast<double>(std::max<ptrdiff_t>(1, waiting)),
                                   rays_);
}

bool JointChoice::Refresh(std::span<const Entry> stale, const parallel::Budget& refining) {
  if (rays_ >= refining.work_limit || refining.Expired()) return false;
  for (size_t of = 0; of < classes_.size(); ++of) {
    std::vector<uint32_t> which;
    for (const Entry& entry : stale) {
      if (entry.of == of) which.push_back(entry.view);
    }
    if (which.empty()) continue;
    if (!classes_[of].gains->Refresh(which, refining, parallel_, rays_)) return false;
  }
  return true;
}

void JointChoice::Enqueue(size_t of, uint32_t view) {
  const double key = Key(of, view, classes_[of].gains->Value(view));
  if (key > 0) queue_.push({key, of, view});
}

double JointChoice::Away(size_t of, uint32_t view) const {
  const Eigen::Vector3d& at = classes_[of].views[view];
  double away = std::numeric_limits<double>::infinity();
  for (const model::Station& station : classes_[of].problem->model().stations()) {
    away = std::min(away, (station.position - at).norm());
  }
  return away;
}

bool JointChoice::RuledOut(size_t of, uint32_t view) const {
  // What was found to register stays, whatever was refused beside it since.
  if (judged_.contains({of, view})) return false;
  const std::vector<Eigen::Vector3d>& views = classes_[of].views;
  return tried_out_.contains({of, view}) ||
         std::any_of(refusals_.begin(), refusals_.end(), [&](const Refusal& refusal) {
           return refusal.of == of &&
                  (refusal.view == view ||
                   (refusal.around == Refusal::Around::kAlike &&
                    (views[refusal.view] - views[view]).norm() < config_.candidate_separation));
         });
}

std::optional<std::vector<JointChoice::Refusal*>> JointChoice::TriedInsteadOf(
    const Entry& entry, const parallel::Budget& trying) {
  if (RuledOut(entry.of, entry.view)) return std::nullopt;
  const std::vector<Eigen::Vector3d>& views = classes_[entry.of].views;
  const bool time = tried_ < static_cast<size_t>(config_.max_checked) * members_.size() &&
                    rays_ < trying.work_limit && !trying.Expired();
  bool left_off = false;
  std::vector<Refusal*> instead_of;
  for (Refusal& refusal : refusals_) {
    if (refusal.of != entry.of ||
        (views[refusal.view] - views[entry.view]).norm() >= config_.candidate_separation) {
      continue;
    }
    if (!time) refusal.around = Refusal::Around::kLeftOff;
    left_off |= refusal.around == Refusal::Around::kLeftOff;
    instead_of.push_back(&refusal);
  }
  if (left_off) return std::nullopt;
  return instead_of;
}

void JointChoice::Refuse(const ChosenView& view, std::span<Refusal* const> instead_of) {
  if (!instead_of.empty()) {
    ++tried_;
    tried_out_.insert({view.of, view.view});
    for (Refusal* refusal : instead_of) {
      if (++refusal->tried >= planning::kTriedAround) refusal->around = Refusal::Around::kAlike;
    }
    return;
  }
  const bool doubtful = view.verdict.outcome == registration::RegistrationOutcome::kDoubtful;
  refusals_.push_back(
      {view.of, view.view, doubtful ? Refusal::Around::kTried : Refusal::Around::kAlike, 0});
  if (std::none_of(refused_.begin(), refused_.end(), [&](const ChosenView& other) {
        return other.of == view.of && other.view == view.view;
      })) {
    refused_.push_back(view);
  }
}

JointChoice::Fate JointChoice::Judge(const Entry& entry, const parallel::Budget& trying,
                                     ChosenView& chosen) {
  ScannerClass& mine = classes_[entry.of];
  const Eigen::Vector3d& at = mine.views[entry.view];
  const auto judged = judged_.find({entry.of, entry.view});
  if (judged != judged_.end()) {
    chosen = judged->second;
    return Fate::kTaken;
  }
  const std::optional<std::vector<Refusal*>> instead_of = TriedInsteadOf(entry, trying);
  if (!instead_of.has_value()) return Fate::kOut;
  const double room = 2 * mine.problem->scanner().clearance;
  for (size_t k = 0; k < taken_.size(); ++k) {
    if (HorizontalDistance(taken_[k], at) >= room) continue;
    record_.crowded |= k >= given_;
    crowded_out_ = true;
    return Fate::kOut;
  }
  if (checked_ - tried_ >= static_cast<size_t>(config_.max_checked) * members_.size()) {
    record_.unchecked |= listed_.empty();
    return Fate::kStop;
  }
  if (rays_ >= checking_until_) {
    record_.cut_short = true;
    return Fate::kStop;
  }
  const planning::BruteForceScorer& scorer = mine.problem->scoring().scorer();
  std::vector<double> by_heading(scorer.headings().size());
  if (!scorer.headings().all_around()) {
    const planning::ViewScore score =
        scorer.ScoreHeadings(at, remaining_.left(), budget_, by_heading);
    rays_ += score.rays;
    if (!score.finished) {
      record_.cut_short = true;
      return Fate::kStop;
    }
  }
  auto verdict =
      mine.pending_surface->Judge(at, remaining_, config_.registration, budget_, rays_, by_heading);
  if (!verdict.has_value()) {
    record_.cut_short = true;
    return Fate::kStop;
  }
  ++checked_;
  chosen = {entry.of,
            entry.view,
            *BestScanner(entry.of, entry.view),
            std::move(verdict->verdict),
            std::move(verdict->waits_for),
            {},
            {},
            0};
  if (!scorer.headings().all_around()) {
    chosen.heading = scorer.headings().Angle(verdict->heading);
    chosen.score = by_heading[verdict->heading];
  }
  if (!chosen.verdict.registered()) {
    near_first_.Refused(Away(entry.of, entry.view));
    Refuse(chosen, *instead_of);
    return Fate::kOut;
  }
  const MemberRoutes& routes = members_[chosen.scanner].routes;
  chosen.minutes = routes.Minutes(entry.view);
  if (chosen.waits_for.empty()) {
    for (Refusal* refusal : *instead_of) refusal->around = Refusal::Around::kLeftOff;
    if (!chosen.heading.has_value()) return Fate::kTaken;
    // With a heading that registers it may be worth less than its rank says.
    judged_[{entry.of, entry.view}] = chosen;
    return Fate::kPutBack;
  }
  // The scan starts when the last of those scans is in. The time of a claimed view's scan is not
  // known.
  double before = 0;
  for (const size_t step : chosen.waits_for) {
    before = std::max(before, done_after_[step].value_or(0));
  }
  if (chosen.minutes.has_value()) {
    const double scan = routes.member().scan_seconds / 60;
    chosen.minutes = std::max(*chosen.minutes - scan, before) + scan;
  }
  judged_[{entry.of, entry.view}] = chosen;
  return ranking_ == FleetRanking::kScorePerMinute || chosen.heading.has_value() ? Fate::kPutBack
                                                                                 : Fate::kTaken;
}

void JointChoice::NoteExactness(const ChosenView& chosen) {
  const double key = Key(chosen.of, chosen.view, classes_[chosen.of].gains->Value(chosen.view));
  double most = key;
  const std::span<const Eigen::Vector3d> given = std::span(taken_).first(given_);
  for (size_t of = 0; of < classes_.size(); ++of) {
    const LazyGains& gains = *classes_[of].gains;
    const double room = 2 * classes_[of].problem->scanner().clearance;
    for (uint32_t i = 0; i < classes_[of].views.size(); ++i) {
      if (gains.Upper(i) <= 0) continue;
      const double upper = Key(of, i, gains.Upper(i));
      if (upper <= most || RuledOut(of, i)) continue;
      // No scanner can stand right beside a claimed view.
      const Eigen::Vector3d& at = classes_[of].views[i];
      if (std::none_of(given.begin(), given.end(), [&](const Eigen::Vector3d& other) {
            return HorizontalDistance(other, at) < room;
          })) {
        most = upper;
      }
    }
  }
  // A difference within rounding is not a better choice.
  const double share = key >= most * (1 - 1e-5) ? 1 : key / most;
  record_.exactness = std::min(record_.exactness, share);
}

std::vector<JointChoice::Entry> JointChoice::StaleTop(const parallel::Budget& refining) {
  std::vector<Entry> stale;
  uint64_t affordable = refining.work_limit - std::min(refining.work_limit, rays_);
  while (!queue_.empty() && stale.size() < kBatch) {
    const Entry top = queue_.top();
    const LazyGains& gains = *classes_[top.of].gains;
    if (gains.Fresh(top.view)) break;
    if (RuledOut(top.of, top.view)) {
      queue_.pop();
      continue;
    }
    const uint64_t cost = gains.MostRays(top.view);
    if (!stale.empty() && cost > affordable) break;
    affordable -= std::min(affordable, cost);
    stale.push_back(top);
    queue_.pop();
  }
  return stale;
}

std::optional<ChosenView> JointChoice::Next(double apart) {
  // The scanners before it may have taken the time; nobody is left without an answer for that.
  if (listed_.empty()) {
    budget_ = planning::WithTimeToAnswer(budget_);
    near_first_.Restart();
  }
  Fill(apart);
  // The remaining share is for checks and, with one scanner, for further views.
  const parallel::Budget refining = Share(0.8);
  const parallel::Budget trying = Share(0.9);
  // A choice without a registration check is worth little, so rays are kept for checks.
  checking_until_ = budget_.work_limit;
  if (rays_ > checking_until_ - checking_until_ / 10) {
    checking_until_ = rays_ + checking_until_ / 10;
  }
  bool spent = false;
  while (true) {
    if (near_first_.Change(queue_.empty())) {
      Fill(apart);
      continue;
    }
    if (queue_.empty()) break;
    std::vector<Entry> stale = spent ? std::vector<Entry>() : StaleTop(refining);
    if (!stale.empty()) {
      spent = !Refresh(stale, refining);
      record_.cut_short |= spent;
      for (const Entry& entry : stale) Enqueue(entry.of, entry.view);
      continue;
    }
    if (queue_.empty()) continue;  // the rest was ruled out
    Entry top = queue_.top();
    queue_.pop();
    // From here on estimates from samples are good enough. A gain from before other views were
    // chosen is not, since those views may have taken it.
    if (spent && !classes_[top.of].gains->Current(top.view)) continue;
    ChosenView chosen;
    switch (Judge(top, trying, chosen)) {
      case Fate::kOut:
        continue;
      case Fate::kStop:
        if (const auto best = BestJudged(apart); best.has_value()) {
          top = *best;
          chosen = judged_.at({best->of, best->view});
          break;
        }
        return std::nullopt;
      case Fate::kPutBack:
        Enqueue(top.of, top.view);
        continue;
      case Fate::kTaken:
        break;
    }
    if (!near_first_.Take()) {
      judged_[{top.of, top.view}] = chosen;
      Fill(apart);
      continue;
    }
    List(top, chosen);
    return chosen;
  }
  return std::nullopt;
}

void JointChoice::List(const Entry& entry, const ChosenView& chosen) {
  if (listed_.empty()) {
    // The plan states the view's gain, so it is computed even when the share for refining is spent.
    if (!classes_[entry.of].gains->Fresh(entry.view)) (void)Refresh({&entry, 1}, budget_);
    NoteExactness(chosen);
  }
  listed_.push_back(classes_[entry.of].views[entry.view]);
}

std::optional<JointChoice::Entry> JointChoice::BestJudged(double apart) const {
  std::optional<Entry> best;
  for (const auto& [view, chosen] : judged_) {
    const double key = Key(view.first, view.second, classes_[view.first].gains->Value(view.second));
    if (!(key > 0) || NearListed(view.first, view.second, apart)) continue;
    const Entry entry{key, view.first, view.second};
    if (!best.has_value() || *best < entry) best = entry;
  }
  return best;
}

bool JointChoice::Commit(const ChosenView& chosen) {
  ScannerClass& mine = classes_[chosen.of];
  if (!remaining_.Take(mine.views[chosen.view], mine.problem->scoring().scorer(), budget_, rays_,
                       chosen.heading)) {
    record_.cut_short = true;
    return false;
  }
  record_.waits |= !chosen.waits_for.empty();
  assigned_[chosen.scanner] = true;
  done_after_.push_back(chosen.minutes);
  taken_.push_back(mine.views[chosen.view]);
  listed_.clear();
  judged_.clear();
  // Views that were refused may register when this scan is in.
  refusals_.clear();
  tried_out_.clear();
  return true;
}

}  // namespace vantage::fleet

#include "core/fleet/joint_choice.h"

#include <algorithm>
#include <limits>

namespace vantage {
namespace {

constexpr size_t kBatch = 16;  // views brought up to date together, whatever the number of threads

double Apart(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return (a - b).head<2>().norm();
}

}  // namespace

JointChoice::JointChoice(std::vector<ScannerClass>& classes, std::vector<CrewOf>& crew,
                         Residual& residual, FleetRanking ranking, const PlanningConfig& config,
                         const std::vector<Eigen::Vector3d>& taken, const Budget& budget,
                         Parallel& parallel)
    : classes_(classes),
      crew_(crew),
      residual_(residual),
      ranking_(ranking),
      config_(config),
      budget_(budget),
      parallel_(parallel),
      taken_(taken),
      given_(taken.size()),
      assigned_(crew.size(), false),
      done_after_(residual.steps()) {
  record_.scanners = crew.size();
  record_.by_minutes = ranking == FleetRanking::kGainPerMinute;
}

std::optional<size_t> JointChoice::BestScanner(size_t of, uint32_t view) const {
  std::optional<size_t> best;
  double least = std::numeric_limits<double>::infinity();
  for (size_t s = 0; s < crew_.size(); ++s) {
    if (assigned_[s] || crew_[s].of != of || !crew_[s].member.Can(view)) continue;
    const std::optional<double> minutes = crew_[s].member.Minutes(view);
    if (!minutes.has_value() && ranking_ == FleetRanking::kGainPerMinute) continue;
    const double cost = minutes.value_or(1e9);
    if (cost >= least) continue;
    least = cost;
    best = s;
  }
  return best;
}

double JointChoice::Key(size_t of, uint32_t view, double gain) const {
  const std::optional<size_t> scanner = BestScanner(of, view);
  if (!scanner.has_value() || !(gain > 0)) return -1;
  if (ranking_ == FleetRanking::kGain) return gain;
  // Half a second at least: no view is free.
  double minutes = std::max(0.01, *crew_[*scanner].member.Minutes(view));
  const auto judged = waiting_.find({of, view});
  if (judged != waiting_.end()) minutes = std::max(minutes, judged->second.minutes.value_or(0));
  return gain / minutes;
}

void JointChoice::Fill(double apart) {
  std::vector<Entry> entries;
  for (size_t of = 0; of < classes_.size(); ++of) {
    for (uint32_t i = 0; i < classes_[of].views.size(); ++i) {
      if (!classes_[of].gains->Ranked(i)) continue;
      const double key = Key(of, i, classes_[of].gains->Value(i));
      if (!(key > 0)) continue;
      const Eigen::Vector3d& at = classes_[of].views[i];
      if (std::any_of(listed_.begin(), listed_.end(),
                      [&](const Eigen::Vector3d& p) { return (p - at).norm() < apart; })) {
        continue;
      }
      entries.push_back({key, of, i});
    }
  }
  queue_ = std::priority_queue<Entry>(std::less<Entry>(), std::move(entries));
}

bool JointChoice::Spent() const { return rays_ >= budget_.work_limit || budget_.Expired(); }

bool JointChoice::RefreshTop(std::vector<Entry>& stale) {
  for (size_t of = 0; of < classes_.size(); ++of) {
    std::vector<uint32_t> which;
    for (const Entry& entry : stale) {
      if (entry.of == of) which.push_back(entry.view);
    }
    if (which.empty()) continue;
    if (!classes_[of].gains->Refresh(which, budget_, parallel_, rays_)) return false;
  }
  for (Entry& entry : stale) {
    entry.key = Key(entry.of, entry.view, classes_[entry.of].gains->Value(entry.view));
    if (entry.key > 0) queue_.push(entry);
  }
  return true;
}

bool JointChoice::NearRefused(size_t of, const Eigen::Vector3d& at) const {
  return std::any_of(refused_now_.begin(), refused_now_.end(), [&](const ChosenView& refused) {
    return refused.of == of && (classes_[of].views[refused.view] - at).norm() < config_.separation;
  });
}

JointChoice::Fate JointChoice::Judge(const Entry& entry, ChosenView& chosen) {
  ScannerClass& mine = classes_[entry.of];
  const Eigen::Vector3d& at = mine.views[entry.view];
  const auto judged = waiting_.find({entry.of, entry.view});
  if (judged != waiting_.end()) {
    chosen = judged->second;
    return Fate::kTaken;
  }
  if (NearRefused(entry.of, at)) return Fate::kOut;
  const double room = 2 * mine.model.clearance;
  for (size_t k = 0; k < taken_.size(); ++k) {
    if (Apart(taken_[k], at) >= room) continue;
    record_.crowded |= k >= given_;
    return Fate::kOut;
  }
  if (checked_ >= static_cast<size_t>(config_.max_checked) * crew_.size()) return Fate::kStop;
  auto verdict = mine.expected->Judge(at, residual_, config_.registration, budget_, rays_);
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
            {}};
  if (!chosen.verdict.registered()) {
    refused_now_.push_back(chosen);
    if (std::none_of(refused_.begin(), refused_.end(), [&](const ChosenView& other) {
          return other.of == chosen.of && other.view == chosen.view;
        })) {
      refused_.push_back(chosen);
    }
    return Fate::kOut;
  }
  const CrewMember& member = crew_[chosen.scanner].member;
  chosen.minutes = member.Minutes(entry.view);
  if (chosen.waits_for.empty()) return Fate::kTaken;
  // It starts to scan when the last of those is in. When a claim's comes is not known.
  double before = 0;
  for (const size_t step : chosen.waits_for) {
    before = std::max(before, done_after_[step].value_or(0));
  }
  if (chosen.minutes.has_value()) {
    const double scan = member.scanner().scan_seconds / 60;
    chosen.minutes = std::max(*chosen.minutes - scan, before) + scan;
  }
  waiting_[{entry.of, entry.view}] = chosen;
  return ranking_ == FleetRanking::kGainPerMinute ? Fate::kPutBack : Fate::kTaken;
}

void JointChoice::NoteExactness(const ChosenView& chosen) {
  const double key = Key(chosen.of, chosen.view, classes_[chosen.of].gains->Value(chosen.view));
  double most = key;
  for (size_t of = 0; of < classes_.size(); ++of) {
    const LazyGains& gains = *classes_[of].gains;
    for (uint32_t i = 0; i < classes_[of].views.size(); ++i) {
      if (gains.Upper(i) <= 0) continue;
      const double upper = Key(of, i, gains.Upper(i));
      if (upper <= most || NearRefused(of, classes_[of].views[i])) continue;
      most = upper;
    }
  }
  // What floats round is no better choice.
  const double share = key >= most * (1 - 1e-5) ? 1 : key / most;
  record_.exactness = std::min(record_.exactness, share);
}

std::optional<ChosenView> JointChoice::Next(double apart) {
  Fill(apart);
  std::vector<Entry> stale;
  while (!queue_.empty()) {
    stale.clear();
    uint64_t affordable = budget_.work_limit - std::min(budget_.work_limit, rays_);
    while (!queue_.empty() && stale.size() < kBatch) {
      const Entry top = queue_.top();
      const LazyGains& gains = *classes_[top.of].gains;
      if (gains.Fresh(top.view)) break;
      const uint64_t cost = gains.MostRays(top.view);
      if (!stale.empty() && cost > affordable) break;
      affordable -= std::min(affordable, cost);
      stale.push_back(top);
      queue_.pop();
    }
    if (!stale.empty()) {
      if (Spent() || !RefreshTop(stale)) {
        record_.cut_short = true;
        return std::nullopt;
      }
      continue;
    }
    const Entry top = queue_.top();
    queue_.pop();
    ChosenView chosen;
    switch (Judge(top, chosen)) {
      case Fate::kOut:
        continue;
      case Fate::kStop:
        return std::nullopt;
      case Fate::kPutBack: {
        const double key = Key(top.of, top.view, classes_[top.of].gains->Value(top.view));
        queue_.push({key, top.of, top.view});
        continue;
      }
      case Fate::kTaken:
        break;
    }
    if (listed_.empty()) NoteExactness(chosen);
    listed_.push_back(classes_[top.of].views[top.view]);
    return chosen;
  }
  return std::nullopt;
}

bool JointChoice::Settle(const ChosenView& chosen) {
  ScannerClass& mine = classes_[chosen.of];
  if (!residual_.Take(mine.views[chosen.view], mine.scoring->scorer(), budget_, rays_)) {
    record_.cut_short = true;
    return false;
  }
  record_.waits |= !chosen.waits_for.empty();
  assigned_[chosen.scanner] = true;
  done_after_.push_back(chosen.minutes);
  taken_.push_back(mine.views[chosen.view]);
  listed_.clear();
  waiting_.clear();
  // What was refused may register once this scan is in.
  refused_now_.clear();
  return true;
}

}  // namespace vantage

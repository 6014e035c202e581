// The greedy choice of views for several scanners (algorithm.md section 11, 'Joint planning').
#ifndef VANTAGE_CORE_FLEET_JOINT_CHOICE_H_
#define VANTAGE_CORE_FLEET_JOINT_CHOICE_H_

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <queue>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "core/fleet/crew.h"
#include "core/fleet/guarantee.h"
#include "core/fleet/joint_plan.h"
#include "core/fleet/lazy_gains.h"
#include "core/fleet/residual.h"
#include "core/fleet/waiting.h"
#include "core/planning/evaluation.h"
#include "core/planning/feasible_views.h"
#include "core/planning/registration_check.h"
#include "core/planning/scoring.h"

namespace vantage {

// All that scanners of one model share.
struct ScannerClass {
  ScannerModel model;
  FeasibleViews feasible;
  std::vector<Eigen::Vector3d> views;  // centres of the feasible cells
  std::unique_ptr<Scoring> scoring;
  std::unique_ptr<OverlapSurface> overlap;
  std::unique_ptr<ExpectedSurface> expected;
  Evaluation evaluation;  // before anything was chosen
  std::unique_ptr<LazyGains> gains;
};

struct CrewOf {
  CrewMember member;
  size_t of = 0;  // class
};

// A view that was chosen, or refused.
struct ChosenView {
  size_t of = 0;  // class
  uint32_t view = 0;
  size_t scanner = 0;
  RegistrationVerdict verdict;
  std::vector<size_t> waits_for;  // steps of the residual
  std::optional<double> minutes;
};

// What a sample gained by a view counts in the ranking, if the member goes there; 0: it cannot.
double WorthTo(const CrewMember& member, uint32_t view, FleetRanking ranking);

// Chooses one view after the other. References are kept.
class JointChoice {
 public:
  JointChoice(std::vector<ScannerClass>& classes, std::vector<CrewOf>& crew, Residual& residual,
              FleetRanking ranking, const PlanningConfig& config,
              const std::vector<Eigen::Vector3d>& taken, const Budget& budget, Parallel& parallel);

  // The best view of all scanners that have none, by what is known when most of the budget is
  // spent; nothing when there is none, or no time to check that it registers.
  // `apart`: only views that far from those that were returned before, m.
  std::optional<ChosenView> Next(double apart);
  // Gives the view to its scanner: others count for what it leaves. False when the budget ended.
  bool Settle(const ChosenView& chosen);

  GreedyRecord& record() { return record_; }
  // Views that gain something were left out beside tripods that stand or will stand there.
  bool crowded_out() const { return crowded_out_; }
  // By the registration check, the most promising first.
  const std::vector<ChosenView>& refused() const { return refused_; }
  size_t checked() const { return checked_; }
  uint64_t rays() const { return rays_; }
  void AddRays(uint64_t rays) { rays_ += rays; }
  bool assigned(size_t scanner) const { return assigned_[scanner]; }

 private:
  struct Entry {
    double key;
    size_t of;
    uint32_t view;
    bool operator<(const Entry& other) const {
      if (key != other.key) return key < other.key;
      return std::pair(of, view) > std::pair(other.of, other.view);
    }
  };
  enum class Fate { kTaken, kOut, kPutBack, kStop };
  // A view that was refused in this round, and what that says of the views around it.
  struct Refusal {
    enum class Around {
      kAlike,    // they would be refused, too
      kTried,    // it was doubtful: the best of them are tried
      kLeftOff,  // one of them registered, or there was no time: of the rest nothing is known
    };
    size_t of = 0;
    uint32_t view = 0;
    Around around = Around::kAlike;
    size_t tried = 0;
  };

  // The scanner without a view that would be there first; nothing when none can be sent.
  std::optional<size_t> BestScanner(size_t of, uint32_t view) const;
  // What a gain counts in the ranking; below 0: it does not.
  double Key(size_t of, uint32_t view, double gain) const;
  void Fill(double apart);
  // False when the budget ended before all were fresh.
  bool Refresh(std::span<const Entry> stale, const Budget& refining);
  void Enqueue(size_t of, uint32_t view);
  // `trying`: until then, views around doubtful ones are tried.
  Fate Judge(const Entry& entry, const Budget& trying, ChosenView& chosen);
  // What is known of a view by what was refused.
  bool RuledOut(size_t of, uint32_t view) const;
  // Refusals that it is tried instead of; nothing when it is not to be looked at.
  std::optional<std::vector<Refusal*>> TriedInsteadOf(const Entry& entry, const Budget& trying);
  void Refuse(const ChosenView& view, std::span<Refusal* const> instead_of);
  void NoteExactness(const ChosenView& chosen);
  // Takes those that are not fresh off the front of the queue, a batch at most.
  std::vector<Entry> StaleTop(const Budget& refining);
  // A share of what is left of the budget, for the scanners without a view evenly.
  Budget Share(double share) const;

  std::vector<ScannerClass>& classes_;
  std::vector<CrewOf>& crew_;
  Residual& residual_;
  const FleetRanking ranking_;
  const PlanningConfig& config_;
  const Budget& budget_;
  Parallel& parallel_;
  std::vector<Eigen::Vector3d> taken_;   // tripods that stand or will stand there
  const size_t given_;                   // of those, not chosen here
  std::vector<Eigen::Vector3d> listed_;  // returned since the last Settle()
  std::vector<bool> assigned_;
  std::vector<std::optional<double>> done_after_;  // minutes, by step of the residual
  std::priority_queue<Entry> queue_;
  std::map<std::pair<size_t, uint32_t>, ChosenView> waiting_;  // judged in this round
  std::vector<ChosenView> refused_;
  std::vector<Refusal> refusals_;                    // in this round
  std::set<std::pair<size_t, uint32_t>> tried_out_;  // around doubtful ones, in this round
  GreedyRecord record_;
  bool crowded_out_ = false;
  size_t checked_ = 0;
  size_t tried_ = 0;  // of those, around doubtful ones
  uint64_t rays_ = 0;
  uint64_t checking_until_ = 0;  // rays
};

}  // namespace vantage

#endif  // VANTAGE_CORE_FLEET_JOINT_CHOICE_H_

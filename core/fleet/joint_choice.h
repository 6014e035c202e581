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

#include "core/fleet/fleet_request.h"
#include "core/fleet/guarantee.h"
#include "core/fleet/lazy_gains.h"
#include "core/fleet/member_routes.h"
#include "core/fleet/near_first.h"
#include "core/fleet/pending_surface.h"
#include "core/fleet/remaining_gain.h"
#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/evaluation/evaluation.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/ranking/registration_check.h"
#include "core/registration/bound/verdict.h"

namespace vantage::fleet {

// The data that scanners of one model share.
struct ScannerClass {
  std::shared_ptr<const planning::PlanningProblem> problem;
  std::vector<Eigen::Vector3d> views;  // centres of the feasible cells
  std::unique_ptr<PendingSurface> pending_surface;
  planning::Evaluation evaluation;  // before anything was chosen
  std::unique_ptr<LazyGains> gains;
};

struct ClassedMember {
  MemberRoutes routes;
  size_t of = 0;  // class
};

// A view that was chosen or refused.
struct ChosenView {
  size_t of = 0;  // class
  uint32_t view = 0;
  size_t scanner = 0;
  registration::RegistrationVerdict verdict;
  std::vector<size_t> waits_for;  // steps of the remaining gain
  std::optional<double> minutes;
  // Of a scanner that sees a sector: where it faces, rad, and what it gains so, samples.
  std::optional<double> heading;
  double score = 0;
};

// The factor of a view's score in the ranking if the member goes there; 0 when it cannot.
double WorthTo(const MemberRoutes& routes, uint32_t view, FleetRanking ranking);

// Chooses views one at a time. References are kept.
class JointChoice {
 public:
  JointChoice(std::vector<ScannerClass>& classes, std::vector<ClassedMember>& members,
              RemainingGain& remaining, FleetRanking ranking,
              const planning::PlanningConfig& config, const std::vector<Eigen::Vector3d>& taken,
              const parallel::Budget& budget, parallel::Parallel& parallel);

  // The best view for a scanner that has none, by what is known when most of this choice's budget
  // is spent; each scanner has a quarter of a second from when its turn begins. Nothing when there
  // is none, or no time to check that it registers. `apart`: least distance from the views that
  // were returned before, m.
  std::optional<ChosenView> Next(double apart);
  // Assigns the view to its scanner; other views then count for what it leaves. False when the
  // budget ended.
  bool Commit(const ChosenView& chosen);

  GreedyRecord& record() { return record_; }
  // True when views that gain something were left out because they are beside a tripod that stands,
  // or will stand, there.
  bool crowded_out() const { return crowded_out_; }
  // Views refused by the registration check, the highest ranked first.
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
  // A view that was refused in this round, and what its refusal means for the views around it.
  struct Refusal {
    enum class Around {
      kAlike,    // they count as refused, too
      kTried,    // the view was doubtful: the best views around it are tried
      kLeftOff,  // one of them registered, or time ran out: the rest is unknown
    };
    size_t of = 0;
    uint32_t view = 0;
    Around around = Around::kAlike;
    size_t tried = 0;
  };

  // The scanner, of those without a view, that would be there first; nothing when none can go
  // there.
  std::optional<size_t> BestScanner(size_t of, uint32_t view) const;
  // The value of a score in the ranking; below 0 when no scanner can go there.
  double Key(size_t of, uint32_t view, double score) const;
  void Fill(double apart);
  // False when the budget ended before all were fresh.
  bool Refresh(std::span<const Entry> stale, const parallel::Budget& refining);
  void Enqueue(size_t of, uint32_t view);
  // `trying`: the budget for trying views around doubtful ones.
  Fate Judge(const Entry& entry, const parallel::Budget& trying, ChosenView& chosen);
  // True when a refusal of this round stands for the view.
  bool RuledOut(size_t of, uint32_t view) const;
  // The doubtful refusals instead of which the view is tried; nothing when it must not be tried.
  std::optional<std::vector<Refusal*>> TriedInsteadOf(const Entry& entry,
                                                      const parallel::Budget& trying);
  void Refuse(const ChosenView& view, std::span<Refusal* const> instead_of);
  void NoteExactness(const ChosenView& chosen);
  bool NearListed(size_t of, uint32_t view, double apart) const;
  // The best of those that were found to register, where no more can be judged.
  std::optional<Entry> BestJudged(double apart) const;
  void List(const Entry& entry, const ChosenView& chosen);
  // From a view to the nearest station of which there is a scan, m: what others will have seen is a
  // guess.
  double Away(size_t of, uint32_t view) const;
  // Removes views from the front of the queue that are not fresh, at most a batch.
  std::vector<Entry> StaleTop(const parallel::Budget& refining);
  // A share of the budget that is left, divided evenly among the scanners without a view.
  parallel::Budget Share(double share) const;

  std::vector<ScannerClass>& classes_;
  std::vector<ClassedMember>& members_;
  RemainingGain& remaining_;
  const FleetRanking ranking_;
  const planning::PlanningConfig& config_;
  parallel::Budget budget_;
  parallel::Parallel& parallel_;
  std::vector<Eigen::Vector3d> taken_;   // tripods that stand or will stand there
  const size_t given_;                   // the first of taken_, which were not chosen here
  std::vector<Eigen::Vector3d> listed_;  // returned since the last Commit()
  std::vector<bool> assigned_;
  std::vector<std::optional<double>> done_after_;  // minutes, by step of what remains
  std::priority_queue<Entry> queue_;
  std::map<std::pair<size_t, uint32_t>, ChosenView> judged_;  // judged in this round
  std::vector<ChosenView> refused_;
  std::vector<Refusal> refusals_;                    // in this round
  std::set<std::pair<size_t, uint32_t>> tried_out_;  // around doubtful ones, in this round
  NearFirst near_first_;                             // in this round
  GreedyRecord record_;
  bool crowded_out_ = false;
  size_t checked_ = 0;
  size_t tried_ = 0;  // of the checked views, those around doubtful ones
  uint64_t rays_ = 0;
  uint64_t checking_until_ = 0;  // rays
};

}  // namespace vantage::fleet

#endif  // VANTAGE_CORE_FLEET_JOINT_CHOICE_H_

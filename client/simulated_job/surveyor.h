// A surveyor with a simulated scanner: sets it up, scans, pushes the scan, measures the pose again
// when a scan does not align, and asks where to go next.
#ifndef VANTAGE_CLIENT_SIMULATED_JOB_SURVEYOR_H_
#define VANTAGE_CLIENT_SIMULATED_JOB_SURVEYOR_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/library/client.h"
#include "client/simulated_job/placement.h"
#include "client/simulated_job/scene_prior.h"
#include "client/simulated_job/site.h"
#include "core/parallel/parallel.h"
#include "core/sensor/scanner_model.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::simulated_job {

// The rule by which a view of a plan is taken.
enum class ViewChoice {
  kRegistrable,  // the best that will register, as the plan says
  kOverlap,      // the best whose overlap suffices, whatever its shape: the usual rule
  kBest,         // the best, registrable or not
};

struct JobOptions {
  std::string session_id;  // empty: the server chooses
  sensor::ScannerModel scanner;
  std::string preset;  // that `scanner` is of, and its setting; empty: none
  std::string setting;
  double preview = 0;  // rad between the rays of scans, which stand for native ones; 0: all
  simulation::ScanFaults faults;
  double required_density = 2500;             // samples / m^2
  int max_scans = 10;                         // made, lost ones included
  uint64_t seed = 1;                          // of noise, positioning and planning
  double plan_seconds = 1.0;                  // time budget of a plan, s
  std::optional<uint64_t> plan_work;          // rays instead of time: repeatable
  double heading_error = sensor::Radians(5);  // one sigma of the prior's heading, rad
  double tilt = sensor::Radians(0.5);         // one sigma of the tripod's roll and pitch, rad
  // m, how well the priors know the position, one sigma, and say so; nothing: they are guesses.
  std::optional<double> prior_sigma;
  size_t truth_samples = 40'000;      // points on the mesh that coverage is measured on
  bool full_plans = false;            // with the map of scores
  v1::PlanningConfig plan_overrides;  // for every plan
  ViewChoice choice = ViewChoice::kRegistrable;
  // Before a scan that does not seem worth it, a plan of so many rays is asked whether any is: one
  // that is short of time cannot rule out what it did not look at. 0: the plans are taken as they
  // are.
  uint64_t last_plan_work = 0;
  // s, of a tour that is made anew before every plan, which follows it; nothing: there is no tour.
  std::optional<double> tour_seconds;
  bool heed_termination = true;  // false: goes on as long as there are views
  // Of the site, sent after the first scan; its verdicts are among the notes. Nothing: none.
  std::optional<ScenePriorKind> site_prior;
  double enough = 2;  // ends at this share of what is attainable at density; 2: never
  // Scans that are made before the data of one reach the server, which hears of its station at
  // once; 0: none, each is sent when it is made. The first never waits: it says where the world is.
  int late = 0;
};

// A scan and its outcome.
struct MadeScan {
  int number = 0;                                              // of the scan, from 1
  Eigen::Vector3d planned = Eigen::Vector3d::Zero();           // m, world: where it was meant to be
  Eigen::Vector3d planned_in_scene = Eigen::Vector3d::Zero();  // m, scene frame: the same place
  Eigen::Vector3d at = Eigen::Vector3d::Zero();                // m, scene frame: where it was made
  std::optional<double> facing;  // rad, scene frame: of a scanner that sees a sector
  v1::Scan scan;
  Eigen::Isometry3d T_scene_world = Eigen::Isometry3d::Identity();
  bool merged = false;
  bool second_prior = false;  // a better prior was needed
  double off_metres = 0;      // pose in the model against the truth
  double send_seconds = 0;
  std::vector<std::string> notes;  // notes of the surveyor
};

// A plan, and the effort of getting it.
struct PlanMade {
  v1::Plan plan;
  double budget = 0;   // s, of the attempt that gave it; 0 where work was limited instead
  int attempts = 0;    // with twice the budget each
  double seconds = 0;  // of all attempts
};

class Surveyor {
 public:
  // All but the options must outlive it.
  Surveyor(client::Client& client, const Site& site, const simulation::SimulatedScanner& scanner,
           const JobOptions& options, parallel::Parallel& parallel);

  // Is called with what comes next, for a progress line.
  void OnActivity(std::function<void(const std::string&)> say) { say_ = std::move(say); }

  // Creates the session.
  absl::Status Open();
  const std::string& session() const { return session_; }  // resource name

  // The placement of the first scan, and of a later scan that is meant to be at `planned` (m,
  // world) and to face `heading` (rad, world), where that is given.
  Placement First() const;
  Placement At(const Eigen::Vector3d& planned, int number,
               std::optional<double> heading = std::nullopt) const;

  // Scans, pushes the scan and waits until it is decided. A scan that does not align gets a
  // measured prior; when that does not help, the scan is withdrawn and its place rejected. `by`:
  // the fleet's scanner, by resource name, or empty. INTERNAL: the first scan was not merged.
  absl::StatusOr<MadeScan> Make(const Placement& placement, int number, const std::string& by);

  // Tells the server that a scan was made whose data come later; the station's name.
  absl::StatusOr<std::string> Announce(const Placement& placement);
  // Nothing will come from a station any more.
  absl::Status Forget(const std::string& station);

  // Plans, and waits until the plan has ended. Where the budget was too small, it is doubled for
  // this plan only.
  // `work`: rays, instead of what the options allow.
  absl::StatusOr<PlanMade> Plan(const std::vector<std::string>& scanners, v1::Ranking ranking,
                                std::optional<uint64_t> work = std::nullopt);

  // The view nearest to a station among those that a plan refused, since most remedies ask to stay
  // near. Null when there is none.
  const v1::RankedView* NearestRefused(const v1::PlanResult& plan) const;

  // Of a place that is expected and not known, the free spot of the room behind the doorway that is
  // nearest to it; the placement itself where there is none.
  Placement NearestFree(const Placement& placement, int number, const v1::ExpectedStation& expected,
                        std::optional<double> heading) const;

  // Rejects a place on the server if nobody can stand there; does nothing when the place is free.
  absl::StatusOr<bool> IsBlocked(const Placement& placement);

  const Eigen::Isometry3d& T_scene_world() const { return T_scene_world_; }

 private:
  // Makes the tour that plans follow, of what is left to do; keeps of the one before what still
  // pays.
  absl::Status MakeTour();
  absl::Status Push(const Placement& placement, const std::string& by, MadeScan& made);
  absl::Status AlignAgain(const Placement& placement, MadeScan& made);
  absl::Status GiveUpOn(MadeScan& made);
  absl::Status SendSitePrior();
  absl::Status Reject(const Eigen::Vector3d& place, double radius, const std::string& reason);

  client::Client& client_;
  const Site& site_;
  const simulation::SimulatedScanner& scanner_;
  const JobOptions options_;
  PlacementErrors errors_;
  parallel::Parallel& parallel_;
  std::function<void(const std::string&)> say_ = [](const std::string&) {};
  std::string session_;
  Eigen::Isometry3d T_scene_world_ = Eigen::Isometry3d::Identity();
  std::vector<Eigen::Vector3d> stations_;  // m, world, of merged scans
  std::vector<v1::Vector3> tour_;          // m, world, stations of the tour that plans follow
};

}  // namespace vantage::simulated_job

#endif  // VANTAGE_CLIENT_SIMULATED_JOB_SURVEYOR_H_

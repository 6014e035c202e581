// A whole job with several simulated scanners, through the public API alone: each scanner plans
// around the others' claims, claims a view, walks there, sets up, scans and pushes the scan. The
// clock is simulated: from event to event, as fast as the server answers.
#ifndef VANTAGE_CLIENT_SIMULATED_JOB_SIMULATED_FLEET_H_
#define VANTAGE_CLIENT_SIMULATED_JOB_SIMULATED_FLEET_H_

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/library/client.h"
#include "client/simulated_job/site.h"
#include "client/simulated_job/surveyor.h"
#include "client/simulated_job/walk_map.h"
#include "core/parallel/parallel.h"
#include "core/simulation/ground_truth.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::simulated_job {

struct FleetOptions {
  JobOptions job;             // `max_scans` of all scanners together; no full plans
  int scanners = 2;           // [1, 64]
  bool claims = true;         // false: no scanner knows where the others go
  double speed = 1;           // m/s
  double scan_seconds = 180;  // to set up and scan
  double target = 0.95;       // of what is attainable at density, where the job ends
};

// A scan of the fleet's, when it is in.
struct FleetStop {
  int order = 0;                        // of coming in, from 1
  int scanner = 0;                      // from 0
  double minutes = 0;                   // simulated, when it is in
  double walked = 0;                    // m, from where the scanner stood before
  double waited = 0;                    // min, at its place for others' scans to come in first
  std::vector<Eigen::Vector2d> way;     // m, scene frame, from there
  std::optional<double> expected_gain;  // m^2 brought to density, by the plan that chose it
  MadeScan made;
  simulation::TrueCoverage truth;  // by the merged scans
};

struct FleetResult {
  std::string session;  // resource name
  int made = 0;         // scans
  int lost = 0;         // of them could not be joined to the model
  int claims_refused = 0;
  double minutes = 0;                    // simulated, until the last scan was in
  std::optional<double> target_minutes;  // when the target was reached; absent: it was not
  double attained = 0;                   // share of what is attainable at density
  // Of the surface that scans measured at density, summed over all merged scans, the share that had
  // been measured at density before.
  double waste = 0;
  std::string why;  // it ended
};

class SimulatedFleet {
 public:
  // The scanners' ids, in the order of their numbers.
  static std::string ScannerId(int scanner);

  // All must outlive the fleet.
  SimulatedFleet(client::Client& client, const Site& site, const FleetOptions& options,
                 parallel::Parallel& parallel);
  ~SimulatedFleet();

  // Is called with what comes next, for a progress line.
  void OnActivity(std::function<void(const std::string&)> say) {
    surveyor_.OnActivity(std::move(say));
  }

  // Runs the job; `on_stop` is called for every scan once it is decided. An error is a fault; a job
  // that ends early for a reason gives the reason in its result.
  absl::StatusOr<FleetResult> Run(absl::FunctionRef<absl::Status(const FleetStop&)> on_stop);

 private:
  // A scanner on the way to its next scan.
  struct Errand {
    Placement placement;
    int number = 0;     // of the scan, in the order of setting out
    double done = 0;    // min, when its scan is in
    std::string claim;  // resource name; empty: none
    FleetStop stop;     // what is known beforehand
  };
  struct Member {
    std::string name;                              // resource name
    Eigen::Vector3d at = Eigen::Vector3d::Zero();  // m, scene frame
    double free_since = 0;                         // min
    std::optional<Errand> errand;
  };
  struct Goal {
    Eigen::Vector3d position;  // m, world
    double area = 0;           // m^2 brought to density that it promises
    std::string claim;
    std::vector<std::string> after;               // claims whose scans must be in before
    std::optional<v1::ExpectedStation> expected;  // what is assumed of the place
  };

  absl::Status Open();
  void SetOut(Member& member, const Placement& placement, const Goal& goal, double searched);
  absl::StatusOr<FleetStop> Finish(Member& member);
  absl::Status SendOut(Member& member);
  absl::Status SendOutIdle();
  absl::StatusOr<std::optional<Goal>> ChooseGoal(const Member& member);
  absl::StatusOr<bool> Claim(const Member& member, const v1::Plan& plan, Goal& goal);
  absl::Status EndClaim(const std::string& claim, bool arrived);
  bool SomebodyIsOut() const;

  client::Client& client_;
  const Site& site_;
  const FleetOptions options_;
  parallel::Parallel& parallel_;
  const simulation::SimulatedScanner scanner_;
  const WalkMap walks_;
  simulation::GroundTruth truth_;
  Surveyor surveyor_;
  std::vector<Member> members_;
  FleetResult result_;
  int set_out_ = 0;      // scans, made or under way
  double now_ = 0;       // min
  size_t measured_ = 0;  // samples of the truth measured at density, over all merged scans
};

}  // namespace vantage::simulated_job

#endif  // VANTAGE_CLIENT_SIMULATED_JOB_SIMULATED_FLEET_H_

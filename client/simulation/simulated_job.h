// A whole job with a simulated scanner: scan, push, plan, move, until the planner suggests to stop.
// It knows the truth and the server does not: everything goes through the public API as a surveyor
// and a real scanner would use it.
#ifndef VANTAGE_CLIENT_SIMULATION_SIMULATED_JOB_H_
#define VANTAGE_CLIENT_SIMULATION_SIMULATED_JOB_H_

#include <Eigen/Geometry>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/library/client.h"
#include "client/simulation/placement.h"
#include "client/simulation/site.h"
#include "core/parallel/parallel.h"
#include "core/sensor/scanner_model.h"
#include "core/simulation/ground_truth.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage {

// Which of a plan's views is taken.
enum class ViewChoice {
  kRegistrable,  // the best that will register, as the plan says
  kOverlap,      // the best whose overlap suffices, whatever its shape: the usual rule
  kBest,         // the best, registrable or not
};

struct JobOptions {
  std::string session_id;  // empty: the server chooses
  ScannerModel scanner;
  ScanFaults faults;
  double required_density = 2500;     // samples / m^2
  int max_scans = 10;                 // made, lost ones included
  uint64_t seed = 1;                  // of noise, positioning and planning
  double plan_seconds = 1.0;          // time budget of a plan, s
  std::optional<uint64_t> plan_work;  // rays instead of time: repeatable
  double heading_error = Radians(5);  // one sigma of the prior's heading, rad
  double tilt = Radians(0.5);         // one sigma of the tripod's roll and pitch, rad
  size_t truth_samples = 40'000;      // points on the mesh that coverage is measured on
  bool full_plans = false;            // with the map of scores
  v1::PlanningConfig plan_overrides;  // for every plan
  ViewChoice choice = ViewChoice::kRegistrable;
  bool heed_termination = true;  // false: goes on as long as there are views
  double enough = 2;             // ends at this share of what is attainable at density; 2: never
};

// What became of one scan and what was planned after it.
struct Cycle {
  int number = 0;                                              // of the scan, from 1
  Eigen::Vector3d planned = Eigen::Vector3d::Zero();           // m, world: where it was meant to be
  Eigen::Vector3d planned_in_scene = Eigen::Vector3d::Zero();  // m, scene frame: the same place
  Eigen::Vector3d at = Eigen::Vector3d::Zero();                // m, scene frame: where it was made
  std::optional<double> predicted_area;  // m^2 brought to density, by the plan that chose it
  v1::Scan scan;
  Eigen::Isometry3d T_scene_world = Eigen::Isometry3d::Identity();
  bool merged = false;
  bool second_prior = false;  // it took a better prior
  double off_metres = 0;      // pose in the model against the truth
  double off_degrees = 0;
  TrueCoverage truth;  // by the merged scans
  v1::Plan plan;       // made afterwards
  double send_seconds = 0;
  std::vector<std::string> notes;  // what a surveyor would write down
};

struct JobResult {
  std::string session;  // resource name
  int made = 0;         // scans
  int lost = 0;         // of them could not be joined to the model
  bool planner_stopped = false;
  int stop_suggested_after = 0;  // scans, where planner_stopped
  std::string why;               // it ended
};

class SimulatedJob {
 public:
  // All must outlive the job.
  SimulatedJob(Client& client, const Site& site, const JobOptions& options, Parallel& parallel);
  // With a scanner in the site's mesh and its ground truth, which is copied, made beforehand.
  SimulatedJob(Client& client, const Site& site, const JobOptions& options,
               const SimulatedScanner& scanner, const GroundTruth& truth, Parallel& parallel);
  ~SimulatedJob();

  // Says what it is about to do, for a progress line.
  void OnActivity(std::function<void(const std::string&)> say) { say_ = std::move(say); }

  // Runs the job; `on_cycle` hears of every scan once it is decided and planned after. An error is
  // a fault; a job that ends early for a reason says so in its result.
  absl::StatusOr<JobResult> Run(absl::FunctionRef<absl::Status(const Cycle&)> on_cycle);

 private:
  struct Next {
    Eigen::Vector3d position;  // m, world
    double area = 0;           // m^2 brought to density that it promises
  };

  SimulatedJob(Client& client, const Site& site, const JobOptions& options,
               std::unique_ptr<const SimulatedScanner> scanner, Parallel& parallel);
  absl::Status Open();
  absl::StatusOr<Cycle> MakeScan(const Placement& placement, int number);
  absl::Status AlignAgain(const Placement& placement, Cycle& cycle);
  absl::Status GiveUpOn(Cycle& cycle);
  absl::Status Reject(const Eigen::Vector3d& place, double radius, const std::string& reason);
  absl::StatusOr<v1::Plan> PlanNext();
  std::optional<Next> NextPosition(const v1::Plan& plan, JobResult& result,
                                   std::vector<std::string>& notes);

  Client& client_;
  const Site& site_;
  JobOptions options_;
  PlacementErrors errors_;
  Parallel& parallel_;
  std::function<void(const std::string&)> say_ = [](const std::string&) {};
  std::unique_ptr<const SimulatedScanner> own_scanner_;
  const SimulatedScanner& scanner_;
  GroundTruth truth_;
  std::string session_;
  Eigen::Isometry3d T_scene_world_ = Eigen::Isometry3d::Identity();
  std::vector<Eigen::Vector3d> stands_;  // m, world, of merged scans
  double plan_seconds_;
};

}  // namespace vantage

#endif  // VANTAGE_CLIENT_SIMULATION_SIMULATED_JOB_H_

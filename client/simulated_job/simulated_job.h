// A whole job with a simulated scanner: scan, push, plan, move, until the planner suggests to stop.
// It knows the truth and the server does not: it uses only the public API, as a surveyor with a
// real scanner would.
#ifndef VANTAGE_CLIENT_SIMULATED_JOB_SIMULATED_JOB_H_
#define VANTAGE_CLIENT_SIMULATED_JOB_SIMULATED_JOB_H_

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
#include "client/simulated_job/site.h"
#include "client/simulated_job/surveyor.h"
#include "core/parallel/parallel.h"
#include "core/simulation/ground_truth.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::simulated_job {

// A place that was expected and not known, and that the surveyor went to.
struct TriedPlace {
  double chance = 0;  // that it works, as the plan states it
  bool free = false;  // it was, or a spot nearby that is as good
};

// What a plan says of a scan from one of its views.
struct Promise {
  double expected_gain = 0;     // m^2 brought to density
  double model_gain = 0;        // m^2, the part of it that the model holds
  double overlap = 0;           // share of its samples that are of surface which is known
  double lower = 0;             // m^2: the scan brings from this
  double upper = 0;             // to this in four cases of five
  v1::BySurfaceKind by_kind;    // m^2, splits model_gain
  double expected_surface = 0;  // m^2, the part of expected_gain that is expected and not known
};

// Nothing where the plan had no time left to say.
std::optional<Promise> PromiseOf(const v1::RankedView& view);

// The outcome of one scan, and the plan that was made after it.
struct Cycle : MadeScan {
  std::optional<Promise> promised;  // by the plan that chose it
  simulation::TrueCoverage truth;   // by the merged scans
  v1::Plan plan;                    // made afterwards
  // The effort of choosing the next place.
  double plan_budget = 0;         // s, of `plan`; 0 where work was limited instead
  int plan_attempts = 0;          // of `plan`, with twice the budget each
  double plan_seconds = 0;        // of all attempts, and of plans whose places were blocked
  std::vector<TriedPlace> tried;  // expected places gone to for the next scan, in order
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
  SimulatedJob(client::Client& client, const Site& site, const JobOptions& options,
               parallel::Parallel& parallel);
  // Takes a scanner in the site's mesh and its ground truth, which is copied; both were made
  // beforehand.
  SimulatedJob(client::Client& client, const Site& site, const JobOptions& options,
               const simulation::SimulatedScanner& scanner, const simulation::GroundTruth& truth,
               parallel::Parallel& parallel);
  ~SimulatedJob();

  // Is called with what comes next, for a progress line.
  void OnActivity(std::function<void(const std::string&)> say) {
    surveyor_.OnActivity(std::move(say));
  }

  // Runs the job; `on_cycle` is called for every scan once it is decided and the plan after it is
  // made. An error is a fault; a job that ends early for a reason gives the reason in its result.
  absl::StatusOr<JobResult> Run(absl::FunctionRef<absl::Status(const Cycle&)> on_cycle);

  // The session's resource name; empty until it is created. Valid after a fault, too, for cleaning
  // up.
  const std::string& session() const { return surveyor_.session(); }

 private:
  struct Next {
    Eigen::Vector3d position;  // m, world
    std::optional<Promise> promised;
    std::optional<double> heading;                // rad, world; of a scanner that sees a sector
    std::optional<v1::ExpectedStation> expected;  // what is assumed of the place
    Placement placement;                          // there
  };

  // A scan that was made, whose data are on their way.
  struct OnItsWay {
    Placement placement;
    int number = 0;
    std::optional<Promise> promised;  // by the plan that chose it
    std::vector<std::string> notes;
    std::string station;  // by which the server knows of it; empty: it does not
  };
  // Plans until there is a next place where somebody can stand, into `cycle`; nothing, with the
  // reason in `result`, when the job ends.
  // `more_comes`: the data of some scans are on their way.
  absl::StatusOr<std::optional<Next>> FindNext(int number, bool more_comes, Cycle& cycle,
                                               JobResult& result, std::vector<std::string>& notes);
  // Its data reach the server.
  absl::StatusOr<Cycle> Deliver(const OnItsWay& scan, JobResult& result);

  SimulatedJob(client::Client& client, const Site& site, const JobOptions& options,
               std::unique_ptr<const simulation::SimulatedScanner> scanner,
               parallel::Parallel& parallel);
  static Next NextAt(const v1::RankedView& view);
  std::optional<Next> NextPosition(const v1::Plan& plan, bool more_comes, JobResult& result,
                                   std::vector<std::string>& notes);

  const Site& site_;
  const JobOptions options_;
  parallel::Parallel& parallel_;
  std::unique_ptr<const simulation::SimulatedScanner> own_scanner_;
  simulation::GroundTruth truth_;
  Surveyor surveyor_;
};

}  // namespace vantage::simulated_job

#endif  // VANTAGE_CLIENT_SIMULATED_JOB_SIMULATED_JOB_H_

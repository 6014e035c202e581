#include "client/simulated_job/oracle_route.h"

#include <algorithm>
#include <vector>

#include "client/simulated_job/attainable.h"
#include "client/simulated_job/placement.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::simulated_job {
namespace {

constexpr double kNothingLeft = 0.05;  // m^2: less than a scan's worth by far

}  // namespace

absl::Status FollowOracle(const Site& site, const JobOptions& options, parallel::Parallel& parallel,
                          absl::FunctionRef<void(const OracleScan&)> on_scan) {
  const simulation::SimulatedScanner tracer(site.mesh);
  const std::vector<Eigen::Vector3d> positions = AllowedPositions(tracer, site, options.scanner);
  simulation::GroundTruth truth(site.mesh, tracer, options.scanner, options.required_density,
                                positions, options.truth_samples, parallel);
  if (absl::Status can = CheckAttainable(truth.Measure(), site, options.required_density);
      !can.ok()) {
    return can;
  }
  OracleScan scan;
  scan.at = site.start;
  while (scan.number < options.max_scans) {
    const double before = scan.truth.at_density_area;
    ++scan.number;
    truth.AddScan(scan.at, parallel);
    scan.truth = truth.Measure();
    scan.gain = scan.truth.at_density_area - before;
    on_scan(scan);
    const std::vector<double> gains = truth.GainAtDensity(positions, parallel);
    const auto best = std::max_element(gains.begin(), gains.end());
    if (best == gains.end() || *best < kNothingLeft) break;
    scan.at = positions[static_cast<size_t>(best - gains.begin())];
  }
  return absl::OkStatus();
}

}  // namespace vantage::simulated_job

#include "client/simulated_job/attainable.h"

#include "absl/strings/str_format.h"
#include "client/library/error.h"

namespace vantage::simulated_job {

absl::Status CheckAttainable(const simulation::TrueCoverage& coverage, const Site& site,
                             double required_density) {
  if (!(coverage.attainable_area > 0)) {
    return client::WithFix(
        absl::InvalidArgumentError(absl::StrFormat(
            "no place where the scanner can stand is reached from the start (%.2f, %.2f, %.2f), so "
            "there is nothing to attain: it is outside the rooms, too near to something, or not "
            "over their floor",
            site.start.x(), site.start.y(), site.start.z())),
        "name a free place inside with --start x,y,z, or leave --start out");
  }
  if (!(coverage.attainable_at_density_area > 0)) {
    return client::WithFix(
        absl::InvalidArgumentError(absl::StrFormat(
            "from nowhere does the scanner measure anything with %.0f samples/m\u00b2",
            required_density)),
        "ask for less with --density, or scan in finer steps with --step or --setting");
  }
  return absl::OkStatus();
}

}  // namespace vantage::simulated_job

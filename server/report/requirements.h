// What was required by region, what was reached, and whether that is enough.
#ifndef VANTAGE_SERVER_REPORT_REQUIREMENTS_H_
#define VANTAGE_SERVER_REPORT_REQUIREMENTS_H_

#include <optional>
#include <string>
#include <vector>

#include "server/report/job_record.h"
#include "vantage/v1/coverage.pb.h"

namespace vantage::report {

// A level of accuracy of the U.S. Institute of Building Documentation (USIBD, Level of Accuracy
// Specification Guide): by the length that errors are within at 95 %.
struct AccuracyLevel {
  const char* name;
  double most;  // m
};
// The finest level whose band holds it, or nothing where it is larger than that of any.
std::optional<AccuracyLevel> LevelOf(double bound);

// A region, or the whole job.
struct RegionStanding {
  std::string name;      // empty: the whole job
  bool required = true;  // false: nothing is required of it
  double density = 0;    // D, samples / m2
  v1::BySurfaceKind area;
  double area_at_density = 0;  // m2
  double area_given_up = 0;
  double area_out_of_reach = 0;
  std::optional<double> coverage;    // [0, 1]
  std::optional<double> accuracy;    // m at 95 %; nothing where it is not known
  double area_without_accuracy = 0;  // m2
  bool complete = false;
  bool accurate = false;

  bool met() const { return !required || (complete && accurate); }
};

struct Standing {
  double required_accuracy = 0;  // m at 95 %
  double required_coverage = 0;  // [0, 1]
  // The session's regions in their order, then the whole job.
  std::vector<RegionStanding> regions;
};

// It takes a look at every surface voxel.
Standing MeasureStanding(const JobRecord& job, double required_coverage);

// Covariances of the poses as they are now, by scan: of those that hang together. Nothing for
// others.
std::optional<Eigen::Matrix<double, 6, 6>> CovarianceOf(const JobRecord& job,
                                                        const std::string& scan);

}  // namespace vantage::report

#endif  // VANTAGE_SERVER_REPORT_REQUIREMENTS_H_

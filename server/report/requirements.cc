#include "server/report/requirements.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/registration/graph/surface_accuracy.h"
#include "server/contract/error.h"
#include "server/conversion/from_proto.h"
#include "server/conversion/to_proto.h"

namespace vantage::report {
namespace {

// The upper ends of the bands: LOA50 to 1 mm, LOA40 1 to 5 mm, LOA30 5 to 15 mm, LOA20 15 to 50 mm,
// LOA10 5 to 15 cm.
constexpr std::array<AccuracyLevel, 5> kLevels = {
    {{"LOA50", 0.001}, {"LOA40", 0.005}, {"LOA30", 0.015}, {"LOA20", 0.050}, {"LOA10", 0.150}}};

// Of the whole job, or of a region, which have the same figures.
template <typename Coverage>
RegionStanding StandingOf(const Coverage& coverage) {
  RegionStanding standing;
  standing.density = coverage.required_density_per_m2();
  standing.area = coverage.area_by_kind_m2();
  standing.area_at_density = coverage.area_at_density_m2();
  standing.area_given_up = coverage.area_given_up_m2();
  standing.area_out_of_reach = coverage.area_out_of_reach_m2();
  if (coverage.has_estimated_coverage()) standing.coverage = coverage.estimated_coverage();
  return standing;
}

// What an instrument adds to a point along its ray: its data sheet, and by how much its scans lie
// farther apart from what was there before than that explains.
struct InstrumentNoise {
  sensor::ScannerModel scanner;
  double beyond = 0;  // m2

  double Variance(double range) const {
    const double sigma = scanner.RangeSigma(range);
    return sigma * sigma + beyond;
  }
};

InstrumentNoise NoiseOf(const JobRecord& job, const v1::ScannerModel& scanner) {
  contract::Violations none;  // it was checked when it came
  InstrumentNoise noise;
  noise.scanner = conversion::ReadScannerModel(scanner, "scanner_model", none);
  double squares = 0;
  double pairs = 0;
  for (const v1::Scan& scan : job.scans) {
    if (scan.state() != v1::SCAN_STATE_MERGED || !scan.has_registration() ||
        !SameScanner(scan.scanner_model(), scanner)) {
      continue;
    }
    const v1::Registration& aligned = scan.registration();
    const auto count = static_cast<double>(aligned.correspondence_count());
    squares +=
        count * std::max(0.0, aligned.rms_residual_m() * aligned.rms_residual_m() -
                                  aligned.expected_residual_m() * aligned.expected_residual_m());
    pairs += count;
  }
  const double correlated = job.config.registration.correlated_sigma;
  noise.beyond = correlated * correlated + (pairs > 0 ? squares / pairs : 0);
  return noise;
}

// Sets the accuracy of each region, and of all.
void AddAccuracy(const JobRecord& job, std::vector<RegionStanding>& regions) {
  std::vector<registration::KnownStation> stations;
  std::vector<InstrumentNoise> noises;
  for (const v1::Scan& scan : job.scans) {
    if (scan.state() != v1::SCAN_STATE_MERGED) continue;
    registration::KnownStation station;
    station.position = conversion::ReadOwnVector(scan.pose().translation()) - job.origin;
    station.covariance = CovarianceOf(job, scan.name());
    station.range_max = scan.scanner_model().max_range_m();
    stations.push_back(station);
    noises.push_back(NoiseOf(job, scan.scanner_model()));
  }
  const size_t elsewhere = job.config.regions.size();
  const auto accuracy = registration::MeasureSurfaceAccuracy(
      *job.view, stations,
      [&](size_t station, double range) { return noises[station].Variance(range); }, elsewhere + 1,
      [&](const Eigen::Vector3d& place) -> std::optional<size_t> {
        const std::optional<planning::Requirement> required = job.config.RequiredAt(place);
        if (!required.has_value()) return std::nullopt;
        return required->region.value_or(elsewhere);
      });
  if (!accuracy.has_value()) return;
  for (size_t i = 0; i + 1 < regions.size() && i < elsewhere; ++i) {
    regions[i].accuracy = accuracy->groups[i].bound;
    regions[i].area_without_accuracy = accuracy->groups[i].area_unknown;
  }
  regions.back().accuracy = accuracy->all.bound;
  regions.back().area_without_accuracy = accuracy->all.area_unknown;
}

}  // namespace

std::optional<AccuracyLevel> LevelOf(double bound) {
  for (const AccuracyLevel& level : kLevels) {
    if (bound <= level.most) return level;
  }
  return std::nullopt;
}

std::optional<Eigen::Matrix<double, 6, 6>> CovarianceOf(const JobRecord& job,
                                                        const std::string& scan) {
  for (const v1::LinkedScan& linked : job.graph.scans()) {
    if (linked.scan() != scan) continue;
    // Others are known with respect to this one; pieces that nothing ties have one each, and only
    // that of the first is the job's.
    if (linked.held()) {
      return linked.piece_index() == 0
                 ? std::optional(Eigen::Matrix<double, 6, 6>(Eigen::Matrix<double, 6, 6>::Zero()))
                 : std::nullopt;
    }
    if (linked.piece_index() != 0 || linked.covariance_size() != 36) return std::nullopt;
    Eigen::Matrix<double, 6, 6> covariance;
    for (int i = 0; i < 36; ++i) covariance(i / 6, i % 6) = linked.covariance(i);
    return covariance;
  }
  return std::nullopt;
}

Standing MeasureStanding(const JobRecord& job, double required_coverage) {
  Standing standing;
  standing.required_coverage = required_coverage;
  standing.required_accuracy = job.session.planning_config().registration().required_accuracy_m();
  const v1::Coverage& coverage = job.coverage.coverage();
  for (const v1::RegionCoverage& region : coverage.regions()) {
    standing.regions.push_back(StandingOf(region));
    standing.regions.back().name = region.name();
    for (const v1::RequiredRegion& rule : job.session.site_rules().regions()) {
      if (rule.name() == region.name() && rule.has_weight() && rule.weight() == 0) {
        standing.regions.back().required = false;
      }
    }
  }
  standing.regions.push_back(StandingOf(coverage));
  if (job.view != nullptr) AddAccuracy(job, standing.regions);
  for (RegionStanding& region : standing.regions) {
    region.complete = region.coverage.has_value() && *region.coverage >= required_coverage;
    // Where more than a thousandth of the surface has no figure, the figure is not that of the
    // region.
    const double measured = region.area.true_surface();
    region.accurate = region.accuracy.has_value() &&
                      *region.accuracy <= standing.required_accuracy &&
                      region.area_without_accuracy <= 1e-3 * measured;
  }
  return standing;
}

}  // namespace vantage::report

// Measures how complete a model is (algorithm.md section 7F).
#ifndef VANTAGE_CORE_PLANNING_OPENINGS_MEASURE_COVERAGE_H_
#define VANTAGE_CORE_PLANNING_OPENINGS_MEASURE_COVERAGE_H_

#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/planning/feasibility/floor_map.h"
#include "core/planning/plan/coverage.h"
#include "core/planning/plan/opening.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/plan/storey.h"
#include "core/sensor/scanner_model.h"

namespace vantage::planning {

// Measures how complete the model is for these scanners, whose floor and openings these are.
// CANCELLED when that was requested on the way.
absl::StatusOr<Coverage> MeasureCoverage(const model::PlanningView& model,
                                         std::span<const sensor::ScannerModel> scanners,
                                         const PlanningConfig& config, const FloorMap& floor,
                                         Openings openings,
                                         const parallel::Cancellation& cancelled = {});

struct CoveredSite {
  Coverage coverage;
  std::vector<Storey> storeys;  // from the lowest up, with the names that config gives them
};
// The same, without planning: finds floor and openings first. RESOURCE_EXHAUSTED where the columns
// of the model's box would take more than config.memory_limit.
absl::StatusOr<CoveredSite> MeasureSite(const model::PlanningView& model,
                                        std::span<const sensor::ScannerModel> scanners,
                                        const PlanningConfig& config,
                                        const parallel::Cancellation& cancelled = {});
// The coverage of that.
absl::StatusOr<Coverage> MeasureCoverage(const model::PlanningView& model,
                                         std::span<const sensor::ScannerModel> scanners,
                                         const PlanningConfig& config,
                                         const parallel::Cancellation& cancelled = {});

// Surface that counts and has the density that is required of it, m^2 (Coverage::area_at_density):
// what a scan adds to it, it has obtained. Takes a look at every surface voxel.
double AreaAtDensity(const model::PlanningView& model, const PlanningConfig& config);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_OPENINGS_MEASURE_COVERAGE_H_

// How complete a model is.
#ifndef VANTAGE_CORE_PLANNING_PLAN_COVERAGE_H_
#define VANTAGE_CORE_PLANNING_PLAN_COVERAGE_H_

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/model/view/voxel.h"
#include "core/planning/plan/opening.h"

namespace vantage::planning {

// Of some of the surface.
struct CoverageFigures {
  std::array<double, model::kSurfaceKinds> area{};  // m^2 by kind
  double area_at_density = 0;                       // m^2 of true surface with q >= D there
  double area_given_up = 0;                         // m^2
  double area_out_of_reach = 0;                     // m^2 that no scan from known floor brings to D
  // Area at density over all area that is true, false or under-sampled and neither given up nor out
  // of reach, [0, 1]; the planner's estimate. Absent when there is no such area.
  std::optional<double> estimated_coverage;
};

struct RegionCoverage : CoverageFigures {
  std::string name;
  double required_density = 0;  // D in it, samples / m^2
};

// Of all surface that counts, and of what of it lies in each of PlanningConfig::regions, in order.
struct Coverage : CoverageFigures {
  std::vector<RegionCoverage> regions;
  // Where the known space leads on: what lies behind is in no share. Openings::RoomsNotEntered()
  // counts the rooms.
  Openings openings;
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PLAN_COVERAGE_H_

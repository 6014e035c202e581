// A storey of offices to scan.
#ifndef VANTAGE_CORE_SIMULATION_SCENES_OFFICE_STOREY_H_
#define VANTAGE_CORE_SIMULATION_SCENES_OFFICE_STOREY_H_

#include <cstdint>

#include "core/simulation/scenes/scene.h"

namespace vantage::simulation {

// An office storey: corridors with rooms on both sides, `area_m2` in all (100 to 5,000).
Scene OfficeStorey(uint64_t seed, double area_m2);

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_SCENES_OFFICE_STOREY_H_

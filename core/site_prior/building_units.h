// What people draw and measure buildings in.
#ifndef VANTAGE_CORE_SITE_PRIOR_BUILDING_UNITS_H_
#define VANTAGE_CORE_SITE_PRIOR_BUILDING_UNITS_H_

#include <array>

namespace vantage::site_prior {

struct BuildingUnit {
  const char* name;
  double metres;
  int insunits;  // of DXF ($INSUNITS)
};

// The likeliest first.
inline constexpr std::array<BuildingUnit, 5> kBuildingUnits = {
    {{"mm", 0.001, 4}, {"cm", 0.01, 5}, {"in", 0.0254, 1}, {"ft", 0.3048, 2}, {"m", 1, 6}}};

}  // namespace vantage::site_prior

#endif  // VANTAGE_CORE_SITE_PRIOR_BUILDING_UNITS_H_

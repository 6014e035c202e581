#include "core/planning/plan/storey.h"

#include <cmath>

#include "absl/strings/str_cat.h"

namespace vantage::planning {

std::string Storey::Words() const {
  return absl::StrCat("storey ", number, name.empty() ? "" : absl::StrCat(" (", name, ")"));
}

std::string NameOfStorey(double floor_z, std::span<const NamedStorey> named) {
  double nearest = kStoreysApart / 4;
  std::string name;
  for (const NamedStorey& storey : named) {
    const double apart = std::abs(storey.floor_z - floor_z);
    if (!(apart <= nearest)) continue;
    nearest = apart;
    name = storey.name;
  }
  return name;
}

}  // namespace vantage::planning

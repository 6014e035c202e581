// What the importers share.
#ifndef VANTAGE_CORE_SENSOR_IMPORT_INTERNAL_H_
#define VANTAGE_CORE_SENSOR_IMPORT_INTERNAL_H_

#include <cstddef>

#include "absl/status/statusor.h"
#include "core/sensor/gridding.h"
#include "core/sensor/import.h"

namespace vantage {

// Coordinates beyond this are in other units or another frame, m.
inline constexpr double kMaxImportRange = 1000;

// Masks the scanner's body and fits the scanner model.
absl::StatusOr<ImportedScan> FinishImport(GriddedScan gridded, size_t points,
                                          const ImportLimits& limits);

}  // namespace vantage

#endif  // VANTAGE_CORE_SENSOR_IMPORT_INTERNAL_H_

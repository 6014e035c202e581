// Which rays of a scan went into the open sky (algorithm.md section 4, 'The open sky').
#ifndef VANTAGE_CORE_MODEL_SCAN_SKY_H_
#define VANTAGE_CORE_MODEL_SCAN_SKY_H_

#include <Eigen/Core>
#include <vector>

#include "core/model/scan/range_surface.h"
#include "core/sensor/scanner_model.h"

namespace vantage::model {

// A ray that did not come back since there is nothing, or only what it met at a grazing angle.
struct SkyRay {
  int column = 0;
  int row = 0;
  float range = 0;  // m, > 0: space is empty up to there
  // kSky: beyond there is nothing to look for. kHole: a surface that was measured beside the ray
  // may go on there.
  UnknownReason beyond = UnknownReason::kSky;
};

// The distance up to which a ray that does not come back has met nothing, m: half of range_max,
// where the darkest matte surface would just have been seen.
double SkyRange(const sensor::ScannerModel& scanner);

// `up`: unit, scanner's frame. Empty where the scan is not sure to be under the open sky. In order
// of columns, then rows; the same on any number of threads.
std::vector<SkyRay> FindSkyRays(const RangeSurface& surface, const sensor::ScannerModel& scanner,
                                const Eigen::Vector3d& up);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_SCAN_SKY_H_

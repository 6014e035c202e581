#include "core/registration/without_reflections.h"

#include "core/model/partial_model.h"
#include "core/model/range_surface.h"
#include "core/model/reflections.h"

namespace vantage {

std::optional<Scan> WithoutReflections(const Scan& scan, Parallel& parallel) {
  const RangeSurface all(scan.image, scan.scanner, ModelConfig().discontinuity_angle, parallel);
  RangeSurface direct = all;
  if (EndReflections(direct, parallel).empty()) return std::nullopt;
  Scan without = scan;
  for (int c = 0; c < direct.columns(); ++c) {
    for (int r = 0; r < direct.rows(); ++r) {
      if (all.Returned(c, r) && !direct.Returned(c, r)) {
        without.image.range[without.image.Index(c, r)] = RangeImage::kNoInformation;
      }
    }
  }
  return without;
}

}  // namespace vantage

#include "core/registration/align/without_reflections.h"

#include "core/model/reflections/reflections.h"
#include "core/model/scan/range_surface.h"
#include "core/model/view/model_config.h"

namespace vantage::registration {

std::optional<sensor::Scan> WithoutReflections(const sensor::Scan& scan,
                                               parallel::Parallel& parallel) {
  const model::OpenRangeSurface all(scan.image, scan.scanner,
                                    model::ModelConfig().discontinuity_angle, parallel);
  model::OpenRangeSurface direct = all;
  if (model::EndReflections(direct, parallel).empty()) return std::nullopt;
  sensor::Scan without = scan;
  for (int c = 0; c < direct.columns(); ++c) {
    for (int r = 0; r < direct.rows(); ++r) {
      if (all.Returned(c, r) && !direct.Returned(c, r)) {
        without.image.range[without.image.Index(c, r)] = sensor::RangeImage::kNoInformation;
      }
    }
  }
  return without;
}

}  // namespace vantage::registration

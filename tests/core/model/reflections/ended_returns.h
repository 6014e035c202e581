// What ending the reflections of a scan did, cell by cell, against a scan without faults.
#ifndef VANTAGE_TESTS_CORE_MODEL_REFLECTIONS_ENDED_RETURNS_H_
#define VANTAGE_TESTS_CORE_MODEL_REFLECTIONS_ENDED_RETURNS_H_

#include <cstddef>

#include "core/model/scan/range_surface.h"
#include "core/sensor/range_image.h"

namespace vantage::model {

struct EndedReturns {
  size_t reflections = 0;  // cells whose range is well behind the real surface
  size_t missed = 0;       // of these, still returns
  size_t real = 0;         // returns of what is there that are none any more
  size_t returns = 0;      // of what is there
};

// `before` is the scan with its reflections, `after` without; `truth` was made at the same pose
// without faults. `well_behind`, m along a ray: what is nearer to its mirror is no reflection here.
inline EndedReturns CountEndedReturns(const RangeSurface& before, const RangeSurface& after,
                                      const sensor::RangeImage& truth, float well_behind = 0.15F) {
  EndedReturns ended;
  for (int c = 0; c < before.columns(); ++c) {
    for (int r = 0; r < before.rows(); ++r) {
      if (!before.Returned(c, r)) continue;
      const bool reflected = truth.at(c, r) > 0 && before.at(c, r) > truth.at(c, r) + well_behind;
      ended.reflections += reflected ? 1 : 0;
      ended.missed += reflected && after.Returned(c, r) ? 1 : 0;
      ended.real += !reflected && !after.Returned(c, r) ? 1 : 0;
      ended.returns += !reflected ? 1 : 0;
    }
  }
  return ended;
}

}  // namespace vantage::model

#endif  // VANTAGE_TESTS_CORE_MODEL_REFLECTIONS_ENDED_RETURNS_H_

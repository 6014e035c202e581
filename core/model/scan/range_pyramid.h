// Nearest and farthest range over any part of a range image, in a handful of look-ups.
#ifndef VANTAGE_CORE_MODEL_SCAN_RANGE_PYRAMID_H_
#define VANTAGE_CORE_MODEL_SCAN_RANGE_PYRAMID_H_

#include <cstdint>
#include <vector>

#include "core/model/scan/range_surface.h"
#include "core/parallel/parallel.h"

namespace vantage::model {

// A cell that holds no range counts as range 0: nothing is known to be empty along its ray. So
// 'nearer than the minimum' means every ray was seen to go on, and 'farther than the maximum' means
// that none did.
class RangePyramid {
 public:
  RangePyramid(const RangeSurface& surface, parallel::Parallel& parallel);

  struct Bounds {
    float min = 0;
    float max = 0;
  };
  // Over the cells of the given index ranges (inclusive, not empty, not wrapping).
  Bounds Over(int first_column, int last_column, int first_row, int last_row) const;

 private:
  struct Level {
    int columns = 0;
    int rows = 0;
    std::vector<Bounds> bounds;  // column after column
  };
  std::vector<Level> levels_;
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_SCAN_RANGE_PYRAMID_H_

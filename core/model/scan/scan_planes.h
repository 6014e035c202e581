// The large planes that a scan sees: walls, floor, ceiling, table tops.
#ifndef VANTAGE_CORE_MODEL_SCAN_SCAN_PLANES_H_
#define VANTAGE_CORE_MODEL_SCAN_SCAN_PLANES_H_

#include <Eigen/Core>
#include <vector>

#include "core/model/scan/range_surface.h"
#include "core/parallel/parallel.h"

namespace vantage::model {

struct ScanCell {
  int column = 0;
  int row = 0;
};

// normal . x = -distance in the scanner's frame.
struct ScanPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // unit, towards the scanner
  double distance = 0;                                // m, from the scanner, > 0
  double area = 0;                                    // m^2 of it that was measured, roughly
  std::vector<ScanCell> cells;                        // some of the cells on it, in order

  // m, positive on the scanner's side.
  double Above(const Eigen::Vector3d& point) const { return normal.dot(point) + distance; }
};

// At most `most`, the largest first, from a sample of some ten thousand cells. Two scans of the
// same image give the same planes.
std::vector<ScanPlane> FindScanPlanes(const RangeSurface& surface, int most,
                                      parallel::Parallel& parallel);

// The unit normal, towards the scanner, of the surface around a cell over about a decimetre; zero
// where that is not flat.
Eigen::Vector3d NormalAround(const RangeSurface& surface, int column, int row);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_SCAN_SCAN_PLANES_H_

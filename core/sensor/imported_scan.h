// The scan made of the points that an instrument delivers, in any format.
#ifndef VANTAGE_CORE_SENSOR_IMPORTED_SCAN_H_
#define VANTAGE_CORE_SENSOR_IMPORTED_SCAN_H_

#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/sensor/appearance.h"
#include "core/sensor/gridded_scan.h"
#include "core/sensor/range_image.h"
#include "core/sensor/scanner_model.h"

namespace vantage::sensor {

struct ImportedScan {
  RangeImage image;
  // From the file (PTX header, PCD viewpoint); absent when it is the identity.
  std::optional<Eigen::Isometry3d> T_world_scan;
  // A scanner model that fits the image (spans, elevation interval, native steps); range interval,
  // noise and the rest are the defaults.
  ScannerModel scanner;
  size_t points = 0;       // in the file, no-return entries included
  size_t duplicates = 0;   // returns whose cell an earlier one had taken
  size_t far = 0;          // returns beyond kMaxImportRange, which became rays without a return
  bool loose = false;      // made of points without a grid or a station (point_cloud.h)
  double apart = 0;        // of loose points: share far before or behind others in their direction
  bool resampled = false;  // the directions formed no grid (gridded_scan.h): cells are interpolated
  AppearanceKinds appearance;  // that the file has of its points, wanted or not
  bool leaning = false;        // of these, the grid was known and leans
};

struct ImportLimits {
  size_t max_points = 100'000'000;
  // Returns nearer than this are the scanner's own body and become no information, m.
  double range_min = 0.5;
  // No-return cells that are connected to the body's cells within this angle (rad) are its blind
  // zone, not free space, and become no information.
  double blind_zone = Radians(30);
  // m, of the unit in which the file's coordinates are, whatever its format says.
  double unit = 1;
  // What is read of how returns looked, where the file has it.
  AppearanceKinds appearance;
};

// m; farther than any scanner model reaches.
inline constexpr double kMaxImportRange = 1000;

// The returns of a file that lie beyond kMaxImportRange. A few are looks out of a window; when most
// do, the file is in other units or in another frame.
class FarReturns {
 public:
  // `unit`: m, of the file's coordinates.
  explicit FarReturns(double unit) : unit_(unit) {}

  // A return at `point` (in the file's unit, from the centre of projection), which `where` names
  // for people ("PTX line 12"), in m. Nothing where it is one of these, of which it takes note.
  std::optional<Eigen::Vector3f> Near(const Eigen::Vector3d& point,
                                      absl::FunctionRef<std::string()> where);
  size_t count() const { return count_; }
  // INVALID_ARGUMENT, naming the first, when most returns lie so far away.
  absl::Status Check() const;

 private:
  double unit_;
  size_t returns_ = 0;
  size_t count_ = 0;
  std::string first_;
};

// Masks the scanner's body and fits the scanner model. `appearance`: of the points, by the numbers
// that the grid's sources give.
absl::StatusOr<ImportedScan> FinishImport(GriddedScan gridded, size_t points,
                                          const ImportLimits& limits,
                                          const Appearance& appearance = {});

// The same for an image that is one already (encoding.h): it stays to the bit.
ImportedScan ImportImage(RangeImage image, const ImportLimits& limits);

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_IMPORTED_SCAN_H_

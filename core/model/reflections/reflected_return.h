// Compares a return, reflected back at a plane, with what the same scan measured there
// (algorithm.md section 4, 'Reflections').
#ifndef VANTAGE_CORE_MODEL_REFLECTIONS_REFLECTED_RETURN_H_
#define VANTAGE_CORE_MODEL_REFLECTIONS_REFLECTED_RETURN_H_

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/model/scan/range_surface.h"
#include "core/model/scan/scan_planes.h"

namespace vantage::model {

// What a return turns out to be when it is reflected back.
enum class Back : uint8_t {
  kInFront,      // not behind the plane: no reflection
  kAgrees,       // on measured surface
  kHidden,       // where the scan saw nothing
  kContradicts,  // in space that the scan saw empty
};

// normal . x = -distance (m), scanner's frame; unit normal, towards the scanner.
struct ReflectingPlane {
  Eigen::Vector3d normal;
  double distance;
  // Returns farther than this behind the plane, m, may be reflections. Those of its own wall lie
  // nearer: it is even to a centimetre, and four sigma of noise are 4 cm.
  double behind = 0.04;

  static constexpr double kProud = 0.12;  // m that a mirror stands out from its wall
  static constexpr double kFrame = 0.06;  // m that a frame stands out from its mirror
  // m that a wall stands out from a plane in its opening, at least: the rooms of an opening may be
  // mirror images in the middle of their wall. Half of a thin one is 0.04, and a plane 0.015 off.
  static constexpr double kRecess = 0.025;

  double Above(const Eigen::Vector3d& point) const { return normal.dot(point) + distance; }
  // True when the plane lies behind the wall around it, which no mirror does.
  bool IsRecessed(const Eigen::Vector3d& wall) const { return Above(wall) > kRecess; }
  // Reflectors hang on walls, or lie: within 20 degrees, since mirrors lean, and within 18, since
  // the scanner may.
  bool IsUpright() const { return std::abs(normal.z()) < 0.35; }
  bool IsLevel() const { return std::abs(normal.z()) > 0.95; }
  // Where a ray in a direction, of any length, meets it.
  Eigen::Vector3d Crossing(const Eigen::Vector3d& direction) const {
    return direction * (-distance / normal.dot(direction));
  }
  Eigen::Vector3d Reflected(const Eigen::Vector3d& point) const {
    return point - 2 * Above(point) * normal;
  }
};

class ReturnTest {
 public:
  // A return is evidence when it lies farther than this behind the plane, m. The relief of a wall
  // agrees with its own reflection to within twice its depth; so this is more than twice the
  // agreement.
  static constexpr double kWellBehind = 0.15;
  // m between a reflected return and what was measured: a plane may be off by a centimetre, which
  // counts twice, and by half a degree, which does so metres behind it; four sigma of 1 cm besides.
  static constexpr double kAgreement = 0.06;
  // m: a return that agrees, too, when the plane is shifted by half of this, to either side, tells
  // nothing. Five times the agreement, less than furniture is apart.
  static constexpr double kTellingShift = 0.3;

  // Keeps the reference.
  explicit ReturnTest(const RangeSurface& surface) : surface_(surface) {}

  Eigen::Vector3d Point(int column, int row) const {
    return static_cast<double>(surface_.at(column, row)) * surface_.Direction(column, row);
  }

  std::vector<Eigen::Vector3d> Points(const std::vector<ScanCell>& cells) const {
    std::vector<Eigen::Vector3d> points;
    points.reserve(cells.size());
    for (const ScanCell& cell : cells) points.push_back(Point(cell.column, cell.row));
    return points;
  }

  Back Test(const ReflectingPlane& plane, int column, int row) const {
    if (!surface_.Returned(column, row)) return Back::kInFront;
    const Eigen::Vector3d point = Point(column, row);
    if (plane.Above(point) > -plane.behind) return Back::kInFront;
    return Compare(plane.Reflected(point), kAgreement);
  }

  bool WellBehind(const ReflectingPlane& plane, int column, int row) const {
    return plane.Above(Point(column, row)) < -kWellBehind;
  }

  // True when a return that agrees would not agree with a plane a little nearer or farther. A
  // return on a floor or a side wall, which go on for metres, agrees with any plane and tells
  // nothing.
  bool Telling(const ReflectingPlane& plane, int column, int row) const {
    const Eigen::Vector3d back = plane.Reflected(Point(column, row));
    return Compare(back + kTellingShift * plane.normal, kAgreement) != Back::kAgrees ||
           Compare(back - kTellingShift * plane.normal, kAgreement) != Back::kAgrees;
  }

  // A point against what the scan measured in its direction, to within `agreement` (m).
  Back Compare(const Eigen::Vector3d& point, double agreement) const;

 private:
  const RangeSurface& surface_;
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_REFLECTIONS_REFLECTED_RETURN_H_

// Compares a return, reflected back at a plane, with what the same scan measured there
// (algorithm.md section 4, 'Reflections').
#ifndef VANTAGE_CORE_MODEL_REFLECTIONS_REFLECTED_RETURN_H_
#define VANTAGE_CORE_MODEL_REFLECTIONS_REFLECTED_RETURN_H_

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
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
  // m behind it, from where on returns are in question: past its wall, which is not even, and whose
  // returns are noisy. ReturnTest::Behind() says how much that is.
  double behind = kUneven;

  static constexpr double kUneven = 0.04;  // m: plaster, skirtings and what hangs flat on a wall
  // m that a mirror stands out from its wall. One that does, by so little, is told from it at steps
  // up to 0.75 degrees; beyond, samples of wall and mirror are too far apart to show its border.
  static constexpr double kProud = 0.12;
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
  // Keeps the reference.
  explicit ReturnTest(const RangeSurface& surface)
      : surface_(surface),
        sigma_(surface.range_sigma()),
        agreement_(std::max(0.06, 0.02 + 4 * sigma_)) {}

  // The distances below, m, grow with the noise of the scanner (one sigma of a range) from about a
  // centimetre on. Below that they are what mirrors, walls and fits of planes are good for.

  // Between a reflected return and what was measured: a plane may be off by a centimetre, which
  // counts twice, and by half a degree, which does so metres behind it; four sigma besides.
  double Agreement() const { return agreement_; }
  // The same where a plane is straightened: three sigma.
  double Closely() const { return std::max(0.03, 3 * sigma_); }
  // A return is evidence when it lies farther than this behind the plane. The relief of a wall
  // agrees with its own reflection to within twice its depth; so this is more than twice the
  // agreement.
  double WellBehind() const { return 2.5 * agreement_; }
  // A return that agrees, too, when the plane is shifted by half of this, to either side, tells
  // nothing. Up to a noise of 1 cm it is less than furniture is apart.
  double TellingShift() const { return 5 * agreement_; }
  // How far behind a plane returns are in question: past a wall's unevenness, and four sigma.
  double Behind() const { return std::max(ReflectingPlane::kUneven, 4 * sigma_); }

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
    return Compare(plane.Reflected(point), agreement_);
  }

  bool WellBehind(const ReflectingPlane& plane, int column, int row) const {
    return plane.Above(Point(column, row)) < -WellBehind();
  }

  // True when a return that agrees would not agree with a plane a little nearer or farther. A
  // return on a floor or a side wall, which go on for metres, agrees with any plane and tells
  // nothing.
  bool Telling(const ReflectingPlane& plane, int column, int row) const {
    const Eigen::Vector3d back = plane.Reflected(Point(column, row));
    const Eigen::Vector3d shift = TellingShift() * plane.normal;
    return Compare(back + shift, agreement_) != Back::kAgrees ||
           Compare(back - shift, agreement_) != Back::kAgrees;
  }

  // What the scan measured in the direction of a point.
  struct Measured {
    Eigen::Vector3d point;   // m, scanner's frame
    Eigen::Vector3d normal;  // unit, of the surface around it
  };
  std::optional<Measured> MeasuredTowards(const Eigen::Vector3d& point) const;

  // A point against what the scan measured in its direction, to within `agreement` (m).
  Back Compare(const Eigen::Vector3d& point, double agreement) const;

 private:
  const RangeSurface& surface_;
  double sigma_;      // m, of a range
  double agreement_;  // m
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_REFLECTIONS_REFLECTED_RETURN_H_

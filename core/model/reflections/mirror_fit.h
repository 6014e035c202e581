// Fits a plane to returns that may be reflections in it (algorithm.md section 4, 'Reflections').
#ifndef VANTAGE_CORE_MODEL_REFLECTIONS_MIRROR_FIT_H_
#define VANTAGE_CORE_MODEL_REFLECTIONS_MIRROR_FIT_H_

#include <Eigen/Geometry>
#include <cstddef>
#include <span>
#include <vector>

#include "core/model/reflections/aperture.h"
#include "core/model/reflections/reflected_return.h"
#include "core/model/scan/range_surface.h"
#include "core/model/scan/scan_planes.h"

namespace vantage::model {

inline constexpr int kMostPlanes = 16;  // of a scan: six of a room, and as many of its furniture
inline constexpr double kNearestReflector = 0.3;  // m from the scanner: nearer is its own body
inline constexpr size_t kTested = 64;  // cells of a plane to test a candidate: half of them +-6 %
// Numbers of cells of an image: shares, and so the same for any resolution.
inline constexpr double kCoarse = 20'000;  // for a first judgement: 1 to 1.5 degrees apart
// For the second, 0.5 degrees: most there is to tell, at a price.
inline constexpr double kFine = 150'000;

// Every how many-th column and row makes about `cells` of an image.
int StrideOf(const RangeSurface& surface, double cells);

// A scan that may have measured what another one saw in a mirror.
struct MirrorWitness {
  const ReturnTest* measured;
  Eigen::Isometry3d T_witness_scan = Eigen::Isometry3d::Identity();
};

// The number of points behind a plane whose reflections are within `within` (m) of surface that a
// witness measured. Points and plane: scanner's frame.
size_t ComeBack(std::span<const MirrorWitness> witnesses, const ReflectingPlane& plane,
                const std::vector<Eigen::Vector3d>& behind, double within);

// Turns and moves a plane to where most of the points behind it come back to measured surface. A
// mirror leans and hangs a little askew, and a degree at the wall is a foot ten metres behind it.
// The plane is turned about the place where its returns came through.
ReflectingPlane Straighten(std::span<const MirrorWitness> witnesses, const ReflectingPlane& plane,
                           const std::vector<Eigen::Vector3d>& behind);

// From a straightened plane on, by least squares on what one scan measured. The search goes by
// steps, and planes half a degree from a mirror's may bring as many points back to within its
// tolerance; the regions that they show then break up.
ReflectingPlane Fit(const ReturnTest& own, const ReflectingPlane& plane,
                    const std::vector<Eigen::Vector3d>& behind);

// Sets the depth behind which returns are questioned to lie behind the wall on which the mirror
// hangs, since that wall goes on around the mirror and is real. `points` were seen by way of the
// mirror.
void StartPastItsWall(const std::vector<ScanPlane>& planes,
                      const std::vector<Eigen::Vector3d>& points, ReflectingPlane& mirror);

// The part of the plane that the rays of cells cross.
Aperture ApertureOf(const RangeSurface& surface, const ReflectingPlane& plane,
                    const std::vector<ScanCell>& cells);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_REFLECTIONS_MIRROR_FIT_H_

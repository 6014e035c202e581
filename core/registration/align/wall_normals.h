// Which way is up, as a scan's walls have it (algorithm.md section 2).
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_WALL_NORMALS_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_WALL_NORMALS_H_

#include <Eigen/Core>
#include <span>
#include <vector>

#include "core/registration/align/scan_surface.h"

namespace vantage::registration {

// The normals of what may be walls: steep surface, in the frame of the samples, which is level to
// within `max_tilt` rad.
class WallNormals {
 public:
  WallNormals(std::span<const SurfaceSample> samples, double spacing, double max_tilt);

  // Whether there is enough of them, in two directions: parallel walls leave a tilt along them
  // open.
  bool TellUp() const { return tell_up_; }
  // How far they are from vertical in the mean, if `up` (unit) is up, rad. Each counts at most 0.2,
  // so that sloping roofs and furniture are outvoted, not averaged in.
  double Misfit(const Eigen::Vector3d& up) const;
  // The unit vector near `from` at which the misfit is least. There must be TellUp().
  Eigen::Vector3d Up(const Eigen::Vector3d& from) const;

 private:
  std::vector<Eigen::Vector3d> normals_;
  bool tell_up_ = false;
};

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_WALL_NORMALS_H_

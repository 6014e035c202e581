// The relative pose of two scans that overlap, and how well both their surfaces hold it
// (algorithm.md section 9, 'Links').
#ifndef VANTAGE_CORE_REGISTRATION_GRAPH_LINK_H_
#define VANTAGE_CORE_REGISTRATION_GRAPH_LINK_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "core/registration/align/registration_config.h"
#include "core/registration/graph/link_surface.h"
#include "core/registration/graph/pose_graph.h"

namespace vantage::registration {

// A scan where registration, or an adjustment, has put it. Keeps references.
struct PlacedSurface {
  std::string_view id;
  const LinkSurface& surface;
  const Eigen::Isometry3d& T_world_scan;
};

// The evidence of a link, or why there is none.
struct LinkOutcome {
  std::optional<ScanLink> link;  // kSurfaces, a < b
  std::string reason;            // why there is no link, or it is in doubt; else empty
  size_t correspondences = 0;    // patches of b that lie on a's surface
  double overlap_share = 0;  // of b's patches within sight of a: that lie on a's surface, [0, 1]
  double contradiction_share =
      0;                         // of either's patches within the other's sight: that lie in space
                                 // which the other saw to be empty; the larger of both, [0, 1]
  double rms_residual = 0;       // m, point to plane, of the inliers
  double expected_residual = 0;  // m, what the noise explains
  int constrained_directions = 0;  // of six
  double moved = 0;                // m, rms over the overlap: from where the poses had them
};

struct LinkOptions {
  // m, by how far the poses may have what both scans see off each other: drift before a loop
  // closes. Surfaces that repeat themselves nearer than twice that may be taken for each other.
  double reach = 0.15;
  // One sigma, m, that the given poses are good for where the overlap leaves a direction open.
  double open_sigma = 1.0;
  // Where T_a_b is known to begin with; else from the poses.
  std::optional<Eigen::Isometry3d> T_a_b = std::nullopt;
};

// Aligns the surfaces of two scans to each other, point to plane and symmetrically, from where they
// are placed. The answer does not depend on which of them is called a. Takes one thread and some
// milliseconds; thread safe.
LinkOutcome LinkScans(const PlacedSurface& a, const PlacedSurface& b,
                      const RegistrationConfig& config, const LinkOptions& options = {});

// Whether two scans may overlap at all: cheap, to choose pairs with.
bool MayOverlap(const PlacedSurface& a, const PlacedSurface& b);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_GRAPH_LINK_H_

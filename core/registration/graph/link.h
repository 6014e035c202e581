// The relative pose of two scans that overlap, and how well both their surfaces hold it
// (algorithm.md section 9, 'Links').
#ifndef VANTAGE_CORE_REGISTRATION_GRAPH_LINK_H_
#define VANTAGE_CORE_REGISTRATION_GRAPH_LINK_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/parallel/parallel.h"
#include "core/registration/align/registration_config.h"
#include "core/registration/align/scan_surface.h"
#include "core/registration/graph/pose_graph.h"
#include "core/sensor/scan.h"

namespace vantage::registration {

// What is kept of a scan to link it to others.
struct LinkSurface {
  std::vector<SurfaceSample> samples;  // spread; at most kMostLinkSamples
  // For each direction the range up to which the scanner saw nothing (m; 0: no information), in
  // cells of kDepthStep, rows from straight down to straight up, columns by azimuth from -pi.
  std::vector<float> free_range;
  double image_samples = 0;  // of the whole image
  double min_range = 0;      // m, of the scanner
  double noise = 0;          // m, one sigma: median of the samples'

  // What it takes, at most 0.7 MB.
  size_t MemoryBytes() const;
};

// Samples; 32 bytes each. Twice as many tell a pose no better: what is shared within a correlation
// length remains.
inline constexpr size_t kMostLinkSamples = 12000;
inline constexpr double kDepthStep = 0.0175;  // rad, one degree

// Thins a valid scan for its links.
LinkSurface MakeLinkSurface(const sensor::Scan& scan, const RegistrationConfig& config,
                            parallel::Parallel& parallel);
// The same from a surface that registration has thinned (SampleSurface()).
LinkSurface MakeLinkSurface(const ScanSurface& surface, const sensor::Scan& scan);

// A scan where registration, or an adjustment, has put it. Keeps references.
struct PlacedSurface {
  std::string_view id;
  const LinkSurface& surface;
  const Eigen::Isometry3d& T_world_scan;
};

// The evidence of a link, or why there is none.
struct LinkOutcome {
  std::optional<ScanLink> link;  // kSurfaces, not in doubt, a < b
  std::string reason;            // why there is no link; empty when there is
  size_t correspondences = 0;    // samples of either scan that lie on the other's surface
  double overlap_share = 0;      // of what one scan shows within sight of the other, the share that
                                 // both have; the lesser of both, [0, 1]
  double contradiction_share = 0;  // of the samples within the other's sight: in its empty space
  double rms_residual = 0;         // m, point to plane, of the inliers
  double expected_residual = 0;    // m, what the noise explains
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
  std::optional<Eigen::Isometry3d> T_a_b;
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

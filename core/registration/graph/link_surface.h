// What is kept of a scan to link it to others: patches of its surface, and how far it saw
// (algorithm.md section 9, 'Links').
#ifndef VANTAGE_CORE_REGISTRATION_GRAPH_LINK_SURFACE_H_
#define VANTAGE_CORE_REGISTRATION_GRAPH_LINK_SURFACE_H_

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "core/parallel/parallel.h"
#include "core/registration/align/registration_config.h"
#include "core/registration/align/scan_surface.h"
#include "core/sensor/scan.h"

namespace vantage::registration {

// m, side of a patch: its centroid and normal rest on up to sixteen samples 5 cm apart, and what is
// round as a column is still nearly flat in it.
inline constexpr double kPatchSide = 0.2;
// Patches; 32 bytes each. More tell a pose no better: errors that are shared within a correlation
// length remain.
inline constexpr size_t kMostPatches = 12000;
inline constexpr double kDepthStep = 0.017453292519943295;  // rad, one degree

struct LinkSurface {
  // Patches with the mean of their samples as point; spread, so that any prefix is a fair
  // selection; at most kMostPatches.
  std::vector<SurfaceSample> samples;
  // For each direction the range up to which the scanner saw nothing, m; 0: nothing is known. Cells
  // of kDepthStep: rows from straight down to straight up, columns by azimuth from -pi; a return
  // counts in its own cell and those beside it.
  std::vector<float> free_range;
  double image_samples = 0;  // of the whole image

  // At most 0.7 MB.
  size_t MemoryBytes() const;
  // The free range in the direction of a point, m, scanner frame.
  double FreeRangeTowards(const Eigen::Vector3d& point) const;
};

// Thins a valid scan for its links.
LinkSurface MakeLinkSurface(const sensor::Scan& scan, const RegistrationConfig& config,
                            parallel::Parallel& parallel);
// The same from a surface that registration has thinned (SampleSurface()).
LinkSurface MakeLinkSurface(const ScanSurface& surface, const sensor::Scan& scan);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_GRAPH_LINK_SURFACE_H_

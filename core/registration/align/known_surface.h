// Known surface around a scan, thinned, and what a scan at a pose says of it: on it, through it, or
// short of it.
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_KNOWN_SURFACE_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_KNOWN_SURFACE_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/sensor/scan.h"

namespace vantage::registration {

struct SurfacePiece {
  Eigen::Vector3f centroid;  // m, world, of one of its voxels
  Eigen::Vector3f normal;    // unit, world, of the same voxel, towards the empty side
  float area = 0;            // m2, of all its voxels
};

struct KnownSurface {
  std::vector<SurfacePiece> pieces;  // in the model's order
  double spacing = 0;  // m, edge of the cubes that hold one piece at most for each way that surface
                       // faces
};

// The true surface in `box` (m, world) as at most `most` pieces (48 where that is less, as many as
// eight cubes can hold), each for the voxels of a cube that face the same way; the smallest cubes
// are voxels.
KnownSurface SurfaceIn(const model::PlanningView& model, const Eigen::AlignedBox3d& box,
                       size_t most);

// What a scan says of a piece of known surface. Out of sight is what is turned away, out of range
// or field of view, or what known surface or unknown space lies before. Seen through: the return
// lies behind it. Hidden: the return lies before it.
enum class SurfaceSight : uint8_t { kOutOfSight, kSeen, kSeenThrough, kHidden, kNoReturn };
std::vector<SurfaceSight> SightsOf(const model::PlanningView& model,
                                   std::span<const SurfacePiece> pieces, const sensor::Scan& scan,
                                   const Eigen::Isometry3d& T_world_scan,
                                   parallel::Parallel& parallel);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_KNOWN_SURFACE_H_

// The stages of an alignment: a wide search with few samples in the correspondence field, then the
// voxels themselves, and how well a pose fits.
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_ALIGN_STAGES_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_ALIGN_STAGES_H_

#include <Eigen/Geometry>
#include <span>

#include "core/parallel/parallel.h"
#include "core/registration/align/correspondence_field.h"
#include "core/registration/align/pose_step.h"
#include "core/registration/align/registration_config.h"
#include "core/registration/align/scan_surface.h"
#include "core/registration/align/voxel_search.h"

namespace vantage::registration {

// Aligns in the field, with a radius that shrinks from `reach` (m) to two voxels.
Eigen::Isometry3d AlignCoarse(const CorrespondenceField& field,
                              std::span<const SurfaceSample> samples, Eigen::Isometry3d pose,
                              const PriorTerm& prior, double reach, double voxel);

struct FineResult {
  Eigen::Isometry3d pose;
  bool converged = false;
  int iterations = 0;
};
// Aligns against the voxels' centroids and normals, with the first `count` samples.
FineResult AlignFine(const VoxelSearch& search, const ScanSurface& surface, size_t count,
                     const Eigen::Isometry3d& pose, const PriorTerm& prior,
                     const RegistrationConfig& config, parallel::Parallel& parallel,
                     int max_iterations);

// How far apart two poses put the scan's surface: rms over samples, m.
double SurfaceDistance(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b,
                       std::span<const SurfaceSample> samples);

// Share of the samples that fit. Samples count alike here, whatever number of the image's samples
// they stand for: near surface must not decide alone.
double ScorePose(const VoxelSearch& search, std::span<const SurfaceSample> samples,
                 const Eigen::Isometry3d& pose);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_ALIGN_STAGES_H_

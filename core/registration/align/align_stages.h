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

// Standard deviations, to Tukey's scale: 95 % as efficient as least squares on Gaussian noise.
inline constexpr double kTukeySigmas = 4.685;
// Of the median of absolute Gaussian residuals, to their standard deviation.
inline constexpr double kMedianToSigma = 1.4826;
// m, that the median of absolute residuals counts as at least: three quarters of what a noise of 1
// mm, the least of any scanner, leaves. Without any noise, in simulations, nothing but rounding
// would count.
inline constexpr double kLeastMedianResidual = 5e-4;

// Aligns in the field, with a radius that shrinks from `reach` (m) to two voxels.
Eigen::Isometry3d AlignCoarse(const CorrespondenceField& field,
                              std::span<const SurfaceSample> samples, Eigen::Isometry3d pose,
                              const PriorTerm& prior, double reach, double voxel);
// The same in parts: with a radius that shrinks from `radius` (m) as long as it is above `until`.
// Returns the radius to go on with; 0 where too few samples found any surface to go on at all.
double NarrowCoarse(const CorrespondenceField& field, std::span<const SurfaceSample> samples,
                    const PriorTerm& prior, double radius, double until, Eigen::Isometry3d& pose);
// m: where it is to end.
inline double LastRadius(double voxel) { return 2 * voxel; }

// Steps in which surface is sought farther away, as the first stage may end a voxel off.
inline constexpr int kWideSteps = 2;

struct FineResult {
  Eigen::Isometry3d pose;
  bool converged = false;
  int iterations = 0;
  double scale = 0;  // m, of Tukey's weights at the end
};
// Aligns against the voxels' centroids and normals, with the first `count` samples. `first_scale`
// (m) is that of the weights at first: a voxel and a half (WideScale()) takes in what the first
// stage leaves. `wide_steps`: fewer where the pose is better than that.
FineResult AlignFine(const VoxelSearch& search, const ScanSurface& surface, size_t count,
                     const Eigen::Isometry3d& pose, const PriorTerm& prior,
                     const RegistrationConfig& config, parallel::Parallel& parallel,
                     int max_iterations, double first_scale, int wide_steps = kWideSteps);

inline double WideScale(double voxel) { return 1.5 * voxel; }

// How far apart two poses put the scan's surface: rms over samples, m.
double SurfaceDistance(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b,
                       std::span<const SurfaceSample> samples);

// Share of the samples that fit. Samples count alike here, whatever number of the image's samples
// they stand for: near surface must not decide alone.
double ScorePose(const VoxelSearch& search, std::span<const SurfaceSample> samples,
                 const Eigen::Isometry3d& pose);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_ALIGN_STAGES_H_

// Point-to-plane alignment of a scan's surface to the true surface of the model: many starts on few
// samples in a correspondence field, then all samples against the voxels' centroids and normals.
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_ALIGN_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_ALIGN_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/registration/align/correspondence.h"
#include "core/registration/align/correspondence_field.h"
#include "core/registration/align/minimum.h"
#include "core/registration/align/pose_step.h"
#include "core/registration/align/registration_config.h"
#include "core/registration/align/scan_surface.h"
#include "core/registration/align/targets.h"
#include "core/registration/align/voxel_search.h"
#include "core/sensor/pose_prior.h"

namespace vantage::registration {

struct Alignment {
  Eigen::Isometry3d T_world_scan = Eigen::Isometry3d::Identity();
  bool converged = false;
  int iterations = 0;           // of the last stage
  double score = 0;             // as in Minimum
  std::vector<Minimum> rivals;  // other minima apart from it by more than kApart, best first
  // Of these, one that fits better, but which known space makes doubtful (algorithm.md section 9).
  std::optional<Minimum> displaced;
  // Of the first stage, good to two voxels: may be as good, and were too many to be compared.
  std::vector<Minimum> not_compared;
  // m: how far from its pose other places may lie that fit about as well and are too many to be
  // tried, and rad, how they may be turned. 0: all were tried; infinite: anywhere.
  double open_within = 0;
  double open_turn = 0;
  std::string left_out;  // in words, where it may lie that was not searched; empty: nowhere
};

// Poses that move the scan's surface by less than this (m, rms) count as the same minimum. The
// first stage ends within two voxels (0.1 m) of a minimum, from any start; refined ones lie within
// a noise of 1 cm of each other. Repeated structure that misleads (studs, tiles, shelves) is wider.
inline constexpr double kApart = 0.08;

// Aligns from `prior`. Directions that nothing constrains stay as the prior has them.
Alignment Align(const model::PlanningView& model, const ScanSurface& surface,
                const sensor::PosePrior& prior, const RegistrationConfig& config,
                parallel::Parallel& parallel, std::span<const TargetTie> targets = {});

// The prior itself, then shifts and headings around it as far as it may be wrong, at a spacing that
// the reach of the first stage bridges.
std::vector<Eigen::Isometry3d> StartsAroundPrior(const sensor::PosePrior& prior);

// What the starts of an alignment are: guesses around one prior, or places of which none is more
// likely than the others. With places, directions that nothing constrains stay as the start has
// them.
enum class StartKind { kAroundPrior, kPlaces };

// From the given starts, of which there is at least one; `field` and `search` cover what they
// reach. With kPlaces only the inclinometer of `prior` counts.
Alignment AlignFrom(const model::PlanningView& model, const CorrespondenceField& field,
                    const VoxelSearch& search, const ScanSurface& surface,
                    const sensor::PosePrior& prior, StartKind kind,
                    std::span<const Eigen::Isometry3d> starts, const RegistrationConfig& config,
                    parallel::Parallel& parallel, std::span<const TargetTie> targets = {});

// Refines an alignment against the voxels, from where it ended or was moved to. Its scores stay.
Alignment Refine(const model::PlanningView& model, const ScanSurface& surface, Alignment alignment,
                 const PriorTerm& prior, const RegistrationConfig& config,
                 parallel::Parallel& parallel);

// The compatible true surface at each sample, at a given pose; outliers included.
std::vector<Correspondence> FindCorrespondences(const VoxelSearch& search,
                                                const ScanSurface& surface,
                                                const Eigen::Isometry3d& T_world_scan,
                                                const RegistrationConfig& config,
                                                parallel::Parallel& parallel);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_ALIGN_H_

// How a scan's samples at a pose agree with the space that the model knows (algorithm.md section 9,
// 'The verdict on an alignment').
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_SPACE_AGREEMENT_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_SPACE_AGREEMENT_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/registration/align/scan_surface.h"
#include "core/registration/align/voxel_search.h"

namespace vantage::registration {

// How a sample of a pose agrees with what is known. It contradicts when it lies well inside
// known-empty space, or when its ray has passed through true surface before. It is missed where the
// space is known, holds nothing that it fits, and does not contradict so clearly.
enum class SampleAgreement : uint8_t { kNothingKnown, kFits, kMissed, kContradicts };
std::vector<SampleAgreement> CompareSamples(const model::PlanningView& model,
                                            const VoxelSearch& search,
                                            std::span<const SurfaceSample> samples,
                                            const Eigen::Isometry3d& T_world_scan,
                                            parallel::Parallel& parallel);

// The normal (unit, world) of the first true surface that a ray from `origin` has gone through well
// before it reaches `point` (both m, world); nothing where it has not gone through any.
std::optional<Eigen::Vector3f> SurfacePassed(const model::PlanningView& model,
                                             const Eigen::Vector3d& origin,
                                             const Eigen::Vector3d& point);

// Share of the samples in known space that may contradict it without making a doubt, since things
// are moved. In a room that stayed as it was less than 1 % does, in one whose walls are a metre
// further out more than 10 % (align_test). A share of surface, for any scanner.
inline constexpr double kContradictionDoubtful = 0.08;

// How a pose agrees with it.
struct SpaceAgreement {
  double fitting = 0;        // samples of the image that lie on true surface
  double contradicting = 0;  // samples of the image that contradict

  // Of those that meet something known, [0, 1].
  double ContradictionShare() const;

  // What is left of a pose's fit, [0, 1]: each sample that contradicts speaks against the pose as
  // much as one that fits speaks for it. Where a scan of another room lies on a room that is known,
  // as many as two in five contradict, and by area it may fit that room twice as well as its own
  // place through a door. 1 where nothing is known.
  double Left() const;
};
// Sums what CompareSamples() says of the samples.
SpaceAgreement AgreementOf(std::span<const SurfaceSample> samples,
                           std::span<const SampleAgreement> agreements);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_SPACE_AGREEMENT_H_

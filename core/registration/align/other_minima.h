// Which of the many poses that an alignment's first stage ended in are worth comparing with the
// best (algorithm.md section 9, 'Alignment').
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_OTHER_MINIMA_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_OTHER_MINIMA_H_

#include <Eigen/Geometry>
#include <cstddef>
#include <span>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/registration/align/minimum.h"
#include "core/registration/align/scan_surface.h"
#include "core/registration/align/voxel_search.h"

namespace vantage::registration {

struct OtherMinima {
  std::vector<Minimum> worth;     // comparing, the best first
  std::vector<Minimum> left_out;  // as good by this, beyond as many as are wanted
};

// Of `others`, which the first stage ended in (good to two voxels, the best first; scores of that
// stage, of which the best is `best_score`), those that may turn out to be rivals of the best of
// the minima in `refined`, and that lie apart from these and from each other: that fit enough, that
// what holds the scan holds, too, and that known space does not clearly refute. Cheap: most others
// are told by their score, the rest by `samples`, of which some hundred will do. At most `most`.
OtherMinima FindOtherMinima(const model::PlanningView& model, const VoxelSearch& search,
                            std::span<const SurfaceSample> samples,
                            std::span<const Minimum> refined, std::span<const Minimum> others,
                            double best_score, size_t most, parallel::Parallel& parallel);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_OTHER_MINIMA_H_

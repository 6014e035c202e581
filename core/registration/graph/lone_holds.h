// Directions of a pose that too little surface holds (algorithm.md section 9, 'Links').
#ifndef VANTAGE_CORE_REGISTRATION_GRAPH_LONE_HOLDS_H_
#define VANTAGE_CORE_REGISTRATION_GRAPH_LONE_HOLDS_H_

#include <cstddef>
#include <span>

#include "core/registration/bound/error_bound.h"

namespace vantage::registration {

// Where fewer than `fewest` of the constraints hold a direction of the pose, these get the weight 0
// and count as overlap only. What one scan has of a door's front and the other of its frame lies
// side by side, and where hardly anything else holds the pose along their normal, it slides until
// the two are one plane: nothing that is left would show the difference. Constraints of the weight
// 0 stay as they are. Returns how many were released.
size_t ReleaseLoneHolds(std::span<Constraint> constraints, double fewest);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_GRAPH_LONE_HOLDS_H_

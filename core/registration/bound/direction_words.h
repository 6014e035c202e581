// Pose changes in a surveyor's words.
#ifndef VANTAGE_CORE_REGISTRATION_BOUND_DIRECTION_WORDS_H_
#define VANTAGE_CORE_REGISTRATION_BOUND_DIRECTION_WORDS_H_

#include <string>

#include "core/sensor/pose_prior.h"

namespace vantage::registration {

// The weakest direction as a surveyor would say it: 'sliding along x', 'turning about
// the vertical'. `reach` (m) is half the overlap's diagonal: what a rotation displaces at its edge.
struct DirectionWords {
  std::string direction;
  std::string remedy;  // what would constrain it
};
DirectionWords DescribeDirection(const sensor::Vector6d& weakest, double reach);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_BOUND_DIRECTION_WORDS_H_

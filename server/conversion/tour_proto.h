// Conversion of tours between the wire and the core.
#ifndef VANTAGE_SERVER_CONVERSION_TOUR_PROTO_H_
#define VANTAGE_SERVER_CONVERSION_TOUR_PROTO_H_

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "core/planning/plan/planning_config.h"
#include "core/tour/tour.h"
#include "server/contract/error.h"
#include "vantage/v1/tour.pb.h"

namespace vantage::conversion {

// What a checked wish asks for, but for its scanners, in the model frame. Adds to `violations` what
// names no region of `regions`, which are the session's.
tour::TourRequest ReadTourWish(const v1::TourWish& wish,
                               std::span<const planning::RequiredRegion> regions,
                               const Eigen::Vector3d& origin, contract::Violations& violations);

// `scanners` are the names of the request's scanners; none: none was named.
v1::Tour WriteTour(const tour::Tour& tour, const std::vector<std::string>& scanners,
                   double required_density, const Eigen::Vector3d& origin);

}  // namespace vantage::conversion

#endif  // VANTAGE_SERVER_CONVERSION_TOUR_PROTO_H_

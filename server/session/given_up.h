// The places where surface was given up.
#ifndef VANTAGE_SERVER_SESSION_GIVEN_UP_H_
#define VANTAGE_SERVER_SESSION_GIVEN_UP_H_

#include <Eigen/Core>

#include "core/model/view/planning_view.h"
#include "vantage/v1/model_service.pb.h"

namespace vantage::session {

// Groups the given-up voxels of one kind that touch (26 neighbours) and adds the largest 100
// groups.
void FindGivenUp(const model::PlanningView& model, const Eigen::Vector3d& origin,
                 v1::GetCoverageResponse& response);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_GIVEN_UP_H_

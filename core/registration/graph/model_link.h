// What registration to all that was known says of a scan, as a link of the graph (algorithm.md
// section 9, 'The chain closes').
#ifndef VANTAGE_CORE_REGISTRATION_GRAPH_MODEL_LINK_H_
#define VANTAGE_CORE_REGISTRATION_GRAPH_MODEL_LINK_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <string>

#include "absl/status/statusor.h"
#include "core/registration/graph/pose_graph.h"
#include "core/sensor/pose_prior.h"

namespace vantage::registration {

// A scan of a job, and how it was registered to the model of those before it.
struct ModelRegistration {
  std::string scan;    // its node's id
  std::string beside;  // id of the node that T_beside_scan is beside: a scan before it
  Eigen::Isometry3d T_beside_scan = Eigen::Isometry3d::Identity();
  // Of the error of T_beside_scan, in beside's frame and about the scanner. Of one that is not
  // positive definite nothing is said.
  sensor::Matrix6d covariance = sensor::Matrix6d::Identity();
};

// The same graph with a link of the origin kModel for each registration. A scan that sees what six
// others saw is held better than any of them alone holds it, as long as the six stand to each other
// as they are. So each link has as its covariance that of the registration, and how far the scans
// that it overlaps may be off each other: along the chain that ties them best, at the scanner, by
// the share that each has in what holds the scan. A scan that closes a long chain is held by little
// but its links to either end. Both rest on the same measurements of the scan, so that each counts
// half of what it says (covariance intersection: how much they share is not known). Of a scan that
// has no link to those before it, or overlaps some that nothing ties to each other, registration to
// the model says nothing here.
//
// `registrations` are in the order in which scans came, their ids are nodes of `graph`, whose poses
// are as they stand. Links in doubt do not count and stay as they are. A scan that has no
// registration, as the first one, is before all that have. Takes time like n log n of the links for
// each registration. Errors: as PoseGraph::Create().
absl::StatusOr<PoseGraph> WithModelLinks(const PoseGraph& graph,
                                         std::span<const ModelRegistration> registrations);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_GRAPH_MODEL_LINK_H_

// Graphs of scans whose true poses and true noise are known.
#ifndef VANTAGE_TESTS_SUPPORT_GRAPH_SCENES_H_
#define VANTAGE_TESTS_SUPPORT_GRAPH_SCENES_H_

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/registration/graph/pose_graph.h"

namespace vantage::test_support {

// Where scans were made, and which pairs overlap.
struct GraphScene {
  std::vector<Eigen::Isometry3d> truth;             // T_world_scan
  std::vector<std::pair<size_t, size_t>> overlaps;  // rising
};

// `scans` along a corridor of 60 x 40 m that closes; each overlaps the next `reach`.
GraphScene RingCorridorGraph(size_t scans, size_t reach, uint64_t seed);
// Three storeys of `per_storey` scans each, in which each overlaps those near it, and a landing
// between two storeys, which overlaps the first of either.
GraphScene ThreeStoreysGraph(size_t per_storey, uint64_t seed);
// Around a block of 70 x 50 m; each overlaps the next two.
GraphScene StreetGraph(size_t scans, uint64_t seed);

// Upright poses, tilted by a degree.
Eigen::Isometry3d RandomUpright(const Eigen::Vector3d& place, uint64_t seed);

std::string ScanName(size_t index);

// Noise of links: a covariance of its own for each, of random directions, of `position_sigma` (m)
// and `turn_sigma` (rad) or up to four times as much.
struct LinkNoise {
  double position_sigma = 0.001;
  double turn_sigma = 0.0002;
  bool drawn = true;  // false: links are exact
  // Noise is independent, as that of stated links is taken to be.
  registration::LinkOrigin origin = registration::LinkOrigin::kStated;
};
// The first scan is fixed, links are as their covariances have it. Scans stand where the chain of
// links from one to the next has them.
registration::PoseGraph NoisyGraph(const GraphScene& scene, const LinkNoise& noise, uint64_t seed);

// Parts, for tests that change them.
std::vector<registration::ScanNode> NodesOf(const GraphScene& scene);
std::vector<registration::ScanLink> LinksOf(const GraphScene& scene, const LinkNoise& noise,
                                            uint64_t seed);

// [rotation about world axes; translation] from the truth to a pose.
sensor::Vector6d PoseError(const Eigen::Isometry3d& truth, const Eigen::Isometry3d& pose);

}  // namespace vantage::test_support

#endif  // VANTAGE_TESTS_SUPPORT_GRAPH_SCENES_H_

// What holds each component of a graph, and where an adjustment starts.
#ifndef VANTAGE_CORE_REGISTRATION_GRAPH_GRAPH_DATUM_H_
#define VANTAGE_CORE_REGISTRATION_GRAPH_GRAPH_DATUM_H_

#include <Eigen/Geometry>
#include <vector>

#include "core/registration/graph/pose_graph.h"
#include "core/registration/graph/residuals.h"

namespace vantage::registration {

// As adjust.h has it.
struct GraphDatum {
  std::vector<bool> held;       // by node
  std::vector<PoseTerm> terms;  // all evidence, and what holds components that it may leave open
  int vague_equations = 0;      // of these, those of the latter
  std::vector<PoseTerm> links;  // of links that count, in their order
  std::vector<size_t> link_of;  // by those, the index in graph.links()
};
GraphDatum DatumOf(const PoseGraph& graph);

// Along the links that hold best (a maximum spanning tree) from what is held; the poses of nodes
// enter only there.
std::vector<Eigen::Isometry3d> StartPoses(const PoseGraph& graph, const GraphDatum& datum);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_GRAPH_GRAPH_DATUM_H_

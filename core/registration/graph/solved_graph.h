// The poses that fit a graph best, before they are rounded and judged.
#ifndef VANTAGE_CORE_REGISTRATION_GRAPH_SOLVED_GRAPH_H_
#define VANTAGE_CORE_REGISTRATION_GRAPH_SOLVED_GRAPH_H_

#include <Eigen/Geometry>
#include <vector>

#include "absl/status/statusor.h"
#include "core/registration/graph/graph_datum.h"
#include "core/registration/graph/graph_normals.h"
#include "core/registration/graph/pose_graph.h"
#include "core/registration/graph/residuals.h"
#include "core/sensor/pose_prior.h"

namespace vantage::registration {

struct SolvedGraph {
  GraphDatum datum;
  std::vector<Eigen::Isometry3d> poses;  // T_world_scan, by node
  double chi2 = 0;
  int degrees_of_freedom = 0;
  double variance_factor = 1;  // as Adjustment's
  int iterations = 0;

  // At these poses; solvable.
  GraphNormals Normals() const;
};

// Errors as Adjust()'s.
absl::StatusOr<SolvedGraph> SolveGraph(const PoseGraph& graph);

// Covariances of the poses, without the variance factor.
struct PoseCovariances {
  std::vector<sensor::Matrix6d> own;      // by node
  std::vector<sensor::Matrix6d> between;  // by link, in doubt or not; rows are a's
};
PoseCovariances CovariancesOf(const PoseGraph& graph, const GraphNormals& normals);

// Directions of which a term says anything.
int RankOf(const PoseTerm& term);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_GRAPH_SOLVED_GRAPH_H_

// Classifies a pair of a box of views and a group of patch cells (algorithm.md section 8, 'The
// hierarchy'). The caller chooses the pairs.
#ifndef VANTAGE_CORE_PLANNING_EVALUATION_SHAFT_CLASSIFIER_H_
#define VANTAGE_CORE_PLANNING_EVALUATION_SHAFT_CLASSIFIER_H_

#include <Eigen/Geometry>
#include <atomic>
#include <cstdint>
#include <span>

#include "core/planning/evaluation/view_tree.h"
#include "core/planning/scoring/brute_force.h"
#include "core/planning/scoring/interval_constraints.h"
#include "core/planning/scoring/patch_tree.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::planning {

struct HierarchyCounts {
  uint64_t pairs = 0;     // classified
  uint64_t violated = 0;  // by a sensing constraint
  uint64_t occluded = 0;
  uint64_t visible = 0;  // entirely
  void operator+=(const HierarchyCounts& other) {
    pairs += other.pairs;
    violated += other.violated;
    occluded += other.occluded;
    visible += other.visible;
  }
};

// A viewcell or a group of viewcells, in the form that a classification needs.
struct ViewBox {
  Eigen::AlignedBox3d box;    // m
  Eigen::AlignedBox3d scene;  // the same in scene coordinates
  double width = 0;           // m
  uint32_t views = 0;
  bool leaf = false;
};

// References are kept. Thread safe.
class ShaftClassifier {
 public:
  // `tolerance` and `visible_pairs`: HierarchyOptions.
  ShaftClassifier(const BruteForceScorer& scorer, const visibility::OpaqueGrid& grid,
                  double tolerance, uint32_t visible_pairs);

  ViewBox Of(const ViewTree::Node& node) const;
  // The same of any views: `centres` (m) is the box of their centres.
  ViewBox Of(const Eigen::AlignedBox3d& centres, uint32_t views) const;

  enum class Relation {
    kNothing,   // no view of the box gains anything from the group
    kConstant,  // every view gains the same
    kMixed
  };
  // `satisfied`: constraints that are known to hold for a pair that contains this one; those found
  // to hold for this one are added. `score` (samples) is set for kConstant, and `seen` marked.
  Relation Classify(const ViewBox& views, const PatchTree::Node& group, const CellArrays& cells,
                    uint8_t& satisfied, double& score, HierarchyCounts& counts,
                    std::span<std::atomic<uint8_t>> seen) const;

 private:
  double Constant(const PatchTree::Node& group, const CellArrays& cells,
                  const Interval& density) const;

  const BruteForceScorer& scorer_;
  IntervalConstraints intervals_;
  const visibility::OpaqueGrid& grid_;
  double tolerance_;
  uint32_t visible_pairs_;
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EVALUATION_SHAFT_CLASSIFIER_H_

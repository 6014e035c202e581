#include "core/planning/evaluation/shaft_classifier.h"

#include <algorithm>

#include "core/visibility/shaft.h"

namespace vantage::planning {
namespace {

constexpr double kFloatSlack = 1e-5;  // m: views and cells are floats where scores are computed

}  // namespace

ShaftClassifier::ShaftClassifier(const BruteForceScorer& scorer, const visibility::OpaqueGrid& grid,
                                 double tolerance, uint32_t visible_pairs)
    : scorer_(scorer),
      intervals_(scorer.constraints()),
      grid_(grid),
      tolerance_(tolerance),
      visible_pairs_(visible_pairs) {}

ViewBox ShaftClassifier::Of(const ViewTree::Node& node) const {
  ViewBox views = Of(node.centres, node.size());
  views.leaf = node.children == 0;
  return views;
}

ViewBox ShaftClassifier::Of(const Eigen::AlignedBox3d& centres, uint32_t count) const {
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(scorer_.reach());
  const Eigen::Vector3d slack = Eigen::Vector3d::Constant(kFloatSlack);
  const Eigen::Vector3d low = centres.min() - reach;
  const Eigen::Vector3d high = centres.max() + reach;
  ViewBox views;
  views.box = Eigen::AlignedBox3d(low - slack, high + slack);
  views.scene = Eigen::AlignedBox3d(low / scorer_.voxel() - scorer_.scene().corner(),
                                    high / scorer_.voxel() - scorer_.scene().corner());
  views.width = (high - low).maxCoeff();
  views.views = count;
  return views;
}

// What each view gains on a pair that is entirely visible and satisfies all constraints.
double ShaftClassifier::Constant(const PatchTree::Node& group, const CellArrays& cells,
                                 const Interval& density) const {
  if (density.min >= static_cast<double>(group.bounds.most_enough)) return group.potential;
  const auto s = static_cast<float>(0.5 * (density.min + density.max));
  double sum = 0;
  for (size_t i = group.begin; i < group.end; ++i) {
    const float gained = std::max(0.0f, std::min(s, cells.enough[i]) - cells.q[i]);
    sum += static_cast<double>(cells.factor[i]) * static_cast<double>(gained);
  }
  return sum;
}

ShaftClassifier::Relation ShaftClassifier::Classify(const ViewBox& views,
                                                    const PatchTree::Node& group,
                                                    const CellArrays& cells, uint8_t& satisfied,
                                                    double& score, HierarchyCounts& counts,
                                                    std::span<std::atomic<uint8_t>> seen) const {
  Interval density;
  ++counts.pairs;
  if (!intervals_.Test(views.box, group.bounds, satisfied, density)) {
    ++counts.violated;
    return Relation::kNothing;
  }
  if (!(satisfied & kVisible)) {
    const Eigen::AlignedBox3d targets = group.targets.cast<double>();
    const visibility::Hidden hidden = visibility::Occlusion(grid_, views.scene, targets);
    if (hidden == visibility::Hidden::kAll) {
      ++counts.occluded;
      return Relation::kNothing;
    }
    // When nothing is between the two centres, there may be nothing in the whole shaft.
    if (hidden == visibility::Hidden::kNone &&
        static_cast<uint64_t>(views.views) * group.size() >= visible_pairs_ &&
        EntirelyVisible(grid_, views.scene, targets)) {
      ++counts.visible;
      satisfied |= kVisible;
    }
  }
  constexpr uint8_t kAllSatisfied = kSensingSatisfied | kVisible;
  if ((satisfied & kAllSatisfied) != kAllSatisfied) return Relation::kMixed;
  if (group.bounds.has_dropouts || group.bounds.under_sky) return Relation::kMixed;
  // In which sectors the cells lie differs from view to view.
  if (!scorer_.headings().all_around()) return Relation::kMixed;
  const bool saturated = density.min >= static_cast<double>(group.bounds.most_enough);
  const bool constant =
      scorer_.reach() == 0 && density.max - density.min <= tolerance_ * density.max;
  if (!saturated && !constant) return Relation::kMixed;
  score = Constant(group, cells, density);
  if (!seen.empty() && score > 0) {
    for (uint32_t i = group.begin; i < group.end; ++i) {
      if (cells.factor[i] > 0) MarkSeen(seen, cells.cell[i]);
    }
  }
  return Relation::kConstant;
}

}  // namespace vantage::planning

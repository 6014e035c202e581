#include "core/planning/evaluation/view_boxes.h"

#include <algorithm>
#include <cmath>

namespace vantage::planning {
namespace {

constexpr double kSide = 0.6;       // m, approximate edge of the boxes
constexpr double kRaySlack = 1e-5;  // m: views are floats where rays are cast

}  // namespace

ViewBoxes::ViewBoxes(const BruteForceScorer& scorer, const FeasibleViews& views)
    : scorer_(scorer),
      views_(views),
      side_(std::max(1, static_cast<int>(std::lround(kSide / views.cell_size())))) {}

ViewBoxes::Key ViewBoxes::KeyOf(uint32_t view) const {
  Key key;
  for (int a = 0; a < 3; ++a) {
    const int at = views_.cells()[view][a];
    key[static_cast<size_t>(a)] = (at >= 0 ? at : at - side_ + 1) / side_;
  }
  return key;
}

Eigen::AlignedBox3d ViewBoxes::BoxOf(const Key& key) const {
  const Eigen::Vector3d first = Eigen::Vector3i(key[0], key[1], key[2]).cast<double>() * side_;
  const Eigen::Vector3d low = first.array() + 0.5;
  const Eigen::Vector3d high = first.array() + side_ - 0.5;
  const double around = scorer_.reach() + kRaySlack;
  const auto in_scene = [&](const Eigen::Vector3d& viewcells, double by) -> Eigen::Vector3d {
    const Eigen::Vector3d at = viewcells * views_.cell_size();
    return (at.array() + by) / scorer_.voxel() - scorer_.scene().corner().array();
  };
  return {in_scene(low, -around), in_scene(high, around)};
}

}  // namespace vantage::planning

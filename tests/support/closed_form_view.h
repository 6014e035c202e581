// Planning views of scenes given as formulas, for tests that need a model without a scan.
#ifndef VANTAGE_TESTS_SUPPORT_CLOSED_FORM_VIEW_H_
#define VANTAGE_TESTS_SUPPORT_CLOSED_FORM_VIEW_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/model/view/voxel.h"

namespace vantage::test_support {

// Voxels are judged at their centres. Neither solid nor known: unknown.
struct ClosedFormScene {
  double voxel = 0.05;         // m
  Eigen::AlignedBox3d extent;  // m, everything outside is unknown
  std::function<bool(const Eigen::Vector3d&)> solid;
  std::function<bool(const Eigen::Vector3d&)> known = [](const Eigen::Vector3d&) { return true; };
  // q of measured surface, samples / m^2.
  std::function<double(const Eigen::Vector3d&)> density = [](const Eigen::Vector3d&) { return 0; };
  // What false surface at a place is.
  std::function<model::VoxelState(const Eigen::Vector3d&)> false_kind = [](const Eigen::Vector3d&) {
    return model::VoxelState::kFalseOcclusion;
  };
  std::vector<model::Station> stations;
};

// A station on a floor at z = 0, with the default clearance.
model::Station MakeStation(const Eigen::Vector3d& position);

// Solid voxels with an empty face neighbour are true surface, unknown ones false surface; normals
// point to the empty 26-neighbours, areas are as the model defines them.
model::PlanningView BuildView(const ClosedFormScene& scene);

// A furnished room, 6 x 5 x 2.7 m with its corner at the origin, floor at z = 0, walls 0.1 m thick:
// seeded boxes on the floor, a station at (1.5, 1.5, 1.5), and unknown space behind a screen.
// `seed` moves the boxes.
ClosedFormScene FurnishedRoom(uint64_t seed);

}  // namespace vantage::test_support

#endif  // VANTAGE_TESTS_SUPPORT_CLOSED_FORM_VIEW_H_

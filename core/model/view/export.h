// The model in formats that other people's tools open.
#ifndef VANTAGE_CORE_MODEL_VIEW_EXPORT_H_
#define VANTAGE_CORE_MODEL_VIEW_EXPORT_H_

#include <string>

#include "core/model/view/planning_view.h"

namespace vantage::model {

// What is exported, and where it lies: `origin` is the place of the model frame's origin in the
// world, m, whose axes are the model's.

// An OctoMap file (.ot, occupancy tree), or a binary one (.bt, occupied and free alone): true and
// absorbed surface occupied, empty space free, everything else unknown. Plain OctoMap tools read
// it. Its keys reach some 1.6 km only, so that it stays in the model frame; a comment in its header
// says where that lies.
std::string ExportOctomap(const PlanningView& model,
                          const Eigen::Vector3d& origin = Eigen::Vector3d::Zero());
std::string ExportBinaryOctomap(const PlanningView& model,
                                const Eigen::Vector3d& origin = Eigen::Vector3d::Zero());

// Binary little-endian PLY, one vertex per voxel that has area: x, y, z (double, m, world,
// centroid), nx, ny, nz, red, green, blue (by kind), kind (1 true, 2 occlusion, 3 hole, 4 image
// boundary), density (samples / m^2), area (m^2), samples, given_up (0 or 1). Its header says so.
std::string ExportSurfacePly(const PlanningView& model,
                             const Eigen::Vector3d& origin = Eigen::Vector3d::Zero());

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_VIEW_EXPORT_H_

// The model in formats that other people's tools open.
#ifndef VANTAGE_CORE_MODEL_VIEW_EXPORT_H_
#define VANTAGE_CORE_MODEL_VIEW_EXPORT_H_

#include <string>

#include "core/model/view/planning_view.h"

namespace vantage::model {

// An OctoMap file (.ot, occupancy tree): true and absorbed surface occupied, empty space free,
// everything else unknown. Plain OctoMap tools read it.
std::string ExportOctomap(const PlanningView& model);

// Binary little-endian PLY, one vertex per voxel that has area: x, y, z (m, centroid), nx, ny, nz,
// red, green, blue (by kind), kind (0 true, 1 occlusion, 2 hole, 3 image boundary), density
// (samples / m^2), area (m^2), samples, given_up (0 or 1).
std::string ExportSurfacePly(const PlanningView& model);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_VIEW_EXPORT_H_

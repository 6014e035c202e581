// PLY files (binary, little-endian) of a session's scans and patches.
#ifndef VANTAGE_SERVER_SESSION_PLY_H_
#define VANTAGE_SERVER_SESSION_PLY_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <string>

#include "core/sensor/range_image.h"
#include "vantage/v1/plan.pb.h"

namespace vantage::session {

// Registered samples: x, y, z (double, m, world), the number of the scan (uint), and of what there
// is to be: intensity (ushort, 0 to 65,535), red, green and blue (uchar).
std::string SamplesPlyHeader(int64_t samples, const sensor::AppearanceKinds& appearance);
int64_t SamplePlyBytes(const sensor::AppearanceKinds& appearance);
// The samples of a scan, column after column; what it has not is 0. `T_world_scan` as registered.
std::string SamplesPlyBody(const sensor::RangeImage& image, const Eigen::Isometry3d& T_world_scan,
                           uint32_t scan, const sensor::AppearanceKinds& appearance);

// The bounding rectangles of patches as quadrilaterals, with kind (as in SurfaceKind) and deficit
// (samples) of each; four vertices (double, m, world) a patch.
std::string PatchesPly(const v1::PlanResult& result);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_PLY_H_

// PLY files (binary, little-endian) of a session's scans and patches.
#ifndef VANTAGE_SERVER_SESSION_PLY_H_
#define VANTAGE_SERVER_SESSION_PLY_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <string>

#include "core/sensor/range_image.h"
#include "vantage/v1/plan.pb.h"

namespace vantage::session {

// Registered samples: x, y, z (double, m, world) and the number of the scan (uint).
std::string SamplesPlyHeader(int64_t samples);
inline constexpr int64_t kSamplePlyBytes = 3 * 8 + 4;
// The samples of a scan, column after column. `T_world_scan` as registered.
std::string SamplesPlyBody(const sensor::RangeImage& image, const Eigen::Isometry3d& T_world_scan,
                           uint32_t scan);

// The bounding rectangles of patches as quadrilaterals, with kind (as in SurfaceKind) and deficit
// (samples) of each; four vertices (double, m, world) a patch.
std::string PatchesPly(const v1::PlanResult& result);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_PLY_H_

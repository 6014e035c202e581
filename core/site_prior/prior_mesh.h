// What is known of a site before it is scanned, as triangles in a frame of its own (algorithm.md
// section 13).
#ifndef VANTAGE_CORE_SITE_PRIOR_PRIOR_MESH_H_
#define VANTAGE_CORE_SITE_PRIOR_PRIOR_MESH_H_

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/model/view/planning_view.h"

namespace vantage::site_prior {

// The prior's frame: m, z up, in which the file has its own origin and axes; of a picture the
// origin is its upper left corner, x to the right and y up, so that all of it lies at y <= 0.
struct PriorMesh {
  std::vector<Eigen::Vector3f> vertices;           // m
  std::vector<std::array<uint32_t, 3>> triangles;  // two-sided: winding means nothing
  double unit = 1;  // m for 1 of the coordinates of the file that it was read from; not stored

  Eigen::AlignedBox3f Bounds() const;
};

// The most of a prior that is taken, whatever the file.
inline constexpr uint64_t kMostPriorFileBytes = uint64_t{256} << 20;
inline constexpr size_t kMostPriorTriangles = 4'000'000;
inline constexpr double kWidestPrior = 2000;     // m, along any axis
inline constexpr double kFarthestPrior = 10000;  // m, along any axis, from its own origin
// Of EncodePrior(), bytes: no triangle shares a corner.
inline constexpr uint64_t kMostPriorBytes = 16 + uint64_t{4} * 12 * kMostPriorTriangles;

// What a prior may be refused for, whatever it was read from, with the cure. INVALID_ARGUMENT: no
// triangle, a number that is not finite, too many triangles, wider than kWidestPrior or narrower
// than a room ('is 12000 m wide: give the unit, mm'), flat, or farther off its own origin than
// kFarthestPrior, where numbers are too coarse.
absl::Status CheckPrior(const PriorMesh& mesh);

// The measured surface of a model: a square for each of its voxels.
// RESOURCE_EXHAUSTED: more than `most` triangles; nothing was built.
absl::StatusOr<PriorMesh> MeshOfModel(const model::PlanningView& model,
                                      size_t most = kMostPriorTriangles);

// As it is stored: numbers of vertices and triangles (u64 each), vertices (three f32 each),
// triangles (three u32 each), little-endian.
std::string EncodePrior(const PriorMesh& mesh);
// INVALID_ARGUMENT: that is not what EncodePrior() writes, or CheckPrior().
absl::StatusOr<PriorMesh> DecodePrior(absl::string_view bytes);

}  // namespace vantage::site_prior

#endif  // VANTAGE_CORE_SITE_PRIOR_PRIOR_MESH_H_

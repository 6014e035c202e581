// The walls of a prior as lines, for those who draw it: where level planes over most furniture cut
// its triangles. Planning makes no use of them.
#ifndef VANTAGE_CORE_SITE_PRIOR_WALL_LINES_H_
#define VANTAGE_CORE_SITE_PRIOR_WALL_LINES_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/site_prior/prior_mesh.h"

namespace vantage::site_prior {

// Seen from above. It ends where it begins where it goes around something.
struct WallLine {
  std::vector<Eigen::Vector2f> corners;  // m, x and y in the prior's frame; two at least
  float floor = 0;                       // m, z of the floor of its storey in the prior's frame
};

// Corners of all lines together, at most; the longest lines are kept.
inline constexpr size_t kMostWallCorners = 4000;
// What WallLinesOf() takes at most while it is at work, bytes.
inline constexpr uint64_t kBytesOfWallLines = uint64_t{16} << 20;

// A cut for each storey: over each height at which a good part of the level surface lies, but for
// ceilings and roofs, over which nothing is cut. `scale`: m at the site for 1 m of the mesh, > 0.
// A function of both alone.
std::vector<WallLine> WallLinesOf(const PriorMesh& mesh, double scale);

}  // namespace vantage::site_prior

#endif  // VANTAGE_CORE_SITE_PRIOR_WALL_LINES_H_

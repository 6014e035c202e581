// Morton's space-filling curve.
#ifndef VANTAGE_CORE_PLANNING_SCORING_MORTON_H_
#define VANTAGE_CORE_PLANNING_SCORING_MORTON_H_

#include <Eigen/Core>
#include <cstdint>

namespace vantage::planning {

// Bits of x, y and z in turn, for coordinates from -2^20 to 2^20 - 1: cells of an octree's cube lie
// side by side.
inline uint64_t MortonCode(const Eigen::Vector3i& v) {
  const auto spread = [](int coordinate) {
    uint64_t x = static_cast<uint32_t>(coordinate + (1 << 20)) & 0x1fffff;
    x = (x | x << 32) & 0x1f00000000ffffu;
    x = (x | x << 16) & 0x1f0000ff0000ffu;
    x = (x | x << 8) & 0x100f00f00f00f00fu;
    x = (x | x << 4) & 0x10c30c30c30c30c3u;
    return (x | x << 2) & 0x1249249249249249u;  // bit i to bit 3 i
  };
  return spread(v.x()) | spread(v.y()) << 1 | spread(v.z()) << 2;
}

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_SCORING_MORTON_H_

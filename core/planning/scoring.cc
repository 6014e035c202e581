#include "core/planning/scoring.h"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/planning/target.h"

namespace vantage {
namespace {

uint64_t Spread(uint32_t v) {  // bit i to bit 3 i
  uint64_t x = v & 0x1fffff;
  x = (x | x << 32) & 0x1f00000000ffffu;
  x = (x | x << 16) & 0x1f0000ff0000ffu;
  x = (x | x << 8) & 0x100f00f00f00f00fu;
  x = (x | x << 4) & 0x10c30c30c30c30c3u;
  return (x | x << 2) & 0x1249249249249249u;
}

// The cells along a space-filling curve (Morton's): rays of a packet then go nearly the same way,
// whichever patches they belong to, and a stratum of the sample is one place.
std::vector<uint32_t> AlongCurve(const std::vector<NeedyCell>& cells) {
  std::vector<std::pair<uint64_t, uint32_t>> keys(cells.size());
  for (uint32_t i = 0; i < cells.size(); ++i) {
    const auto shifted = [](int v) { return static_cast<uint32_t>(v + (1 << 20)); };
    const VoxelIndex& v = cells[i].voxel;
    keys[i] = {Spread(shifted(v.x())) | Spread(shifted(v.y())) << 1 | Spread(shifted(v.z())) << 2,
               i};
  }
  std::sort(keys.begin(), keys.end());
  std::vector<uint32_t> order(cells.size());
  for (size_t k = 0; k < keys.size(); ++k) order[k] = keys[k].second;
  return order;
}

}  // namespace

Scoring::Scoring(const PlanningView& model, const OpaqueGrid& grid, const PatchSet& patches,
                 const ScannerModel& scanner, const PlanningConfig& config, Parallel& parallel)
    : constraints_(scanner, config.required_density),
      scene_(grid, OpaqueGrid(model, {1, 2, 0}), parallel),
      // A view stands for its viewcell, grown by what a person misses it by.
      scorer_(constraints_, scene_, model.voxel_size(),
              config.pose_sensitivity ? config.viewcell_size / 2 + scanner.positioning_error : 0) {
  for (const uint32_t i : AlongCurve(patches.cells)) {
    const NeedyCell& cell = patches.cells[i];
    const auto weight = static_cast<float>(config.weights[static_cast<size_t>(cell.kind)]);
    const float factor = weight * cell.success * cell.area;
    if (!(factor > 0)) continue;
    const auto target = TargetOf(grid, cell.voxel, cell.normal);
    if (!target.has_value()) continue;
    cells_.Add(cell.position, cell.normal, factor, cell.density, scene_.ToScene(*target), i);
  }
  cells_.Pad();
}

}  // namespace vantage

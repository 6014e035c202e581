#include "core/planning/openings/storey_section.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace vantage::planning {
namespace {

// Of the layers of the section. A stray sample is no wall, and a shred of unknown space none
// either.
constexpr double kSolidShare = 0.25;
constexpr double kFreeShare = 0.75;

SectionState Judge(const model::PlanningView& model, const Eigen::Vector2i& voxel, float floor) {
  const double size = model.voxel_size();
  const int low = static_cast<int>(std::floor((static_cast<double>(floor) + kSectionLow) / size));
  const int layers =
      std::max(1, static_cast<int>(std::lround((kSectionHigh - kSectionLow) / size)));
  int measured = 0;
  int empty = 0;
  for (int z = low; z < low + layers; ++z) {
    const model::VoxelState state = model.State({voxel.x(), voxel.y(), z});
    measured +=
        state == model::VoxelState::kTrueSurface || state == model::VoxelState::kAbsorbed ? 1 : 0;
    empty += state == model::VoxelState::kEmpty ? 1 : 0;
  }
  if (measured >= kSolidShare * layers) return SectionState::kSolid;
  return empty >= kFreeShare * layers ? SectionState::kFree : SectionState::kUnknown;
}

}  // namespace

std::optional<StoreySection> StoreySection::Of(const model::PlanningView& model,
                                               const FloorMap& floor, int storey,
                                               const parallel::Cancellation& cancelled) {
  StoreySection section(floor.columns().size());
  if (!section.FindHeights(floor, storey, cancelled)) return std::nullopt;
  section.state_.assign(section.height_.size(), SectionState::kUnknown);
  for (uint32_t column = 0; column < section.state_.size(); ++column) {
    if (column % kColumnsBetweenPolls == 0 && cancelled.Requested()) return std::nullopt;
    if (std::isnan(section.height_[column])) continue;
    section.state_[column] = Judge(model, floor.columns().Voxel(column), section.height_[column]);
  }
  return section;
}

// Heights spread from column to neighbour, all columns at once, so that each gets the nearest.
bool StoreySection::FindHeights(const FloorMap& floor, int storey,
                                const parallel::Cancellation& cancelled) {
  const size_t count = floor.columns().columns();
  height_.assign(count, std::numeric_limits<float>::quiet_NaN());
  has_floor_.assign(count, 0);
  std::vector<uint32_t> front;
  for (uint32_t column = 0; column < count; ++column) {
    if (column % kColumnsBetweenPolls == 0 && cancelled.Requested()) return false;
    for (const Floor& here : floor.columns().In(column)) {
      if (floor.storeys().At(static_cast<double>(here.height)) != storey) continue;
      height_[column] = here.height;
      has_floor_[column] = 1;
      front.push_back(column);
      break;
    }
  }
  const std::array<Eigen::Vector2i, 4> steps = {Eigen::Vector2i(-1, 0), Eigen::Vector2i(1, 0),
                                                Eigen::Vector2i(0, -1), Eigen::Vector2i(0, 1)};
  for (size_t head = 0; head < front.size(); ++head) {
    if (head % kColumnsBetweenPolls == 0 && cancelled.Requested()) return false;
    const Eigen::Vector2i at = At(front[head]);
    for (const Eigen::Vector2i& step : steps) {
      const Eigen::Vector2i to = at + step;
      if (!Inside(to) || !std::isnan(height_[Column(to)])) continue;
      height_[Column(to)] = height_[front[head]];
      front.push_back(Column(to));
    }
  }
  return true;
}

}  // namespace vantage::planning

// A horizontal section through a storey at the height of a head: where walls stand, and little else
// (algorithm.md section 7D).
#ifndef VANTAGE_CORE_PLANNING_OPENINGS_STOREY_SECTION_H_
#define VANTAGE_CORE_PLANNING_OPENINGS_STOREY_SECTION_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/planning/feasibility/floor_map.h"

namespace vantage::planning {

// The section's height over the floor, m. Its upper end is how high people and scanners are
// (PlanningConfig::scanner_height); doors are higher, most furniture ends below.
inline constexpr double kSectionLow = 1.4;
inline constexpr double kSectionHigh = 1.8;

// Columns that are looked at between two looks at whether to go on.
inline constexpr uint32_t kColumnsBetweenPolls = 4096;

enum class SectionState : uint8_t { kUnknown, kFree, kSolid };

// By column of voxels of the model's bounds, in the order of FloorColumns.
class StoreySection {
 public:
  // Of the storey with this number. Where it has no floor in a column, the height is that of the
  // nearest floor that it has. The floor was found in the model. Nothing when cancelled on the way.
  static std::optional<StoreySection> Of(const model::PlanningView& model, const FloorMap& floor,
                                         int storey, const parallel::Cancellation& cancelled);

  const Eigen::Vector2i& size() const { return size_; }
  size_t columns() const { return state_.size(); }
  bool Inside(const Eigen::Vector2i& at) const {
    return (at.array() >= 0).all() && (at.array() < size_.array()).all();
  }
  // Columns are counted from the corner of the model's bounds.
  uint32_t Column(const Eigen::Vector2i& at) const {
    return static_cast<uint32_t>(at.x() + size_.x() * at.y());
  }
  Eigen::Vector2i At(uint32_t column) const {
    return {static_cast<int>(column) % size_.x(), static_cast<int>(column) / size_.x()};
  }
  SectionState State(uint32_t column) const { return state_[column]; }
  // z of the floor, m; NaN in all columns when the storey has none.
  float FloorHeight(uint32_t column) const { return height_[column]; }
  // False where the height is that of floor nearby.
  bool HasFloor(uint32_t column) const { return has_floor_[column] != 0; }

 private:
  explicit StoreySection(const Eigen::Vector2i& size) : size_(size) {}
  // False when cancelled on the way.
  bool FindHeights(const FloorMap& floor, int storey, const parallel::Cancellation& cancelled);

  Eigen::Vector2i size_;
  std::vector<float> height_;
  std::vector<uint8_t> has_floor_;
  std::vector<SectionState> state_;
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_OPENINGS_STOREY_SECTION_H_

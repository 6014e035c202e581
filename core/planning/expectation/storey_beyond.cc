#include "core/planning/expectation/storey_beyond.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_set.h"

namespace vantage::planning {
namespace {

constexpr double kHallReach = 4.0;    // m around the end of the stairs: what is seen from there
constexpr double kStairsReach = 1.2;  // m around it that belong to the stairs
constexpr double kBodyHeight = 1.0;   // m over a floor: free in rooms and over stairs, not in walls
constexpr double kHallHeight = 2.5;   // m from floor to ceiling
constexpr double kInSlab = 0.1;       // m over a ceiling: nothing is free there but stairwells
constexpr double kFloorVaries = 0.3;  // m, that the floor of a storey varies

const std::array<Eigen::Vector2i, 4> kNeighbours = {Eigen::Vector2i(-1, 0), Eigen::Vector2i(1, 0),
                                                    Eigen::Vector2i(0, -1), Eigen::Vector2i(0, 1)};

using HallColumn = std::pair<int, int>;

class StoreyBeyond {
 public:
  StoreyBeyond(const model::PlanningView& model, const FloorMap& floor, const Flight& flight)
      : model_(model), floor_(floor), flight_(flight), voxel_(model.voxel_size()) {}

  void Apply(BrickEdit& edit) const {
    const std::vector<Eigen::Vector2i> columns = Spread();
    absl::flat_hash_set<HallColumn> in_hall;
    for (const Eigen::Vector2i& at : columns) in_hall.emplace(at.x(), at.y());
    const int low = Layer(flight_.other_floor);
    const int high = Layer(flight_.other_floor + kHallHeight);
    for (const Eigen::Vector2i& at : columns) {
      const bool open = OpenToStairs(at);
      for (int z = low + 1; z < high; ++z) edit.EmptyUnknown({at.x(), at.y(), z});
      if (open) {
        const double lower = std::min(flight_.other_floor, flight_.storey_floor);
        const double upper = std::max(flight_.other_floor, flight_.storey_floor);
        for (int z = Layer(lower + kHallHeight); z <= Layer(upper); ++z) {
          edit.EmptyUnknown({at.x(), at.y(), z});
        }
      }
      if (!open || !flight_.up()) {
        edit.CloseUnknown({at.x(), at.y(), low}, {0, 0, 1}, flight_.other_floor);
      }
      if (!open || flight_.up()) edit.CloseUnknown({at.x(), at.y(), high}, {0, 0, -1});
      for (const Eigen::Vector2i& side : kNeighbours) {
        const Eigen::Vector2i to = at + side;
        if (in_hall.contains({to.x(), to.y()})) continue;
        for (int z = low + 1; z < high; ++z) {
          edit.CloseUnknown({to.x(), to.y(), z}, {-side.x(), -side.y(), 0});
        }
      }
    }
  }

 private:
  int Layer(double z) const { return static_cast<int>(std::floor(z / voxel_)); }
  double Away(const Eigen::Vector2i& at) const {
    return ((at.cast<double>().array() + 0.5).matrix() * voxel_ - flight_.end.head<2>()).norm();
  }
  // Free at the height of a body on the storey that is known: in a room, a hall or over the stairs.
  bool Indoors(const Eigen::Vector2i& at) const {
    return model_.Empty({at.x(), at.y(), Layer(flight_.storey_floor + kBodyHeight)});
  }
  // The upper one of the two floors has a hole there.
  bool OpenToStairs(const Eigen::Vector2i& at) const {
    if (flight_.up()) {
      return model_.Empty({at.x(), at.y(), Layer(flight_.storey_floor + kHallHeight + kInSlab)});
    }
    return !floor_.columns().Inside(at.x(), at.y()) ||
           floor_.columns().Near(at.x(), at.y(), static_cast<float>(flight_.storey_floor),
                                 kFloorVaries) == nullptr;
  }
  // The columns of the hall, from the stairs on.
  std::vector<Eigen::Vector2i> Spread() const {
    std::vector<Eigen::Vector2i> columns;
    absl::flat_hash_set<HallColumn> seen;
    const auto visit = [&](const Eigen::Vector2i& at) {
      if (Away(at) > kHallReach || !Indoors(at) || !seen.emplace(at.x(), at.y()).second) return;
      columns.push_back(at);
    };
    const Eigen::Vector2i middle = model_.At(flight_.end).head<2>();
    const int near = static_cast<int>(std::lround(kStairsReach / voxel_));
    for (int y = -near; y <= near; ++y) {
      for (int x = -near; x <= near; ++x) {
        const Eigen::Vector2i at = middle + Eigen::Vector2i(x, y);
        if (Away(at) <= kStairsReach) visit(at);
      }
    }
    for (size_t head = 0; head < columns.size(); ++head) {
      for (const Eigen::Vector2i& side : kNeighbours) visit(columns[head] + side);
    }
    return columns;
  }

  const model::PlanningView& model_;
  const FloorMap& floor_;
  const Flight& flight_;
  const double voxel_;
};

}  // namespace

void ExpectStorey(const model::PlanningView& model, const FloorMap& floor, const Flight& flight,
                  BrickEdit& edit) {
  StoreyBeyond(model, floor, flight).Apply(edit);
}

}  // namespace vantage::planning

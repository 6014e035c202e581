// The floor: its height under every column of voxels (algorithm.md section 7A).
#ifndef VANTAGE_CORE_PLANNING_FEASIBILITY_FLOOR_HEIGHTS_H_
#define VANTAGE_CORE_PLANNING_FEASIBILITY_FLOOR_HEIGHTS_H_

#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"

namespace vantage::planning {

// Finds the floor in measured surface that faces up, and interpolates between measured pieces; the
// rules are in algorithm.md section 7A, 'The floor'.
class FloorHeights {
 public:
  // The largest step between neighbouring pieces of one floor, m.
  static constexpr double kMaxStep = 0.20;

  // `given`: z of the floor everywhere, m; when absent the floor is found from the model. CANCELLED
  // when that was requested on the way.
  static absl::StatusOr<FloorHeights> Find(const model::PlanningView& model,
                                           std::optional<double> given,
                                           const parallel::Cancellation& cancelled = {});

  // z of the floor under the voxel column (x, y), m; NaN where none is known.
  float Height(int x, int y) const {
    if (x < min_x_ || y < min_y_ || x >= min_x_ + size_x_ || y >= min_y_ + size_y_) {
      return std::numeric_limits<float>::quiet_NaN();
    }
    return height_[Index(x, y)];
  }

  bool found() const { return found_; }
  // Lowest and highest z of the measured floor (or the given z), m; NaN when there is none.
  float lowest() const { return lowest_; }
  float highest() const { return highest_; }

 private:
  struct Piece;
  bool Measure(const model::PlanningView& model, const parallel::Cancellation& cancelled);
  size_t Index(int x, int y) const {
    return static_cast<size_t>(x - min_x_) +
           static_cast<size_t>(size_x_) * static_cast<size_t>(y - min_y_);
  }
  std::vector<Piece> FindPieces(const std::vector<float>& candidate, double voxel,
                                const parallel::Cancellation& cancelled) const;
  void KeepFloors(const model::PlanningView& model, const std::vector<float>& candidate,
                  std::vector<Piece> pieces, const parallel::Cancellation& cancelled);
  void SeedStations(const model::PlanningView& model);
  void Interpolate(double reach, double voxel, const parallel::Cancellation& cancelled);

  int min_x_ = 0, min_y_ = 0, size_x_ = 0, size_y_ = 0;  // voxel columns
  std::vector<float> height_;
  bool found_ = false;
  float lowest_ = std::numeric_limits<float>::quiet_NaN();
  float highest_ = std::numeric_limits<float>::quiet_NaN();
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_FEASIBILITY_FLOOR_HEIGHTS_H_

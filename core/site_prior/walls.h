// The walls of a model, and those of a prior, over most furniture: what both are compared by.
#ifndef VANTAGE_CORE_SITE_PRIOR_WALLS_H_
#define VANTAGE_CORE_SITE_PRIOR_WALLS_H_

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/model/view/planning_view.h"

namespace vantage::site_prior {

// A piece of upright surface.
struct WallPoint {
  Eigen::Vector3d at = Eigen::Vector3d::Zero();      // m
  Eigen::Vector2d normal = Eigen::Vector2d::Zero();  // unit, towards the room
  double area = 0;                                   // m2
};

// The floors that scanners stood on.
class Floors {
 public:
  explicit Floors(const model::PlanningView& model);
  // z of the floor that a place lies over; nothing where no scanner stood lower.
  std::optional<double> Under(double z) const;

 private:
  std::vector<double> heights_;  // m, each once, the lowest first
};

// Over furniture, and under what hangs high: m over the floor.
inline constexpr double kWallsFrom = 1.8;
inline constexpr double kWallsTo = 3.2;

// Measured walls between kWallsFrom and kWallsTo, thinned to about `most` points, each of which
// stands for the area of those left out.
std::vector<WallPoint> MeasuredWalls(const model::PlanningView& model, size_t most);

// Whether a prior's or a model's surface is upright.
inline bool IsUpright(const Eigen::Vector3f& normal) { return std::abs(normal.z()) < 0.3F; }

// Upright surface of a prior by place and by where it faces, in its own frame: the nearest in plan
// at the same height. The two sides of a wall are told apart.
class WallField {
 public:
  static constexpr double kReach = 0.5;  // m: farther away there is none

  // Bytes of one within a box of such sizes, m.
  static uint64_t Estimate(const Eigen::Vector3d& sizes);
  // Of SpaceOf() the prior in its own frame, within `box`.
  WallField(const model::PlanningView& space, const Eigen::AlignedBox3d& box);

  struct Nearest {
    double along = 0;  // m: along its normal
    double away = 0;   // m
    Eigen::Vector2d normal = Eigen::Vector2d::Zero();
  };
  // Of surface that faces as `normal` does, within 60 degrees.
  std::optional<Nearest> At(const Eigen::Vector3d& p, const Eigen::Vector2d& normal) const;
  // Which of the four ways, along the axes, a normal points most.
  static size_t WayOf(const Eigen::Vector2d& normal) {
    if (std::abs(normal.x()) >= std::abs(normal.y())) return normal.x() >= 0 ? 0 : 1;
    return normal.y() >= 0 ? 2 : 3;
  }
  // m; kReach where there is none.
  double AwayAt(const Eigen::Vector3d& p, size_t way) const {
    const std::optional<size_t> cell = CellOf(p);
    return cell.has_value() ? static_cast<double>(away_[4 * *cell + way]) * 0.01 : kReach;
  }
  // One point for each cell with wall in it.
  const std::vector<WallPoint>& points() const { return points_; }

 private:
  std::optional<size_t> CellOf(const Eigen::Vector3d& p) const;

  double cell_ = 0.1;   // m, in plan
  double layer_ = 0.4;  // m, in height
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  Eigen::Vector3i size_ = Eigen::Vector3i::Zero();
  std::vector<uint8_t> away_;      // cm, by z, y, x, way
  std::vector<uint32_t> nearest_;  // of points_
  std::vector<WallPoint> points_;
};

}  // namespace vantage::site_prior

#endif  // VANTAGE_CORE_SITE_PRIOR_WALLS_H_

// Which surface can be brought to the required density from where a person could stand
// (algorithm.md section 7F): coverage counts no other.
#ifndef VANTAGE_CORE_PLANNING_OPENINGS_STANDING_REACH_H_
#define VANTAGE_CORE_PLANNING_OPENINGS_STANDING_REACH_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/planning/feasibility/floor_map.h"
#include "core/planning/plan/planning_config.h"
#include "core/sensor/scanner_model.h"

namespace vantage::planning {

// Has() errs on the side of what can be reached: all known floor counts, whether the scanner fits
// there or not, occlusion is left out, and distances and angles are taken at their best within half
// the diagonal of a cell of a metre and half that of a brick. So no scan from known floor would
// bring to D what is excluded: roofs seen from the street, and the upright borders of what houses
// hide, beyond where the ground ends. Surface that can only be reached from floor that is not known
// yet is left out until that floor is known.
class StandingReach {
 public:
  // `scanners`: any of them may measure it. Nothing when cancelled on the way. Without any floor,
  // or any scanner, everything is within reach.
  static std::optional<StandingReach> Of(const model::PlanningView& model, const FloorMap& floor,
                                         std::span<const sensor::ScannerModel> scanners,
                                         const PlanningConfig& config,
                                         const parallel::Cancellation& cancelled);

  // True where a scan may measure a surface voxel at `density` (samples / m^2).
  bool Has(const model::VoxelIndex& voxel, const model::SurfaceVoxel& surface, double density);

  // Of what Has() says: true where one of the places, at the least or the greatest height, also
  // sees the surface: what was measured does not lie between. Up to kMostPlaces of them are asked,
  // once for the voxels of a cube of two. The model outlives this.
  bool Sees(const model::VoxelIndex& voxel, const model::SurfaceVoxel& surface, double density);

 private:
  static constexpr size_t kMostPlaces = 128;

  StandingReach(const model::PlanningView& model, std::span<const sensor::ScannerModel> scanners,
                const PlanningConfig& config);

  // What places and voxels may be off from where they are taken to be.
  struct Slack {
    double distance = 0;  // m
    double sine = 0;      // of what normals may be off
    double cosine = 1;
  };
  struct Instrument {
    sensor::ScannerModel model;
    double cos_max_incidence = 0;
  };

  // A cell of the grid of places, by its floors' heights, m.
  using Heights = std::vector<float>;

  size_t Index(const Eigen::Vector2i& cell) const {
    return static_cast<size_t>(cell.x()) +
           static_cast<size_t>(size_.x()) * static_cast<size_t>(cell.y());
  }
  const Heights& At(const Eigen::Vector2i& cell) const { return floors_[Index(cell)]; }
  Slack OfBrick() const;
  // Calls fn(place, instrument) for those from which the scanner may measure it, until that returns
  // true; then returns true. `heights`: of viewpoints, m over the floor. `within`: m in plan.
  template <typename Fn>
  bool AnyPlace(const Eigen::Vector3d& centre, const Eigen::Vector3d& normal, double density,
                std::span<const double> heights, double within, Fn&& fn) const;
  static bool MeasuredFrom(const Eigen::Vector3d& place, const Instrument& instrument,
                           const Eigen::Vector3d& centre, const Eigen::Vector3d& normal,
                           double density, const Slack& slack);

  const model::PlanningView& model_;
  std::vector<Instrument> instruments_;
  std::vector<double> heights_;  // of viewpoints that are tried, m over the floor
  double voxel_size_ = 0;
  Eigen::Vector2i first_ = Eigen::Vector2i::Zero();
  Eigen::Vector2i size_ = Eigen::Vector2i::Zero();
  std::vector<Heights> floors_;  // by cell; no cells: there is no floor
  // By brick, direction of the normal and density: the same for all its voxels that face alike.
  struct Asked {
    uint64_t brick;
    int direction;
    double density;
    bool operator==(const Asked&) const = default;
    template <typename H>
    friend H AbslHashValue(H hash, const Asked& asked) {
      return H::combine(std::move(hash), asked.brick, asked.direction, asked.density);
    }
  };
  absl::flat_hash_map<Asked, bool> known_;
  // Where those are that may see what is asked for, and with which instrument; the last that did
  // comes first. By the same.
  struct Place {
    Eigen::Vector3d at;  // m
    size_t instrument = 0;
  };
  absl::flat_hash_map<Asked, std::vector<Place>> places_;
  absl::flat_hash_map<Asked, bool> seen_;  // by cubes of two voxels instead of bricks
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_OPENINGS_STANDING_REACH_H_

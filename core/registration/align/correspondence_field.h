// The nearest surface with a similar normal, for every place at once: the first stage of an
// alignment takes one look-up per sample, so that many starts can be tried.
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_CORRESPONDENCE_FIELD_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_CORRESPONDENCE_FIELD_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"

namespace vantage::registration {

// An oriented piece of the model's true surface.
struct SurfaceElement {
  Eigen::Vector3f centroid;  // m, world
  Eigen::Vector3f normal;    // unit, world, towards the empty side
  float samples = 0;         // measured samples that the centroid rests on; 0: interpolated
};

class CorrespondenceField {
 public:
  // 24 bytes a cell. Around a scan: up to 12 x 12 x 10 m the cell stays two voxels of 5 cm wide,
  // over a storey of 1000 m2 and 3 m it is 13 cm. All over a site: 20 cm over 10,000 m2 and 3.5 m.
  // Both have to stay well below the first stage's reach.
  static constexpr double kCellsAroundScan = 1.5e6;
  static constexpr double kCellsAllOver = 4e6;

  // Covers `box` (m, world) out to `reach` (m) from any true surface in it. The cell is two voxels,
  // or as much more as keeps the field to `most_cells`.
  CorrespondenceField(const model::PlanningView& model, const Eigen::AlignedBox3d& box,
                      double reach, parallel::Parallel& parallel,
                      double most_cells = kCellsAroundScan);

  // The element (nearly) nearest to `point` among those whose normal is roughly like `normal`
  // (the caller tests by how much); null when there is none within reach.
  const SurfaceElement* Nearest(const Eigen::Vector3f& point, const Eigen::Vector3f& normal) const {
    const Eigen::Array3i cell = ((point - origin_).array() * inverse_cell_).floor().cast<int>();
    if ((cell < 0).any() || (cell >= size_).any()) return nullptr;
    const int32_t element = nearest_[DominantDirection(normal)][Flat(cell)];
    return element < 0 ? nullptr : &elements_[static_cast<size_t>(element)];
  }

  // Of true surface in the box; what is nearest to no cell's centre is not kept.
  size_t elements() const { return count_; }

 private:
  static constexpr int kDirections = 6;
  static int DominantDirection(const Eigen::Vector3f& normal) {
    int axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    return 2 * axis + (normal[axis] < 0 ? 1 : 0);
  }
  size_t Flat(const Eigen::Array3i& cell) const {
    return static_cast<size_t>(cell.x()) +
           static_cast<size_t>(size_.x()) *
               (static_cast<size_t>(cell.y()) +
                static_cast<size_t>(size_.y()) * static_cast<size_t>(cell.z()));
  }
  Eigen::Vector3f CentreOf(const Eigen::Array3i& cell) const {
    return origin_ + ((cell.cast<float>() + 0.5f) * cell_).matrix();
  }
  using Cells = std::vector<Eigen::Array3i>;
  // Cells that hold elements keep the one nearest to their centre, for each direction that it
  // serves. Appends cells that held none to `fronts`.
  void Keep(const SurfaceElement& element, std::array<Cells, kDirections>& fronts);
  // From cells that hold an element outwards.
  void Grow(int direction, double reach, Cells front);

  Eigen::Vector3f origin_ = Eigen::Vector3f::Zero();
  float cell_ = 0;
  float inverse_cell_ = 0;
  Eigen::Array3i size_ = Eigen::Array3i::Zero();
  size_t count_ = 0;
  std::vector<SurfaceElement> elements_;  // of cells, by direction
  std::array<std::vector<int32_t>, kDirections> nearest_;
};

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_CORRESPONDENCE_FIELD_H_

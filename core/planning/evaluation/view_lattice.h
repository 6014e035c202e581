// Viewcells as a lattice, the coarsest level first: wherever it is cut, the views are spread over
// all feasible space.
#ifndef VANTAGE_CORE_PLANNING_EVALUATION_VIEW_LATTICE_H_
#define VANTAGE_CORE_PLANNING_EVALUATION_VIEW_LATTICE_H_

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace vantage::planning {

// Where the lattice lies and the order within a level depend on the seed: what a lattice happens to
// hit is luck otherwise.
class ViewLattice {
 public:
  static constexpr int kCoarsest = 6;  // 2^6 viewcells wide

  ViewLattice(std::span<const Eigen::Vector3i> cells, uint64_t seed);

  // The index of the next cell; nothing when all were given. Levels are put in order as far as they
  // are asked for: a brief plan sees a few hundred of a hundred thousand views.
  std::optional<uint32_t> Next();
  // The coarsest level that a cell is on, 0 to kCoarsest: neighbours there are 2^level apart.
  int Level(const Eigen::Vector3i& cell) const;

 private:
  uint64_t seed_;
  Eigen::Vector3i origin_;  // viewcells
  // By level, and of each a heap once it is its turn: random key and index.
  std::array<std::vector<std::pair<double, uint32_t>>, kCoarsest + 1> levels_;
  int level_ = kCoarsest + 1;  // that is a heap
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EVALUATION_VIEW_LATTICE_H_

// An order of the viewcells by lattices, the coarsest first: any first part of it is spread over
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

// The seed decides the origin of the lattice and the order within a level, so that no fixed grid
// favours some rooms over others.
class ViewLattice {
 public:
  static constexpr int kCoarsest = 6;  // 2^6 viewcells wide

  ViewLattice(std::span<const Eigen::Vector3i> cells, uint64_t seed);

  // The index of the next cell; nothing after the last. A level is sorted only as far as it is
  // asked for, since a brief plan looks at a few hundred of a hundred thousand views.
  std::optional<uint32_t> Next();
  // The coarsest level that a cell is on, 0 to kCoarsest: neighbours there are 2^level apart.
  int Level(const Eigen::Vector3i& cell) const;

 private:
  uint64_t seed_;
  Eigen::Vector3i origin_;  // viewcells
  // By level: random key and index of its cells, made a heap when the level's turn comes.
  std::array<std::vector<std::pair<double, uint32_t>>, kCoarsest + 1> levels_;
  int level_ = kCoarsest + 1;  // the level that is a heap now
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EVALUATION_VIEW_LATTICE_H_

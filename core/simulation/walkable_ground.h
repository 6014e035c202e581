// The ground of a scene with floors over one another, stairs and slopes, as somebody finds it who
// walks through it with a tripod. Only the simulation knows it.
#ifndef VANTAGE_CORE_SIMULATION_WALKABLE_GROUND_H_
#define VANTAGE_CORE_SIMULATION_WALKABLE_GROUND_H_

#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <vector>

#include "core/simulation/simulated_scanner.h"

namespace vantage::simulation {

// What can be walked to from a start: steps of at most 0.21 m from one lattice point to the next,
// with room for somebody of 0.6 m x 1.7 m above knee height.
class WalkableGround {
 public:
  static constexpr double kSpacing = 0.1;  // m, of the lattice

  // A lattice point and the height of the ground there. Several may lie over one another.
  struct Place {
    int column;
    int row;
    double height;  // m, scene frame
  };

  // `start` (m, scene frame) is above the ground from which all ways lead.
  WalkableGround(const SimulatedScanner& tracer, const Eigen::AlignedBox3d& bounds,
                 const Eigen::Vector3d& start);

  const std::vector<Place>& places() const { return places_; }
  Eigen::Vector3d At(size_t place) const;  // m, on the ground
  // The places next to one, along and across the lattice, that one step leads to.
  std::vector<size_t> Around(size_t place) const;

  // Where a tripod can stand: a lattice of `spacing` in plan, `height` above ground whose slope (at
  // most one in four) and relief (5 cm) its legs even out, and free within `clearance` from there
  // up to the viewpoint. m, scene frame, viewpoints, lower ones first where several are over one
  // another.
  std::vector<Eigen::Vector3d> Stations(double height, double clearance, double spacing) const;

 private:
  std::optional<double> GroundBelow(const Eigen::Vector2d& at, double from) const;
  bool HasRoom(const Eigen::Vector2d& at, double ground) const;
  std::optional<size_t> Lookup(int column, int row, double height) const;
  void Reach(int column, int row, double from);

  const SimulatedScanner& tracer_;
  Eigen::AlignedBox3d bounds_;
  int columns_;
  int rows_;
  std::vector<Place> places_;
  std::vector<std::vector<size_t>> index_;  // by lattice point, into places_
};

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_WALKABLE_GROUND_H_

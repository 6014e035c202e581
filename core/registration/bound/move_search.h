// Moves of a scan at which what it shows may fit as well as where it is (algorithm.md section 9,
// 'Prediction').
#ifndef VANTAGE_CORE_REGISTRATION_BOUND_MOVE_SEARCH_H_
#define VANTAGE_CORE_REGISTRATION_BOUND_MOVE_SEARCH_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "core/registration/align/scan_surface.h"
#include "core/registration/align/voxel_search.h"
#include "core/registration/bound/coarse_surface.h"

namespace vantage::registration {

// Across the floor, up or down, and about the vertical through the scanner.
struct ScanMove {
  Eigen::Vector3d by = Eigen::Vector3d::Zero();  // m, world
  double turn = 0;                               // rad
  double fits = 0;                               // share of the samples that were asked, [0, 1]
};
Eigen::Isometry3d Moved(const Eigen::Vector3d& position, const ScanMove& move);

// m: within it what does not notice a move holds a scan as well as what does, and a move may be on
// its way back to where the scan is.
inline constexpr double kNearMove = 0.65;

// How far a scan may have been made from where it is taken to be.
struct MoveReach {
  double shift = 0;  // m, across the floor
  double rise = 0;   // m, up or down
  double turn = 0;   // rad
};

// Shifts are on a lattice of kShiftStep, out to the reach that is asked for. Squares of up to 16 x
// 16 of them are ruled out at once where too few samples may lie on surface at any (branch and
// bound), so that a large reach costs little where the model is small, or unlike itself.
class MoveSearch {
 public:
  // Between shifts that are tried, voxels: from the one nearest to a twin a wall's samples still
  // find its voxels (kWidestReach), as the middle of four is 2.1 voxels away.
  static constexpr int kShiftStep = 3;

  // Keeps the references. `samples`: relative to `position` (m, world), axes as the world's,
  // spread (SpreadSamples()).
  MoveSearch(const VoxelSearch& search, const CoarseSurface& coarse,
             std::span<const SurfaceSample> samples, const Eigen::Vector3d& position)
      : search_(search), coarse_(coarse), samples_(samples), position_(position) {}

  // Where what notices a move is held, within `reach`: shifts; shifts with a rise, as on stairs and
  // from storey to storey; and shifts with a turn by more than kLeastTwinTurn. The best of their
  // neighbours, a few of each of the three, best first.
  std::vector<ScanMove> Twins(const MoveReach& reach) const;

 private:
  struct Asked;  // samples, moved
  // The twins with one rise and turn.
  std::vector<ScanMove> With(double shift, double rise, double turn) const;
  // Whether enough of what is level is at such heights again, somewhere.
  bool MayRise(double rise) const;
  // Those of `moves` that are held, the best of their neighbours.
  std::vector<ScanMove> HeldOf(std::vector<ScanMove> moves) const;
  // The share of what notices a square of shifts that may be held at one of them, at most, but for
  // chance; 1 where too little does.
  double MayBeHeld(const Asked& asked, int level, int x, int y) const;
  // Of the samples that notice a move, of a near one of all; 0 when it is not worth a look.
  double Held(const ScanMove& move) const;

  const VoxelSearch& search_;
  const CoarseSurface& coarse_;
  std::span<const SurfaceSample> samples_;
  const Eigen::Vector3d& position_;
};

// Sites do not repeat themselves by less: a twelfth of a turn.
inline constexpr double kLeastTwinTurn = 0.5;  // rad

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_BOUND_MOVE_SEARCH_H_

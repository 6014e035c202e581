#include "core/registration/align/prior_search.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/registration/align/floor_plane.h"
#include "core/registration/align/lattice_search.h"
#include "core/registration/align/scanner_heights.h"

namespace vantage::registration {
namespace {

constexpr size_t kPlacesAround =
    16;  // beside the starts at the prior, each an alignment's first stage
// m: whoever knows less knows nothing, and is served as well without a prior.
constexpr double kMostShift = 200;
// Candidates, since every scan is aligned from a prior: with headings to 15 degrees 60 m around,
// with all headings 18 m; a fifth of a second.
constexpr size_t kMostAround = 500'000;

}  // namespace

PriorReach ReachOf(const sensor::PosePrior& prior) {
  PriorReach reach;
  if (!prior.covariance.has_value()) return reach;
  const sensor::Matrix6d& covariance = *prior.covariance;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> horizontal(covariance.block<2, 2>(3, 3));
  const auto sigmas = [](double variance, double most) {
    return std::min(kSigmasOfPrior * std::sqrt(std::max(0.0, variance)), most);
  };
  reach.shift = sigmas(horizontal.eigenvalues()[1], kMostShift);
  reach.rise = sigmas(covariance(5, 5), kMostShift);
  reach.turn = sigmas(covariance(2, 2), sensor::kPi);
  return reach;
}

std::vector<Eigen::Isometry3d> SearchAroundPrior(const model::PlanningView& model,
                                                 const CorrespondenceField& field,
                                                 const ScanSurface& surface, double spacing,
                                                 const sensor::PosePrior& prior,
                                                 parallel::Parallel& parallel) {
  const PriorReach reach = ReachOf(prior);
  if (surface.samples.size() < Lattice::kFewestSamples) return {};
  const Eigen::Vector3d at = prior.T_world_scan.translation();
  Lattice lattice;
  lattice.upright = prior.T_world_scan.linear();
  lattice.heights = {at.z()};
  if (reach.rise > kHeightOverStation) {
    FloorPlane floor;
    const bool found = FindFloorPlane(surface.samples, spacing, kMaxTilt, floor);
    for (const double z : ScannerHeights(model, found ? &floor : nullptr)) {
      if (std::abs(z - at.z()) <= reach.rise) lattice.heights.push_back(z);
    }
  }
  // All that the prior allows, or as much of it around its middle as is not too much work.
  for (int heading = 0; heading < Lattice::kHeadings; ++heading) {
    const double turn =
        2 * sensor::kPi * std::min(heading, Lattice::kHeadings - heading) / Lattice::kHeadings;
    if (turn <= reach.turn + 1e-9) lattice.headings.push_back(heading);
  }
  const size_t each = lattice.heights.size() * lattice.headings.size();
  const double most = static_cast<double>(kMostAround) / static_cast<double>(each);
  const double radius = std::min(reach.shift, Lattice::kPlaceStep * std::sqrt(most / sensor::kPi));
  const int steps = static_cast<int>(radius / Lattice::kPlaceStep);
  for (int y = -steps; y <= steps; ++y) {
    for (int x = -steps; x <= steps; ++x) {
      const Eigen::Vector2d shift = Lattice::kPlaceStep * Eigen::Vector2d(x, y);
      if (shift.norm() <= radius) lattice.places.push_back(at.head<2>() + shift);
    }
  }
  return SearchLattice(model, field, surface, lattice, kPlacesAround, parallel);
}

}  // namespace vantage::registration

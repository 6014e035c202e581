#include "core/registration/align/prior_search.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/registration/align/floor_plane.h"
#include "core/registration/align/lattice_search.h"
#include "core/registration/align/scanner_heights.h"

namespace vantage::registration {
namespace {

// Beside the starts at the prior, each an alignment's first stage. Where the reach is wide a site
// may repeat itself in it more often: one in so many places of the lattice then, if they are as
// good.
constexpr size_t kPlacesAround = 16;
constexpr size_t kMostPlacesAround = 160;
constexpr size_t kPlacesToOne = 12;
// m: whoever knows less knows nothing, and is served as well without a prior.
constexpr double kMostShift = 200;
// Candidates: with headings to 15 degrees 170 m around, with all headings 50 m; a second and a
// half.
constexpr size_t kMostAround = 4'000'000;

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

PriorSearch SearchAroundPrior(const model::PlanningView& model, const CorrespondenceField& field,
                              const ScanSurface& surface, double spacing,
                              const sensor::PosePrior& prior, parallel::Parallel& parallel) {
  const PriorReach reach = ReachOf(prior);
  PriorSearch search;
  search.radius = reach.shift;
  if (surface.samples.size() < Lattice::kFewestSamples) return search;
  const Eigen::Vector3d at = prior.T_world_scan.translation();
  Lattice lattice;
  lattice.upright = prior.T_world_scan.linear();
  std::vector<double> heights = {at.z()};
  if (reach.rise > kHeightOverStation) {
    FloorPlane floor;
    const bool found = FindFloorPlane(surface.samples, spacing, kMaxTilt, floor);
    for (const ScannerHeight& height : ScannerHeights(model, found ? &floor : nullptr)) {
      if (std::abs(height.z() - at.z()) <= reach.rise) heights.push_back(height.z());
    }
  }
  // All that the prior allows, or as much of it around its middle as is not too much work.
  for (int heading = 0; heading < Lattice::kHeadings; ++heading) {
    const double turn =
        2 * sensor::kPi * std::min(heading, Lattice::kHeadings - heading) / Lattice::kHeadings;
    if (turn <= reach.turn + 1e-9) lattice.headings.push_back(heading);
  }
  const size_t each = heights.size() * lattice.headings.size();
  const double most = static_cast<double>(kMostAround) / static_cast<double>(each);
  search.radius = std::min(reach.shift, Lattice::kPlaceStep * std::sqrt(most / sensor::kPi));
  search.whole = search.radius >= reach.shift && reach.shift < kMostShift;
  const int steps = static_cast<int>(search.radius / Lattice::kPlaceStep);
  for (const double z : heights) {
    for (int y = -steps; y <= steps; ++y) {
      for (int x = -steps; x <= steps; ++x) {
        const Eigen::Vector2d shift = Lattice::kPlaceStep * Eigen::Vector2d(x, y);
        if (shift.norm() > search.radius) continue;
        lattice.places.emplace_back(at.x() + shift.x(), at.y() + shift.y(), z);
      }
    }
  }
  const LatticeWish wish = {kPlacesAround, std::clamp(lattice.places.size() / kPlacesToOne,
                                                      kPlacesAround, kMostPlacesAround)};
  LatticeFinds finds = SearchLattice(model, field, surface, lattice, wish, parallel);
  search.places = std::move(finds.poses);
  search.more_places = finds.more && wish.most > kPlacesAround;
  return search;
}

}  // namespace vantage::registration

#include "core/registration/align/global_search.h"

#include <Eigen/Core>
#include <cmath>
#include <numeric>

#include "absl/strings/str_format.h"
#include "core/registration/align/floor_plane.h"
#include "core/registration/align/lattice_search.h"
#include "core/registration/align/scanner_heights.h"
#include "core/sensor/scanner_model.h"

namespace vantage::registration {
namespace {

constexpr size_t kPlaces = 160;  // places from which alignments start
// Five seconds on two cores: 10,000 m2 with three heights.
constexpr size_t kMostCandidates = 16'000'000;
// m: a scanner stands where space is known, or this far beyond it, in a doorway or the next room.
constexpr double kBeyondKnown = 3.0;

// Whether space is known to be empty at one of the heights, at the place or around it.
bool NearKnown(const model::PlanningView& model, const Eigen::Vector2d& place,
               const std::vector<double>& heights) {
  constexpr int kAround = 8;
  for (const double z : heights) {
    for (const double away : {0.0, 0.5 * kBeyondKnown, kBeyondKnown}) {
      for (int k = 0; k < (away > 0 ? kAround : 1); ++k) {
        const double angle = 2 * sensor::kPi * k / kAround;
        if (model.Empty(model.At(
                {place.x() + away * std::cos(angle), place.y() + away * std::sin(angle), z}))) {
          return true;
        }
      }
    }
  }
  return false;
}

}  // namespace

GlobalSearch SearchGlobally(const model::PlanningView& model, const CorrespondenceField& field,
                            const ScanSurface& surface, double spacing,
                            parallel::Parallel& parallel) {
  GlobalSearch search;
  FloorPlane floor;
  search.floor_found = FindFloorPlane(surface.samples, spacing, kMaxTilt, floor);
  Lattice lattice;
  if (search.floor_found) {
    lattice.upright = Eigen::Quaterniond::FromTwoVectors(floor.normal, Eigen::Vector3d::UnitZ())
                          .toRotationMatrix();
  }
  lattice.heights = ScannerHeights(model, search.floor_found ? &floor : nullptr);
  // A scanner stands where space is known, or a step beyond: in a doorway, in the next room.
  const double h = model.voxel_size();
  const Eigen::Vector2d low = model.bounds().min.cast<double>().head<2>() * h;
  const Eigen::Vector2d size = model.bounds().max.cast<double>().head<2>() * h - low;
  const int columns = static_cast<int>(size.x() / Lattice::kPlaceStep) + 1;
  const int rows = static_cast<int>(size.y() / Lattice::kPlaceStep) + 1;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const Eigen::Vector2d place(low.x() + (column + 0.5) * Lattice::kPlaceStep,
                                  low.y() + (row + 0.5) * Lattice::kPlaceStep);
      if (NearKnown(model, place, lattice.heights)) lattice.places.push_back(place);
    }
  }
  lattice.headings.resize(Lattice::kHeadings);
  std::iota(lattice.headings.begin(), lattice.headings.end(), 0);
  if (lattice.size() > kMostCandidates) {
    search.why_not =
        absl::StrFormat("the site (%.0f x %.0f m) is too large to be searched", size.x(), size.y());
    return search;
  }
  if (lattice.size() == 0 || surface.samples.size() < Lattice::kFewestSamples) {
    search.why_not = "too little surface to look for its place";
    return search;
  }
  search.places = SearchLattice(model, field, surface, lattice, kPlaces, parallel);
  return search;
}

}  // namespace vantage::registration

#include "core/registration/align/global_search.h"

#include <Eigen/Core>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"
#include "core/registration/align/floor_plane.h"
#include "core/registration/align/lattice_search.h"
#include "core/registration/align/scanner_heights.h"
#include "core/sensor/scanner_model.h"

namespace vantage::registration {
namespace {

// Places from which alignments start, and with those of a site that repeats itself.
constexpr LatticeWish kPlaces = {160, 320};
// Five seconds on two cores.
constexpr size_t kMostCandidates = 16'000'000;
// m: a scanner stands where space is known, or this far beyond it, in a doorway or the next room.
constexpr double kBeyondKnown = 3.0;

// Whether space is known to be empty at the place or around it.
bool NearKnown(const model::PlanningView& model, const Eigen::Vector3d& place) {
  constexpr int kAround = 8;
  for (const double away : {0.0, 0.5 * kBeyondKnown, kBeyondKnown}) {
    for (int k = 0; k < (away > 0 ? kAround : 1); ++k) {
      const double angle = 2 * sensor::kPi * k / kAround;
      const Eigen::Vector3d off(away * std::cos(angle), away * std::sin(angle), 0);
      if (model.Empty(model.At(place + off))) return true;
    }
  }
  return false;
}

// Places all over the model, by height.
std::vector<std::vector<Eigen::Vector3d>> Places(const model::PlanningView& model,
                                                 const std::vector<ScannerHeight>& heights) {
  const double h = model.voxel_size();
  const Eigen::Vector2d low = model.bounds().min.cast<double>().head<2>() * h;
  const Eigen::Vector2d size = model.bounds().max.cast<double>().head<2>() * h - low;
  const int columns = static_cast<int>(size.x() / Lattice::kPlaceStep) + 1;
  const int rows = static_cast<int>(size.y() / Lattice::kPlaceStep) + 1;
  std::vector<std::vector<Eigen::Vector3d>> places(heights.size());
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const Eigen::Vector2d across(low.x() + (column + 0.5) * Lattice::kPlaceStep,
                                   low.y() + (row + 0.5) * Lattice::kPlaceStep);
      for (const size_t k : HeightsAt(heights, across)) {
        const Eigen::Vector3d place(across.x(), across.y(), heights[k].z());
        if (NearKnown(model, place)) places[k].push_back(place);
      }
    }
  }
  return places;
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
  const std::vector<ScannerHeight> heights =
      ScannerHeights(model, search.floor_found ? &floor : nullptr);
  lattice.headings.resize(Lattice::kHeadings);
  std::iota(lattice.headings.begin(), lattice.headings.end(), 0);
  size_t left_out = 0;
  for (const std::vector<Eigen::Vector3d>& at_height : Places(model, heights)) {
    const size_t all = (lattice.places.size() + at_height.size()) * lattice.headings.size();
    if (all > kMostCandidates) {
      ++left_out;
      continue;
    }
    lattice.places.insert(lattice.places.end(), at_height.begin(), at_height.end());
  }
  if (left_out > 0) {
    search.left_out = absl::StrFormat(
        "%d of the %d heights at which a scanner may have stood were "
        "not searched, since the site is too large",
        left_out, heights.size());
  }
  if (left_out > 0 && lattice.places.empty()) {
    const Eigen::Vector3d size =
        model.voxel_size() * (model.bounds().max - model.bounds().min).cast<double>();
    search.why_not =
        absl::StrFormat("the site (%.0f x %.0f m) is too large to be searched", size.x(), size.y());
    return search;
  }
  if (lattice.size() == 0 || surface.samples.size() < Lattice::kFewestSamples) {
    search.why_not = "too little surface to look for its place";
    return search;
  }
  LatticeFinds finds = SearchLattice(model, field, surface, lattice, kPlaces, parallel);
  search.places = std::move(finds.poses);
  search.more_places = finds.more;
  return search;
}

}  // namespace vantage::registration

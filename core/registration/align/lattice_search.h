// Tries a scan at many places and headings and finds those at which it fits best: where alignments
// start (algorithm.md section 9, 'Alignment' and 'Global registration').
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_LATTICE_SEARCH_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_LATTICE_SEARCH_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/registration/align/correspondence_field.h"
#include "core/registration/align/scan_surface.h"

namespace vantage::registration {

// Where a scan is tried: at all places with all headings.
struct Lattice {
  // Steps that leave the alignment's first stage at most its reach of half a metre to bridge, with
  // the walls some metres off.
  static constexpr double kPlaceStep = 0.35;  // m
  static constexpr int kHeadings = 60;        // all around
  // Samples that a surface has to have to be tried.
  static constexpr size_t kFewestSamples = 60;

  std::vector<Eigen::Vector3d> places;                    // m, of the scanner
  std::vector<int> headings;                              // of kHeadings, about the vertical,
  Eigen::Matrix3d upright = Eigen::Matrix3d::Identity();  // after this

  size_t size() const { return places.size() * headings.size(); }
};

// How many places are wanted.
struct LatticeWish {
  size_t least = 0;  // the best, as long as there are any
  size_t most = 0;   // with those beyond them that fit half as well as the best, one around each
};

struct LatticeFinds {
  std::vector<Eigen::Isometry3d> poses;  // T_world_scan, apart from each other, the best first
  bool more = false;                     // there are others that fit half as well
};

// The best poses, good to a few decimetres. `field` covers what they reach. The same for any number
// of threads.
LatticeFinds SearchLattice(const model::PlanningView& model, const CorrespondenceField& field,
                           const ScanSurface& surface, const Lattice& lattice,
                           const LatticeWish& wish, parallel::Parallel& parallel);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_LATTICE_SEARCH_H_

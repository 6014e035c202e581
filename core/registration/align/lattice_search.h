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

// Where a scan is tried: all combinations.
struct Lattice {
  // Steps that leave the alignment's first stage at most its reach of half a metre to bridge, with
  // the walls some metres off.
  static constexpr double kPlaceStep = 0.35;  // m
  static constexpr int kHeadings = 60;        // all around
  // Samples that a surface has to have to be tried.
  static constexpr size_t kFewestSamples = 60;

  std::vector<Eigen::Vector2d> places;                    // m
  std::vector<double> heights;                            // z of the scanner, m
  std::vector<int> headings;                              // of kHeadings, about the vertical,
  Eigen::Matrix3d upright = Eigen::Matrix3d::Identity();  // after this

  size_t size() const { return places.size() * heights.size() * headings.size(); }
};

// The best poses, T_world_scan, at most `most`, apart from each other, the best first: good to a
// few decimetres. `field` covers what they reach. The same for any number of threads.
std::vector<Eigen::Isometry3d> SearchLattice(const model::PlanningView& model,
                                             const CorrespondenceField& field,
                                             const ScanSurface& surface, const Lattice& lattice,
                                             size_t most, parallel::Parallel& parallel);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_LATTICE_SEARCH_H_

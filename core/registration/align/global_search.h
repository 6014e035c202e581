// Where a scan can have been made when nothing is known of its pose but that the scanner stood
// upright (algorithm.md section 9, 'Global registration').
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_GLOBAL_SEARCH_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_GLOBAL_SEARCH_H_

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/registration/align/correspondence_field.h"
#include "core/registration/align/scan_surface.h"

namespace vantage::registration {

struct GlobalSearch {
  std::vector<Eigen::Isometry3d> places;  // T_world_scan, best first; good to a few decimetres
  bool more_places = false;               // others fit half as well as the best, and are left out
  bool floor_found = false;               // a floor in the scan gave tilt and height
  std::string why_not;                    // in words, when there are no places
  std::string left_out;  // in words, floors that were not searched; empty: all were
};

// Tries a lattice of places and headings all over the model, where its space is known and three
// metres beyond: heights from the floors that model and scan show, or from where scanners stood,
// each where that floor is known. `field` covers the model. The work is bounded: of a site of more
// than 16 million candidates (30,000 m^2 of floors) the largest floors are searched, and the answer
// says so.
GlobalSearch SearchGlobally(const model::PlanningView& model, const CorrespondenceField& field,
                            const ScanSurface& surface, double spacing,
                            parallel::Parallel& parallel);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_GLOBAL_SEARCH_H_

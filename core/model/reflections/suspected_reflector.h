// Reflectors that a scan suspects and cannot tell by itself, and what other scans say of them
// (algorithm.md section 4, 'Reflections').
#ifndef VANTAGE_CORE_MODEL_REFLECTIONS_SUSPECTED_REFLECTOR_H_
#define VANTAGE_CORE_MODEL_REFLECTIONS_SUSPECTED_REFLECTOR_H_

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/model/reflections/aperture.h"
#include "core/model/reflections/reflected_return.h"
#include "core/model/scan/range_surface.h"
#include "core/model/scan/scan_planes.h"

namespace vantage::model {

// A plane, and a region of returns behind it whose border has the shape of a mirror's.
struct SuspectedReflector {
  ReflectingPlane plane;        // scanner's frame
  std::vector<ScanCell> asked;  // some of the cells whose returns would be reflections
  Aperture aperture;            // of all of them, scanner's frame
  std::optional<Eigen::Vector3d> wall = std::nullopt;  // a point of the wall around, likewise
};

// What one scan says of a suspected reflector, of another one or its own.
struct Testimony {
  // For each cell that is asked, bits: what the scan measured where its return, reflected back,
  // lies (m, and where it would lie were the plane a little farther or nearer).
  static constexpr uint8_t kAgrees = 1;
  static constexpr uint8_t kContradicts = 2;
  static constexpr uint8_t kAgreesFarther = 4;
  static constexpr uint8_t kAgreesNearer = 8;
  std::vector<uint8_t> of_returns;  // empty: nothing of any
  // The scan stood behind the plane and saw through it, so there is an opening.
  bool sees_through = false;
};

// `suspect`: of the scan with `surface`; in the given plane. `witness` may be the same scan.
Testimony Testify(const SuspectedReflector& suspect, const ReflectingPlane& plane,
                  const RangeSurface& surface, const RangeSurface& witness,
                  const Eigen::Isometry3d& T_witness_scan);

// A plane near that of a suspect in which what it shows is the image of what the witness measured,
// and how much of it.
struct WitnessFit {
  ReflectingPlane plane;  // frame of the suspect's scan
  size_t agree;           // of the returns that were looked at
};
// Nothing when the witness measured too little of what the plane shows, or when the plane that it
// gives is no better than the suspect's own. The own plane of a mirror that shows its scan what the
// scan does not see directly is inexact.
std::optional<WitnessFit> FitByWitness(const SuspectedReflector& suspect,
                                       const RangeSurface& surface, const RangeSurface& witness,
                                       const Eigen::Isometry3d& T_witness_scan);

inline constexpr size_t kLeastAsked = 20;  // returns: shares of them are off by a tenth, one sigma

// True when a suspect is a reflector by what its own scan and others say. The order of `others`
// does not matter.
bool IsReflector(const Testimony& own, std::span<const Testimony* const> others);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_REFLECTIONS_SUSPECTED_REFLECTOR_H_

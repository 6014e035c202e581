// A panoramic scanner in a mesh, with the faults of a real one.
#ifndef VANTAGE_CORE_SIMULATION_SIMULATED_SCANNER_H_
#define VANTAGE_CORE_SIMULATION_SIMULATED_SCANNER_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/parallel/parallel.h"
#include "core/sensor/range_image.h"
#include "core/sensor/scanner_model.h"
#include "core/simulation/tracer.h"
#include "core/simulation/triangle_mesh.h"

namespace vantage::simulation {

struct ScanFaults {
  // A scanner without faults.
  static ScanFaults None() {
    ScanFaults none;
    none.range_noise = none.glass_drops_out = none.mirror_reflections = false;
    none.grazing_dropout = none.dark_dropout = none.polish = none.beam_divergence = none.tilt = 0;
    return none;
  }

  bool range_noise = true;       // the scanner model's sigma, Gaussian
  double grazing_dropout = 1.0;  // probability of no return rises from 0 at 80 degrees of
                                 // incidence to this at 90
  bool glass_drops_out = true;   // glass returns nothing unless within 5 degrees of head on; what
                                 // is behind it is not seen either. false: as matte
  bool mirror_reflections =
      true;                   // mirrors return what they reflect, up to 4 times. false: as matte
  double dark_dropout = 0.5;  // of dark surfaces
  double polish = 0.9;        // probability that a polished surface returns what it reflects
                              // instead of itself: rises from 0 at 60 degrees of incidence to
                              // this at 85. Cell by cell, so both kinds lie side by side
  double beam_divergence =
      0.0003;         // rad, full angle; edges inside the beam give mixed pixels. 0: none
  double tilt = 0.0;  // rad, one sigma of roll and pitch of a set-up tripod
};

// Ray tracing by Embree. Thread safe: const methods only.
//
// What a cell holds: the ray of a cell goes through its centre, from the pose tilted by the faults'
// draw. Columns divide the azimuth span evenly, rows the elevation interval, at the native steps
// (as near as whole numbers allow).
class SimulatedScanner {
 public:
  explicit SimulatedScanner(const TriangleMesh& mesh);
  ~SimulatedScanner();

  // Scans from a pose (rigid, scanner to scene frame). The same arguments give the same image on
  // any number of threads. Ranges outside the scanner's interval: nearer is no information, farther
  // no return. `preview` (rad, 0: none): rays lie at least so far apart and stand for the native
  // ones around them, whose steps the image has: it is the full scan, thinned.
  sensor::RangeImage Scan(const sensor::ScannerModel& scanner,
                          const Eigen::Isometry3d& T_scene_scan, const ScanFaults& faults,
                          uint64_t seed, parallel::Parallel& parallel, double preview = 0) const;

  // True when nothing lies on the open segment from a to b.
  bool Visible(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const;

  // Distance to the nearest surface, m, at most `limit`.
  double Clearance(const Eigen::Vector3d& point, double limit) const;

  // What it traces with; as long-lived as the scanner.
  const Tracer& tracer() const { return *tracer_; }

 private:
  std::unique_ptr<Tracer> tracer_;
  std::vector<Material> material_;
};

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_SIMULATED_SCANNER_H_

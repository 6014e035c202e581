// What a job has really covered, known only to the simulation.
#ifndef VANTAGE_CORE_SIMULATION_GROUND_TRUTH_H_
#define VANTAGE_CORE_SIMULATION_GROUND_TRUTH_H_

#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include "core/parallel/parallel.h"
#include "core/sensor/scanner_model.h"
#include "core/simulation/simulated_scanner.h"
#include "core/simulation/triangle_mesh.h"

namespace vantage {

struct TrueCoverage {
  double attainable_area = 0;  // m^2 that some allowed position measures at all
  double seen_area = 0;        // m^2 of it measured by the scans so far
  double at_density_area = 0;  // m^2 of it measured at the required density
  double seen_share() const { return attainable_area > 0 ? seen_area / attainable_area : 0; }
  double at_density_share() const {
    return attainable_area > 0 ? at_density_area / attainable_area : 0;
  }
};

// Samples the mesh's surface (area-weighted, fixed seed) and traces against it. `positions` are the
// allowed viewpoints: surface that none of them sees does not count.
class GroundTruth {
 public:
  GroundTruth(const TriangleMesh& mesh, const SimulatedScanner& tracer, const ScannerModel& scanner,
              double required_density, std::vector<Eigen::Vector3d> positions, size_t samples,
              Parallel& parallel);
  ~GroundTruth();

  // Adds a scan made at a true position.
  void AddScan(const Eigen::Vector3d& position, Parallel& parallel);
  TrueCoverage Measure() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Places where the scanner can really stand: a lattice of `spacing` over the floor, at
// `height` over it, with the scanner's clearance and connected to `start`.
std::vector<Eigen::Vector3d> StandablePositions(const SimulatedScanner& tracer,
                                                const Eigen::AlignedBox3d& bounds,
                                                const Eigen::Vector3d& start, double floor_height,
                                                double height, double clearance, double spacing);

}  // namespace vantage

#endif  // VANTAGE_CORE_SIMULATION_GROUND_TRUTH_H_

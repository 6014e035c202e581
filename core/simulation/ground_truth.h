// The surface that a job has really covered, which only the simulation knows.
#ifndef VANTAGE_CORE_SIMULATION_GROUND_TRUTH_H_
#define VANTAGE_CORE_SIMULATION_GROUND_TRUTH_H_

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/parallel/parallel.h"
#include "core/sensor/scanner_model.h"
#include "core/simulation/simulated_scanner.h"
#include "core/simulation/triangle_mesh.h"

namespace vantage::simulation {

struct TrueCoverage {
  double attainable_area = 0;             // m^2 that some allowed position measures at all
  double attainable_at_density_area = 0;  // m^2 of it that one measures at the required density
  double seen_area = 0;                   // m^2 of the attainable measured by the scans so far
  double at_density_area = 0;             // m^2 of the attainable measured at the required density
  double attained_area = 0;    // m^2 of the attainable at density that is measured at density
  double equivalent_area = 0;  // m^2 of the attainable, each counted by the share of the required
                               // density that it is measured at
  double seen_share() const { return attainable_area > 0 ? seen_area / attainable_area : 0; }
  double at_density_share() const {
    return attainable_area > 0 ? at_density_area / attainable_area : 0;
  }
  double attained_share() const {
    return attainable_at_density_area > 0 ? attained_area / attainable_at_density_area : 0;
  }
};

// A set of the samples of a ground truth: bit i % 64 of word i / 64 stands for sample i.
using SampleSet = std::vector<uint64_t>;

// Samples the mesh's surface (area-weighted, fixed seed) and traces against it. A position measures
// a sample when nothing lies between and range, elevation and incidence are within the scanner's
// limits (upright scanner; either side of a triangle counts); at density when
// ScannerModel::SamplingDensity reaches the required one there. Glass and mirrors cannot be
// measured. `positions` are the allowed viewpoints: surface that none of them measures does not
// count.
class GroundTruth {
 public:
  // `tracer` must be of the same mesh and outlive this.
  GroundTruth(const TriangleMesh& mesh, const SimulatedScanner& tracer,
              const sensor::ScannerModel& scanner, double required_density,
              const std::vector<Eigen::Vector3d>& positions, size_t samples,
              parallel::Parallel& parallel);
  ~GroundTruth();
  GroundTruth(const GroundTruth&);
  GroundTruth(GroundTruth&&) noexcept;
  GroundTruth& operator=(GroundTruth&&) noexcept;

  // Adds a scan made at a true position (m, scene frame). `heading` (rad, of the scanner's +x,
  // counter-clockwise from the scene's) is that of a scanner that sees a sector; without it the
  // scan is all around.
  void AddScan(const Eigen::Vector3d& position, parallel::Parallel& parallel,
               std::optional<double> heading = std::nullopt);
  TrueCoverage Measure() const;

  // The true gain of a scan at each of `positions` alone: m^2 of attainable surface newly measured
  // at density.
  std::vector<double> GainAtDensity(const std::vector<Eigen::Vector3d>& positions,
                                    parallel::Parallel& parallel) const;

  // Of the samples attainable at density: those that a scan at each of `positions` measures at
  // density, and those that the scans so far have measured so.
  std::vector<SampleSet> MeasuredAtDensity(const std::vector<Eigen::Vector3d>& positions,
                                           parallel::Parallel& parallel) const;
  SampleSet AtDensity() const;
  double area_per_sample() const;  // m^2

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_GROUND_TRUTH_H_

// What a model shows that is only in a mirror, and what real it lost for being taken for a mirror's
// image: by brute force on the mesh and on what each ray really met.
#ifndef VANTAGE_TESTS_SUPPORT_PHANTOM_ORACLE_H_
#define VANTAGE_TESTS_SUPPORT_PHANTOM_ORACLE_H_

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/sensor/scan.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::test_support {

class PhantomOracle {
 public:
  // Keeps the reference.
  explicit PhantomOracle(const simulation::SimulatedScanner& simulated) : simulated_(simulated) {}

  struct PosedScan {
    sensor::Scan scan;
    Eigen::Isometry3d T_model_scan;  // as registered: some millimetres and tenths of a degree off
  };
  // A scan from a position (m) with all faults of a scanner, and what its rays really met.
  PosedScan Scan(const Eigen::Vector3d& position, const sensor::ScannerModel& scanner,
                 uint64_t seed, parallel::Parallel& parallel);

  // m^2 of measured surface in the model with no triangle within 15 cm.
  double PhantomArea(const model::PlanningView& model) const;
  // m^2 of what the rays of all scans so far showed farther away than what they really met: what a
  // model would hold that knew of no mirrors.
  double ReflectedArea(double voxel_size) const;

  // Of the returns of all scans so far that came straight from a surface: those whose voxel, and
  // all those next to it, hold no surface in the model.
  struct Lost {
    size_t lost = 0;
    size_t returns = 0;
    double share() const {
      return returns == 0 ? 0 : static_cast<double>(lost) / static_cast<double>(returns);
    }
  };
  Lost LostReturns(const model::PlanningView& model) const;
  // Those that passed through an opening (m), as deep as its wall.
  Lost LostThrough(const Eigen::AlignedBox3d& opening, const model::PlanningView& model) const;

 private:
  struct Return {
    Eigen::Vector3f from;  // m: the station
    Eigen::Vector3f at;    // m: where the model has it
  };
  const simulation::SimulatedScanner& simulated_;
  std::vector<Return> real_;  // every fourth column and row
  std::vector<Eigen::Vector3f> reflected_;
};

}  // namespace vantage::test_support

#endif  // VANTAGE_TESTS_SUPPORT_PHANTOM_ORACLE_H_

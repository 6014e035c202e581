// Scan, merge, plan, move, until the planner suggests to stop: the whole cycle without a server, at
// true poses.
#ifndef VANTAGE_TESTS_SUPPORT_CLOSED_LOOP_H_
#define VANTAGE_TESTS_SUPPORT_CLOSED_LOOP_H_

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/model/partial_model.h"
#include "core/model/view/model_config.h"
#include "core/parallel/parallel.h"
#include "core/planning/plan/plan.h"
#include "core/planning/plan/planning_config.h"
#include "core/simulation/simulated_scanner.h"
#include "core/simulation/triangle_mesh.h"

namespace vantage::test_support {

struct LoopOptions {
  sensor::ScannerModel scanner;
  simulation::ScanFaults faults;
  planning::PlanningConfig planning;
  model::ModelConfig model;
  uint64_t work_limit = 3'000'000;  // rays of a plan
  int max_scans = 12;
  uint64_t seed = 1;
};

struct LoopResult {
  std::vector<Eigen::Vector3d> stations;  // m, of every scan made, in order
  std::vector<planning::Plan> plans;      // after each of them
  bool stopped = false;                   // the planner suggested it
  std::unique_ptr<model::PartialModel> model;
};

// `mesh_of(scan)`: the scene as it is when that scan (from 0) is made at that place.
LoopResult RunClosedLoop(
    const std::function<simulation::TriangleMesh(int scan, const Eigen::Vector3d& station)>&
        mesh_of,
    const Eigen::Vector3d& start, const LoopOptions& options, parallel::Parallel& parallel);

}  // namespace vantage::test_support

#endif  // VANTAGE_TESTS_SUPPORT_CLOSED_LOOP_H_

// All that evaluating views needs, made from a planning view as the planner makes it.
#ifndef VANTAGE_TESTS_SUPPORT_PLANNING_PROBLEM_H_
#define VANTAGE_TESTS_SUPPORT_PLANNING_PROBLEM_H_

#include <Eigen/Core>
#include <memory>
#include <utility>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/planning/feasibility/feasible_views.h"
#include "core/planning/patches/patches.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/scoring/brute_force.h"
#include "core/planning/scoring/scoring.h"
#include "core/sensor/scanner_model.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::test_support {

struct PlanningProblem {
  PlanningProblem(std::shared_ptr<const model::PlanningView> view,
                  const planning::PlanningConfig& with)
      : model(std::move(view)), grid(*model), config(with) {
    patches = planning::ExtractPatches(*model, config, {}, parallel::Budget::Unlimited());
    planning::RankPatches(config, patches);
    feasible = planning::FeasibleViews::Find(*model, grid, scanner, config,
                                             parallel::Budget::Unlimited(), serial);
    for (size_t i = 0; i < feasible.cells().size(); ++i) views.push_back(feasible.Centre(i));
    scoring = std::make_unique<planning::Scoring>(*model, grid, patches, scanner, config, serial);
  }

  std::vector<planning::ViewScore> BruteForce(parallel::Parallel& parallel) const {
    return planning::ScoreEveryView(scoring->scorer(), views, scoring->cells(),
                                    parallel::Budget::Unlimited(), parallel);
  }

  std::shared_ptr<const model::PlanningView> model;
  visibility::OpaqueGrid grid;
  sensor::ScannerModel scanner;
  planning::PlanningConfig config;
  parallel::Serial serial;
  planning::PatchSet patches;
  planning::FeasibleViews feasible;
  std::vector<Eigen::Vector3d> views;
  std::unique_ptr<planning::Scoring> scoring;
};

}  // namespace vantage::test_support

#endif  // VANTAGE_TESTS_SUPPORT_PLANNING_PROBLEM_H_

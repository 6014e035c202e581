// All that evaluating views needs, made from a planning view as the planner makes it.
#ifndef VANTAGE_TESTS_SUPPORT_PLANNING_PROBLEM_H_
#define VANTAGE_TESTS_SUPPORT_PLANNING_PROBLEM_H_

#include <Eigen/Core>
#include <memory>
#include <utility>
#include <vector>

#include "core/model/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/planning/brute_force.h"
#include "core/planning/feasible_views.h"
#include "core/planning/opaque_grid.h"
#include "core/planning/patches.h"
#include "core/planning/plan.h"
#include "core/planning/scoring.h"
#include "core/sensor/scanner_model.h"

namespace vantage {

struct PlanningProblem {
  PlanningProblem(std::shared_ptr<const PlanningView> view, const PlanningConfig& with)
      : model(std::move(view)), grid(*model), config(with) {
    patches = ExtractPatches(*model, config, {}, Budget::Unlimited());
    RankPatches(config, patches);
    feasible = FeasibleViews::Find(*model, grid, scanner, config, Budget::Unlimited(), serial);
    for (size_t i = 0; i < feasible.cells().size(); ++i) views.push_back(feasible.Centre(i));
    scoring = std::make_unique<Scoring>(*model, grid, patches, scanner, config, serial);
  }

  std::vector<ViewScore> BruteForce(Parallel& parallel) const {
    return ScoreEveryView(scoring->scorer(), views, scoring->cells(), Budget::Unlimited(),
                          parallel);
  }

  std::shared_ptr<const PlanningView> model;
  OpaqueGrid grid;
  ScannerModel scanner;
  PlanningConfig config;
  Serial serial;
  PatchSet patches;
  FeasibleViews feasible;
  std::vector<Eigen::Vector3d> views;
  std::unique_ptr<Scoring> scoring;
};

}  // namespace vantage

#endif  // VANTAGE_TESTS_SUPPORT_PLANNING_PROBLEM_H_

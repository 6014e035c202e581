// The input of an evaluation of views, made from a planning view in the planner's way.
#ifndef VANTAGE_TESTS_SUPPORT_PLANNING_PROBLEM_H_
#define VANTAGE_TESTS_SUPPORT_PLANNING_PROBLEM_H_

#include <Eigen/Core>
#include <memory>
#include <utility>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/scoring/brute_force.h"
#include "core/sensor/scanner_model.h"

namespace vantage::test_support {

// A problem of a scanner, with its model and the centres of its views.
struct PlanningProblem {
  PlanningProblem(std::shared_ptr<const model::PlanningView> view,
                  const planning::PlanningConfig& with, const sensor::ScannerModel& of = {})
      : model(std::move(view)),
        scanner(of),
        config(with),
        problem(planning::PlanningProblem::Prepare({*model, scanner, config}, serial).value()) {
    for (size_t i = 0; i < feasible.cells().size(); ++i) views.push_back(feasible.Centre(i));
  }

  std::vector<planning::ViewScore> BruteForce(parallel::Parallel& parallel) const {
    return planning::ScoreEveryView(scoring->scorer(), views, scoring->cells(),
                                    parallel::Budget::Unlimited(), parallel);
  }

  std::shared_ptr<const model::PlanningView> model;
  sensor::ScannerModel scanner;
  planning::PlanningConfig config;
  parallel::Serial serial;
  std::shared_ptr<const planning::PlanningProblem> problem;
  const visibility::OpaqueGrid& grid = problem->grid();
  const planning::PatchSet& patches = problem->patches();
  const planning::FeasibleViews& feasible = problem->feasible();
  const planning::Scoring* scoring = &problem->scoring();
  std::vector<Eigen::Vector3d> views;
};

}  // namespace vantage::test_support

#endif  // VANTAGE_TESTS_SUPPORT_PLANNING_PROBLEM_H_

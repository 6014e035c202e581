// Problems of evaluating views, as the planner would meet them: a model after some scans, and steps
// A to C of it.
#ifndef VANTAGE_TESTS_BENCH_PLANNING_JOB_H_
#define VANTAGE_TESTS_BENCH_PLANNING_JOB_H_

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/problem/planning_problem.h"

namespace vantage::bench {

struct PlanningJob {
  PlanningJob(std::shared_ptr<const model::PlanningView> view, const sensor::ScannerModel& of,
              parallel::Parallel& parallel);
  std::string Size() const;

  std::shared_ptr<const model::PlanningView> model;
  sensor::ScannerModel scanner;
  planning::PlanningConfig config;
  std::shared_ptr<const planning::PlanningProblem> problem;
  const visibility::OpaqueGrid& grid = problem->grid();
  const planning::FeasibleViews& feasible = problem->feasible();
  const planning::PatchSet& patches = problem->patches();
  const planning::Scoring* scoring = &problem->scoring();
  std::vector<Eigen::Vector3d> views;
};

// The furnished flat of FlatJob after so many scans.
std::unique_ptr<PlanningJob> FlatPlanningJob(size_t scans, parallel::Parallel& parallel);

// An office storey after one scan per 50 m2, from where its rooms are freest; range 30 m.
std::shared_ptr<const model::PlanningView> ScannedOffice(double area_m2,
                                                         sensor::ScannerModel& scanner,
                                                         parallel::Parallel& parallel);
std::unique_ptr<PlanningJob> OfficePlanningJob(double area_m2, parallel::Parallel& parallel);

// The furnished house of the shared data after five scans; null where the data are not there.
std::unique_ptr<PlanningJob> SmallHousePlanningJob(parallel::Parallel& parallel);

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_PLANNING_JOB_H_

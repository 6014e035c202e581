// Problems of evaluating views, as the planner would meet them: a model after some scans, and steps
// A to C of it.
#ifndef VANTAGE_TESTS_BENCH_PLANNING_JOB_H_
#define VANTAGE_TESTS_BENCH_PLANNING_JOB_H_

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "core/model/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/planning/feasible_views.h"
#include "core/planning/opaque_grid.h"
#include "core/planning/patches.h"
#include "core/planning/plan.h"
#include "core/planning/scoring.h"

namespace vantage {

struct PlanningJob {
  PlanningJob(std::shared_ptr<const PlanningView> view, const ScannerModel& of, Parallel& parallel);
  std::string Size() const;

  std::shared_ptr<const PlanningView> model;
  ScannerModel scanner;
  PlanningConfig config;
  OpaqueGrid grid;
  FeasibleViews feasible;
  PatchSet patches;
  std::unique_ptr<Scoring> scoring;
  std::vector<Eigen::Vector3d> views;
};

// The furnished flat of FlatJob after so many scans.
std::unique_ptr<PlanningJob> FlatPlanningJob(size_t scans, Parallel& parallel);

// An office floor after one scan per 50 m2, from where its rooms are freest; range 30 m.
std::shared_ptr<const PlanningView> ScannedOffice(double area_m2, ScannerModel& scanner,
                                                  Parallel& parallel);
std::unique_ptr<PlanningJob> OfficePlanningJob(double area_m2, Parallel& parallel);

// The furnished house of the shared data after five scans; null where the data are not there.
std::unique_ptr<PlanningJob> SmallHousePlanningJob(Parallel& parallel);

}  // namespace vantage

#endif  // VANTAGE_TESTS_BENCH_PLANNING_JOB_H_

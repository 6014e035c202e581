// Problems of evaluating views, as the planner would meet them: a model after some scans, and steps
// A to C of it.
#ifndef VANTAGE_TESTS_BENCH_PLANNING_JOB_H_
#define VANTAGE_TESTS_BENCH_PLANNING_JOB_H_

#include <Eigen/Core>
#include <cstdint>
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

// The furnished flat of a seed after so many scans, made where the planner says.
std::unique_ptr<PlanningJob> FlatPlanningJob(uint64_t seed, size_t scans,
                                             parallel::Parallel& parallel);
// The same in two rooms, and in a hall with pillars.
std::unique_ptr<PlanningJob> RoomsPlanningJob(uint64_t seed, size_t scans,
                                              parallel::Parallel& parallel);
std::unique_ptr<PlanningJob> HallPlanningJob(uint64_t seed, size_t scans,
                                             parallel::Parallel& parallel);

// An office storey after one scan per 50 m2, from where its rooms are freest; range 30 m.
std::shared_ptr<const model::PlanningView> ScannedOffice(uint64_t seed, double area_m2,
                                                         sensor::ScannerModel& scanner,
                                                         parallel::Parallel& parallel);
std::unique_ptr<PlanningJob> OfficePlanningJob(uint64_t seed, double area_m2,
                                               parallel::Parallel& parallel);

// A mesh in a folder of the shared data after five scans; null where the data are not there.
std::unique_ptr<PlanningJob> MeshPlanningJob(const std::string& folder,
                                             parallel::Parallel& parallel);

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_PLANNING_JOB_H_

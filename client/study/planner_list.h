// The planners of a study, by name.
#ifndef VANTAGE_CLIENT_STUDY_PLANNER_LIST_H_
#define VANTAGE_CLIENT_STUDY_PLANNER_LIST_H_

#include <optional>
#include <string>
#include <vector>

#include "client/simulated_job/scene_prior.h"
#include "client/simulated_job/simulated_job.h"
#include "vantage/v1/planning_config.pb.h"

namespace vantage::study {

enum class PlannerKind {
  kOurs,          // through the service
  kRival,         // sees what a real planner could see
  kKnowsTheScene  // a line to compare with
};

struct StudyPlanner {
  std::string name;
  std::string words;  // description for readers
  PlannerKind kind = PlannerKind::kRival;
  // Ours only.
  double plan_seconds = 1.0;     // of one core
  v1::PlanningConfig overrides;  // of the default configuration
  simulated_job::ViewChoice choice = simulated_job::ViewChoice::kRegistrable;
  std::optional<simulated_job::ScenePriorKind> site_prior;  // set after the first scan
  std::optional<double> tour_seconds;  // of one core: a tour before every plan, which follows it
  bool asked_about_best = false;       // after every scan: its answer about the truly best position
};

// Every planner there is, ours first.
const std::vector<StudyPlanner>& AllPlanners();

// Null when there is none of that name.
const StudyPlanner* FindPlanner(const std::string& name);

// The planners that `vantage study` runs without --planner; `small`: those that the figures need.
std::vector<std::string> DefaultPlanners(bool small);

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_PLANNER_LIST_H_

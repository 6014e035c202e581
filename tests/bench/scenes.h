// The scenes that a run measures on. Which of them report and which are for tuning, and why, is in
// core/simulation/scenes/scene_use.h.
#ifndef VANTAGE_TESTS_BENCH_SCENES_H_
#define VANTAGE_TESTS_BENCH_SCENES_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/parallel/parallel.h"
#include "core/simulation/scenes/scene_use.h"
#include "tests/bench/planning_job.h"

namespace vantage::bench {

using simulation::SceneUse;

// Of generated scenes. Those for tuning are what all figures came from before scenes were split.
std::vector<uint64_t> SceneSeeds(SceneUse use);

// One model to plan on.
struct PlanningScene {
  std::string name;  // 'flat-201'
  // Null: its file is not there.
  std::function<std::unique_ptr<PlanningJob>(parallel::Parallel&)> make;
};

// Models of one kind, each from another scene.
struct PlanningKind {
  std::string name;                     // as in the figures' names
  PlanningScene tuning;                 // what a rival is tuned on
  std::vector<PlanningScene> measured;  // share no scene with it, except in a run for tuning
};

PlanningKind FlatsAfter(size_t scans, SceneUse use);       // 'flat1', 'flat3'
PlanningKind RoomsAfter(size_t scans, SceneUse use);       // 'rooms1': two rooms
PlanningKind HallsAfter(size_t scans, SceneUse use);       // 'hall3'
PlanningKind OfficeStoreys(double area_m2, SceneUse use);  // '250m2'
PlanningKind Meshes(SceneUse use);                         // 'bookstore'; for tuning 'small_house'

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_SCENES_H_

// Other ways to choose the next position. A rival sees what a real planner could see: a partial
// model made from simulated scans by our own registration. Only the rivals that are handed a
// StudyScene know the scene.
#ifndef VANTAGE_CLIENT_STUDY_RIVAL_H_
#define VANTAGE_CLIENT_STUDY_RIVAL_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/simulated_job/placement.h"
#include "client/study/study_scene.h"
#include "core/parallel/parallel.h"
#include "core/planning/problem/planning_problem.h"
#include "core/sensor/range_image.h"

namespace vantage::study {

// What a planner can know before a scan. References are valid during the call.
struct PlanningSituation {
  const planning::PlanningProblem& problem;
  const std::vector<Eigen::Vector3d>& stations;  // m, world, of merged scans
  int number = 0;                                // of the scan to place
  uint64_t seed = 0;
  Eigen::Isometry3d T_scene_world;  // only for rivals that know the scene
  parallel::Parallel& parallel;
};

struct Proposal {
  std::optional<Eigen::Vector3d> position;  // m, world; nothing: the rival has no more to propose
  std::optional<double> predicted;          // m^2 brought to density
  std::string why;                          // it has none
  std::optional<simulated_job::FreeSpot> expected = std::nullopt;  // the place is not known
};

class Rival {
 public:
  virtual ~Rival() = default;
  // Is called for every merged scan.
  virtual void SeeScan(const sensor::RangeImage& image, const Eigen::Isometry3d& T_world_scan);
  virtual Proposal Propose(const PlanningSituation& situation) = 0;
};

// Any feasible place, with equal probability.
std::unique_ptr<Rival> RandomRival();

// The nearest place, by the way there and at least a metre from every former station, that sees at
// least half a square metre of frontier (false surface, whatever the density).
std::unique_ptr<Rival> FrontierRival();

// Given places, m, scene frame, one after the other.
std::unique_ptr<Rival> RouteRival(std::vector<Eigen::Vector3d> route);

// Knows the true gain of places, but may stand only where the model allows it, or also where places
// are expected and free, looks at every third viewcell per axis, and takes only what will register
// as far as the model can tell; where nothing does, the refused place nearest to a station, as a
// job of ours. Its distance from the oracle shows what knowledge of free space is worth (and the
// stride); our planner's distance from it shows what the metric loses. `scene` outlives it.
std::unique_ptr<Rival> FeasibleOracleRival(const StudyScene& scene, planning::StationBasis basis);

// Our own plan without a budget: race and hierarchy to their end, with our registration check. Ends
// where no view registers; a job through the service takes the nearest refused one.
std::unique_ptr<Rival> BruteForceRival();

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_RIVAL_H_

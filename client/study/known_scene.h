// Planners that know the scene, to compare ours with.
#ifndef VANTAGE_CLIENT_STUDY_KNOWN_SCENE_H_
#define VANTAGE_CLIENT_STUDY_KNOWN_SCENE_H_

#include <Eigen/Core>
#include <vector>

#include "absl/status/status.h"
#include "client/study/job_diary.h"
#include "client/study/study_scene.h"

namespace vantage::study {

// The oracle: always the allowed position that truly brings the most new surface to the density.
// Its scans are placed with the same errors and their poses are given.
void RunOracleJob(const StudyScene& scene, uint64_t seed, JobDiary& diary);

// Scans `route` (m, scene frame) after the start in the same way; then does as the oracle does.
void RunGivenJob(const StudyScene& scene, uint64_t seed, const std::vector<Eigen::Vector3d>& route,
                 JobDiary& diary);

// A square grid of scans as one would lay it out without a planner.
struct RegularSpacing {
  double spacing = 0;                  // m
  std::vector<Eigen::Vector3d> route;  // m, scene frame, in the order in which one walks it
};

// The grid that in hindsight needs the fewest scans from the seed's start to the settings' goal,
// out of spacings from 1.25 to 8 m, 16 offsets each and both heights; among equals the one that
// covers more early. Where none reaches the goal, the one that covers most with all scans allowed.
// Grid points are moved to the nearest allowed position within 0.5 m or left out.
RegularSpacing BestSpacing(const StudyScene& scene, uint64_t seed);

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_KNOWN_SCENE_H_

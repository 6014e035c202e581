// What a surveyor does without a planner.
#ifndef VANTAGE_CLIENT_STUDY_SURVEYOR_RIVAL_H_
#define VANTAGE_CLIENT_STUDY_SURVEYOR_RIVAL_H_

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "client/study/rival.h"
#include "core/planning/plan/opening.h"

namespace vantage::study {

// Two scans in every room that it knows of and one in each doorway, the nearest first by the way
// there; when all are made, a third in every room, and so on. In a room it stands in the middle of
// either half, and afterwards where it is farthest from where it stood; a place within a metre of
// another scan of the room is not worth one. It knows of rooms and doorways what the model does
// (algorithm.md section 7D), stands where floor and clearance are known or expected, and computes
// no gain.
std::unique_ptr<Rival> SurveyorRival();

// Where somebody could stand, one place for each column of viewcells on a floor.
struct Spot {
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  // m
  Eigen::Vector2i column = Eigen::Vector2i::Zero();
  double floor = 0;  // m, z
};

// Groups of spots that hang together without leading through a doorway: the rooms as far as one can
// stand in them, each as indices into `spots`. Spots in doorways are in none. Smaller ones than a
// quarter of a square metre are left out.
std::vector<std::vector<size_t>> RoomsOf(const std::vector<Spot>& spots, double cell_size,
                                         const std::vector<planning::Opening>& doorways);

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_SURVEYOR_RIVAL_H_

// Scenes whose every ray is known in closed form, and scans of them. Shares no code with the model.
#ifndef VANTAGE_TESTS_CORE_MODEL_CLOSED_FORM_SCENE_H_
#define VANTAGE_TESTS_CORE_MODEL_CLOSED_FORM_SCENE_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "core/sensor/scan.h"

namespace vantage::model {

// A box turned about its centre.
struct TurnedBox {
  Eigen::Vector3d centre;
  Eigen::Vector3d half;
  Eigen::Quaterniond R_world_box = Eigen::Quaterniond::Identity();

  // Signed: negative inside. Exact inside, exact or smaller than the distance outside.
  double Distance(const Eigen::Vector3d& point) const;
};

// Air is the union of `air` less the solids; everything else is solid. An air box that reaches out
// of range is outdoors: rays into it do not return.
struct ClosedFormScene {
  std::string name;
  std::vector<Eigen::AlignedBox3d> air;
  std::vector<TurnedBox> solids;
  std::vector<Eigen::Vector3d> stations;  // to scan from

  bool InAir(const Eigen::Vector3d& point) const;
  // A lower bound of the distance from a point to the nearest surface, on either side; at most
  // `limit`.
  double DistanceToSurface(const Eigen::Vector3d& point, double limit) const;
  // Distance along a unit direction to the first surface, m, at most `limit`.
  double Cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double limit) const;
};

// What test names show.
inline void PrintTo(const ClosedFormScene& scene, std::ostream* out) { *out << scene.name; }

ClosedFormScene EmptyRoom();
ClosedFormScene BoxInRoom();
ClosedFormScene RoomWithWindow();
ClosedFormScene PillarRoom();
ClosedFormScene ThinWallRoom();
ClosedFormScene DoorwayRooms();
ClosedFormScene TiltedPlanes();
std::vector<ClosedFormScene> AllScenes();
// Boxes at random places and turns in a room.
ClosedFormScene RandomScene(uint64_t seed);

struct ScanOptions {
  double step = sensor::Radians(0.4);
  double elevation_min = sensor::Radians(-60);
  double noise = 0;  // m, one sigma along the ray
  uint64_t seed = 1;
};
sensor::Scan ScanScene(const ClosedFormScene& scene, const Eigen::Isometry3d& T_world_scan,
                       const ScanOptions& options);
Eigen::Isometry3d PoseAt(const Eigen::Vector3d& position, double yaw = 0, double pitch = 0,
                         double roll = 0);

}  // namespace vantage::model

#endif  // VANTAGE_TESTS_CORE_MODEL_CLOSED_FORM_SCENE_H_

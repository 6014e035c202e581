// Rooms made of boxes, scanned in closed form, and the models of such scans: put together here, or
// made as a server makes them.
#ifndef VANTAGE_TESTS_CORE_REGISTRATION_BOX_SCENE_H_
#define VANTAGE_TESTS_CORE_REGISTRATION_BOX_SCENE_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <random>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/sensor/scan.h"

namespace vantage::registration {

struct BoxScene {
  Eigen::AlignedBox3d room;                 // seen from inside
  std::vector<Eigen::AlignedBox3d> solids;  // seen from outside

  struct Hit {
    double range = 0;  // m; 0: none
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  };
  Hit Cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
};

// A bare room of 6 x 5 x 2.7 m around the origin, floor at z = 0.
BoxScene BareRoom();
// The same with cupboards, table, shelves and a column; `seed` varies them.
BoxScene FurnishedRoom(unsigned seed);
// Parallel walls, floor and ceiling, 60 m long: ends out of range.
BoxScene Corridor();

struct ScanSettings {
  double step = sensor::Radians(0.5);
  double noise = 0.003;  // m
  double elevation_min = sensor::Radians(-60);
  std::vector<std::pair<double, double>> blind;  // rad, elevations at which nothing is measured
};
sensor::Scan ScanScene(const BoxScene& scene, const Eigen::Isometry3d& T_world_scan,
                       const ScanSettings& settings, unsigned seed);

// Collects samples with normals, and the space before them, into a planning view.
class ViewBuilder {
 public:
  explicit ViewBuilder(double voxel) : voxel_(voxel) {}
  void AddSample(const Eigen::Vector3d& origin, const Eigen::Vector3d& point,
                 const Eigen::Vector3d& normal);
  std::shared_ptr<const model::PlanningView> Build() const;

 private:
  struct Key {
    int x, y, z;
    bool operator==(const Key&) const = default;
  };
  struct KeyHash {
    size_t operator()(const Key& k) const {
      return static_cast<size_t>(k.x) * 73856093U ^ static_cast<size_t>(k.y) * 19349663U ^
             static_cast<size_t>(k.z) * 83492791U;
    }
  };
  struct Cell {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    uint32_t samples = 0;
  };
  Key At(const Eigen::Vector3d& p) const;

  double voxel_;
  std::unordered_map<Key, Cell, KeyHash> cells_;  // no samples: empty
};

// The model of one scan, put together without carving: noisy samples, the scene's normals turned by
// `normal_noise` rad (per voxel).
std::shared_ptr<const model::PlanningView> ModelOf(const BoxScene& scene,
                                                   const Eigen::Isometry3d& T_world_scan,
                                                   const ScanSettings& settings,
                                                   double normal_noise, unsigned seed);

// The model that one noisy scan makes: carved and merged, with the normals, the empty space and the
// holes that this gives. For what is compared with the scene, not for what tests the model itself.
std::shared_ptr<const model::PlanningView> ModelFromScan(const BoxScene& scene,
                                                         const Eigen::Isometry3d& T_world_scan,
                                                         const ScanSettings& settings,
                                                         unsigned seed);

// A pose at a place with a heading and a small tilt.
Eigen::Isometry3d PoseAt(const Eigen::Vector3d& position, double yaw, double pitch = 0,
                         double roll = 0);
// `pose` wrong by a vector of the given length and a rotation of the given angle, in random
// directions.
Eigen::Isometry3d Disturbed(const Eigen::Isometry3d& pose, double metres, double radians,
                            std::mt19937_64& random);

}  // namespace vantage::registration

#endif  // VANTAGE_TESTS_CORE_REGISTRATION_BOX_SCENE_H_

// A place to simulate a job in: a mesh, its floor and where the first scan is made.
#ifndef VANTAGE_CLIENT_SIMULATED_JOB_SITE_H_
#define VANTAGE_CLIENT_SIMULATED_JOB_SITE_H_

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/confinement/allowance.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/triangle_mesh.h"

namespace vantage::simulated_job {

struct Site {
  std::string name;
  simulation::TriangleMesh mesh;
  double floor_height = 0;                          // m, scene frame, below the start
  bool several_levels = false;                      // there is other ground than at that height
  Eigen::Vector3d start = Eigen::Vector3d::Zero();  // m, scene frame
  // Of scenes with a floor plan, on the floor at floor_height.
  std::vector<simulation::SceneDoorway> doorways;
  std::vector<simulation::Room> rooms;
};

// The scenes of GeneratedSite(), by the names that --scene takes.
enum class SceneKind {
  kFlat,
  kTwoRooms,
  kHall,
  kOffice,
  kHouse,
  kFacade,
  kCourtyard,
  kStreet,
  kSlope
};

// A scene of the project's own making (core/simulation/scenes/scene.h). `area` (m^2) counts for an
// office storey only. Without a start the scene's first is taken. INVALID_ARGUMENT: the start is
// not free.
absl::StatusOr<Site> GeneratedSite(SceneKind kind, uint64_t seed, double area,
                                   const std::optional<Eigen::Vector3d>& start);

// A mesh from a PLY file, which is read in a process of its own (core/confinement). Without a start
// the most enclosed free place at 1.5 m over the lowest floor is taken. INVALID_ARGUMENT: not a
// mesh, or the start is not free.
absl::StatusOr<Site> MeshSite(const std::string& path, const std::optional<Eigen::Vector3d>& start,
                              const confinement::AllowanceSettings& allowance = {});

}  // namespace vantage::simulated_job

#endif  // VANTAGE_CLIENT_SIMULATED_JOB_SITE_H_

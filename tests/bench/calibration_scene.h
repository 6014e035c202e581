// Scenes for calibrating registration: half of the families leave a direction open by construction.
#ifndef VANTAGE_TESTS_BENCH_CALIBRATION_SCENE_H_
#define VANTAGE_TESTS_BENCH_CALIBRATION_SCENE_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <string>

#include "core/simulation/triangle_mesh.h"

namespace vantage::bench {

// Ranges of the study's scanner end here, m: what is farther off is not seen.
inline constexpr double kCalibrationRange = 10.0;

struct CalibrationScene {
  simulation::TriangleMesh mesh;
  // Where scanners are set up: a box in a frame of the scene's own, m.
  Eigen::Isometry3d T_scene_local = Eigen::Isometry3d::Identity();
  Eigen::AlignedBox3d stations;
};

struct SceneFamily {
  const char* name;
  bool degenerate;   // a direction is open whatever is scanned
  const char* open;  // which
  CalibrationScene (*make)(uint64_t seed);
};

// As many degenerate families as others.
std::span<const SceneFamily> CalibrationFamilies();

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_CALIBRATION_SCENE_H_

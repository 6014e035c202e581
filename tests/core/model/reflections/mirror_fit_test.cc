// Planes that are fitted to what mirrors of random scenes show, against the mirrors.
#include "core/model/reflections/mirror_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "core/model/scan/range_surface.h"
#include "core/parallel/thread_pool.h"
#include "core/simulation/scenes/mirror_scenes.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::model {
namespace {

struct Mirror {
  Eigen::Vector3d normal;  // unit
  Eigen::AlignedBox3d box;
};

std::vector<Mirror> MirrorsOf(const simulation::TriangleMesh& mesh) {
  std::vector<Mirror> mirrors;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (mesh.material[t] != simulation::Material::kMirror) continue;
    std::array<Eigen::Vector3d, 3> corner;
    for (size_t k = 0; k < 3; ++k) {
      corner[k] = mesh.vertices[mesh.triangles[t][k]].cast<double>();
    }
    Mirror mirror{(corner[1] - corner[0]).cross(corner[2] - corner[0]).normalized(), {}};
    for (const Eigen::Vector3d& at : corner) mirror.box.extend(at);
    // The two triangles of a mirror are drawn one after the other.
    if (!mirrors.empty() && mirrors.back().box.intersects(mirror.box)) {
      mirrors.back().box.extend(mirror.box);
    } else {
      mirrors.push_back(mirror);
    }
  }
  return mirrors;
}

TEST(MirrorFitTest, APlaneHalfADegreeOffComesBackToItsMirror) {
  parallel::ThreadPool pool(2);
  sensor::ScannerModel scanner;
  scanner.azimuth_step = scanner.elevation_step = sensor::Radians(0.4);
  int fitted = 0;
  std::vector<double> off;    // degrees
  std::vector<double> apart;  // m, in the middle of the mirror
  for (uint64_t seed = 1; seed <= 12; ++seed) {
    const simulation::MirrorScene made = simulation::RandomMirrorScene(seed);
    const simulation::SimulatedScanner simulated(made.scene.mesh);
    for (const Eigen::Vector3d& start : made.scene.starts) {
      Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
      pose.translate(start);
      const sensor::RangeImage image =
          simulated.Scan(scanner, pose, simulation::ScanFaults{}, seed, pool);
      const RangeSurface surface(image, scanner, sensor::Radians(6), pool);
      const ReturnTest own(surface);
      for (const Mirror& mirror : MirrorsOf(made.scene.mesh)) {
        const Eigen::Vector3d through = mirror.box.center() - start;
        ReflectingPlane truth{mirror.normal, -mirror.normal.dot(through), own.Behind()};
        if (truth.distance < 0) truth = {-truth.normal, -truth.distance, truth.behind};
        std::vector<Eigen::Vector3d> behind;
        for (int c = 0; c < surface.columns(); c += 2) {
          for (int r = 0; r < surface.rows(); r += 2) {
            if (!surface.Returned(c, r)) continue;
            const Eigen::Vector3d point = own.Point(c, r);
            if (truth.Above(point) > -own.WellBehind()) continue;
            if (mirror.box.contains(start + truth.Crossing(point))) behind.push_back(point);
          }
        }
        // What it shows must be what the scan itself sees, on surfaces of several directions.
        const std::array<MirrorWitness, 1> witness = {{{&own}}};
        if (behind.size() < 300 ||
            10 * ComeBack(witness, truth, behind, own.Closely()) < 9 * behind.size()) {
          continue;
        }
        for (const Eigen::Vector3d& axis :
             {Eigen::Vector3d(0, 0, 1),
              Eigen::Vector3d(truth.normal.cross(Eigen::Vector3d::UnitZ()))}) {
          const Eigen::Vector3d normal =
              Eigen::AngleAxisd(sensor::Radians(0.5), axis.normalized()) * truth.normal;
          const ReflectingPlane from{normal, -normal.dot(through) + 0.01, truth.behind};
          const ReflectingPlane found = Fit(own, from, behind);
          const auto degrees = [&](const ReflectingPlane& plane) {
            return sensor::Degrees(std::acos(std::min(1.0, plane.normal.dot(truth.normal))));
          };
          ++fitted;
          off.push_back(degrees(found));
          apart.push_back(std::abs(found.Above(through)));
        }
      }
    }
  }
  ASSERT_GT(fitted, 20);
  std::sort(off.begin(), off.end());
  std::sort(apart.begin(), apart.end());
  const auto of_ten = [](const std::vector<double>& sorted, size_t tenths) {
    return sorted[sorted.size() * tenths / 10];
  };
  std::printf("%d planes: %.3f degrees off in the median, %.3f by nine of ten; %.1f and %.1f mm\n",
              fitted, of_ten(off, 5), of_ten(off, 9), 1000 * of_ten(apart, 5),
              1000 * of_ten(apart, 9));
  EXPECT_LT(of_ten(off, 5), 0.02);
  // What a mirror shows does not always hold all of its plane. Two centimetres count twice, which
  // is less than returns may be off (ReturnTest::Agreement).
  EXPECT_LT(of_ten(off, 9), 0.2);
  EXPECT_LT(of_ten(apart, 5), 0.005);
  EXPECT_LT(of_ten(apart, 9), 0.02);
}

}  // namespace
}  // namespace vantage::model

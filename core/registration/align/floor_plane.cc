#include "core/registration/align/floor_plane.h"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/sample_consensus/ransac.h>
#include <pcl/sample_consensus/sac_model_perpendicular_plane.h>

#include <algorithm>
#include <cmath>

namespace vantage::registration {

bool FindFloorPlane(std::span<const SurfaceSample> samples, double spacing, double max_tilt,
                    FloorPlane& floor) {
  constexpr double kBelow =
      0.2;  // m, that a floor is at least below the scanner: no tripod is lower
  // m: samples lie on the plane through their neighbours, so that of a noise of 1 cm a third is
  // left; and floors are even to a centimetre. Steps are higher.
  constexpr double kThickness = 0.02;
  constexpr double kSmallestFloor = 0.5;  // m^2: more than the seat of a chair, less than any room
  constexpr size_t kFewest = 10;          // samples, however far apart: three make a plane
  const pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
  // Normals of single samples are noisy: half as much again is allowed to them.
  const double least_up = std::cos(1.5 * max_tilt);
  for (const SurfaceSample& s : samples) {
    if (s.normal.z() >= least_up && s.point.z() < -kBelow) {
      cloud->push_back({s.point.x(), s.point.y(), s.point.z()});
    }
  }
  const auto fewest = static_cast<size_t>(kSmallestFloor / (spacing * spacing));
  if (cloud->size() < std::max<size_t>(fewest, kFewest)) return false;
  // PCL draws with a fixed seed unless told otherwise.
  const pcl::SampleConsensusModelPerpendicularPlane<pcl::PointXYZ>::Ptr model(
      new pcl::SampleConsensusModelPerpendicularPlane<pcl::PointXYZ>(cloud));
  model->setAxis(Eigen::Vector3f::UnitZ());
  model->setEpsAngle(max_tilt);
  pcl::RandomSampleConsensus<pcl::PointXYZ> ransac(model, kThickness);
  ransac.setMaxIterations(500);  // finds a floor that is a quarter of what lies level, to 1e-3
  if (!ransac.computeModel()) return false;
  Eigen::VectorXf plane;
  ransac.getModelCoefficients(plane);
  pcl::Indices inliers;
  for (int round = 0; round < 3; ++round) {
    model->selectWithinDistance(plane, kThickness, inliers);
    if (inliers.size() < kFewest) return false;
    Eigen::VectorXf refined;
    model->optimizeModelCoefficients(inliers, plane, refined);
    plane = refined;
  }
  if (inliers.size() < fewest) return false;
  Eigen::Vector3d normal = plane.head<3>().cast<double>();
  const double length = normal.norm();
  const double sign = normal.z() < 0 ? -1.0 : 1.0;
  floor.normal = normal * (sign / length);
  floor.height = -static_cast<double>(plane[3]) * (sign / length);
  floor.area = static_cast<double>(inliers.size()) * spacing * spacing;
  return std::acos(std::min(1.0, floor.normal.z())) <= max_tilt;
}

}  // namespace vantage::registration

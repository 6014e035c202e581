#include "core/registration/align/floor_plane.h"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/sample_consensus/ransac.h>
#include <pcl/sample_consensus/sac_model_perpendicular_plane.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

#include "core/registration/align/wall_normals.h"

namespace vantage::registration {

namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

// m: samples lie on the plane through their neighbours, so that of a noise of 1 cm a third is left;
// and floors are even to a centimetre. Steps are higher.
constexpr double kThickness = 0.02;
constexpr size_t kFewest = 10;  // samples, however far apart: three make a plane

// The largest plane within `max_tilt` of level among the points of `level`, and which those in it
// are. False where fewer than `fewest` are in one.
bool LargestPlane(const Cloud::Ptr& cloud, const pcl::Indices& level, double spacing,
                  double max_tilt, size_t fewest, FloorPlane& plane, pcl::Indices& inliers) {
  // PCL draws with a fixed seed unless told otherwise.
  const pcl::SampleConsensusModelPerpendicularPlane<pcl::PointXYZ>::Ptr model(
      new pcl::SampleConsensusModelPerpendicularPlane<pcl::PointXYZ>(cloud, level));
  model->setAxis(Eigen::Vector3f::UnitZ());
  model->setEpsAngle(max_tilt);
  pcl::RandomSampleConsensus<pcl::PointXYZ> ransac(model, kThickness);
  ransac.setMaxIterations(500);  // finds a floor that is a quarter of what lies level, to 1e-3
  if (!ransac.computeModel()) return false;
  Eigen::VectorXf found;
  ransac.getModelCoefficients(found);
  for (int round = 0; round < 3; ++round) {
    model->selectWithinDistance(found, kThickness, inliers);
    if (inliers.size() < kFewest) return false;
    Eigen::VectorXf refined;
    model->optimizeModelCoefficients(inliers, found, refined);
    found = refined;
  }
  if (inliers.size() < fewest) return false;
  const Eigen::Vector3d normal = found.head<3>().cast<double>();
  const double length = normal.norm();
  const double sign = normal.z() < 0 ? -1.0 : 1.0;
  plane.normal = normal * (sign / length);
  plane.height = -static_cast<double>(found[3]) * (sign / length);
  plane.area = static_cast<double>(inliers.size()) * spacing * spacing;
  return std::acos(std::min(1.0, plane.normal.z())) <= max_tilt;
}

// What is left of `of`; both ascend.
pcl::Indices Without(const pcl::Indices& of, const pcl::Indices& taken) {
  pcl::Indices left;
  std::set_difference(of.begin(), of.end(), taken.begin(), taken.end(), std::back_inserter(left));
  return left;
}

}  // namespace

bool FindFloorPlane(std::span<const SurfaceSample> samples, double spacing, double max_tilt,
                    FloorPlane& floor) {
  constexpr double kBelow =
      0.2;  // m, that a floor is at least below the scanner: no tripod is lower
  constexpr double kSmallestFloor = 0.5;  // m^2: more than the seat of a chair, less than any room
  constexpr int kPlanes = 6;              // looked at: floors, tables, the flights of a ramp
  constexpr double kRival = 0.1;          // of the largest one's area
  constexpr double kOtherSlope = 0.02;    // rad, 1.1 degrees: floors may fall by 1 in 50
  // Of the walls' misfit to the largest plane: they have to be clearly better. Their noise, a
  // degree or two for each normal, is in both.
  constexpr double kBetter = 0.8;
  const Cloud::Ptr cloud(new Cloud);
  // Normals of single samples are noisy: half as much again is allowed to them.
  const double least_up = std::cos(1.5 * max_tilt);
  for (const SurfaceSample& s : samples) {
    if (s.normal.z() >= least_up && s.point.z() < -kBelow) {
      cloud->push_back({s.point.x(), s.point.y(), s.point.z()});
    }
  }
  const size_t fewest =
      std::max(static_cast<size_t>(kSmallestFloor / (spacing * spacing)), kFewest);
  if (cloud->size() < fewest) return false;
  pcl::Indices left(cloud->size());
  std::iota(left.begin(), left.end(), 0);
  pcl::Indices inliers;
  if (!LargestPlane(cloud, left, spacing, max_tilt, fewest, floor, inliers)) return false;
  const WallNormals walls(samples, spacing, max_tilt);
  if (!walls.TellUp()) return true;
  const FloorPlane largest = floor;
  double least = kBetter * walls.Misfit(largest.normal);
  for (int i = 1; i < kPlanes; ++i) {
    left = Without(left, inliers);
    FloorPlane rival;
    if (left.size() < fewest ||
        !LargestPlane(cloud, left, spacing, max_tilt, fewest, rival, inliers) ||
        rival.area < kRival * largest.area) {
      break;
    }
    if (rival.normal.cross(largest.normal).norm() < kOtherSlope) continue;
    const double misfit = walls.Misfit(rival.normal);
    if (misfit >= least) continue;
    least = misfit;
    floor = rival;
  }
  return true;
}

}  // namespace vantage::registration

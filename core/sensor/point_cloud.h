// Points that come without a grid and without the place they were seen from: LAS, PLY, text. Who
// gives that place gets a scan.
#ifndef VANTAGE_CORE_SENSOR_POINT_CLOUD_H_
#define VANTAGE_CORE_SENSOR_POINT_CLOUD_H_

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/sensor/appearance.h"
#include "core/sensor/imported_scan.h"

namespace vantage::sensor {

// The points of one scan, all seen from `station`.
class PointCloud {
 public:
  // `station`: where the scanner stood, in the frame and the unit (m) of the points. That frame is
  // taken for the world's; z points up.
  PointCloud(const Eigen::Vector3d& station, double unit)
      : station_(station), unit_(unit), far_(unit) {}

  void Reserve(size_t points) { points_.reserve(points); }
  size_t size() const { return points_.size(); }
  // `point`: in the frame and the unit of the file, which may be a national grid's.
  // INVALID_ARGUMENT: NaN or infinite. `where` names the point for people ("LAS point 12").
  absl::Status Add(const Eigen::Vector3d& point, absl::FunctionRef<std::string()> where);

  // What the file has of how the points looked, and of that, by point in the order in which they
  // were added, what is wanted.
  void SetAppearance(AppearanceKinds has, Appearance appearance) {
    has_ = has;
    appearance_ = std::move(appearance);
  }

  // Sorts the points into a grid by their directions (gridded_scan.h, rules 2 and 4). What that
  // loses: directions without a point count as rays without a return, also where the instrument did
  // not look or its program dropped what it saw; of points in one direction one is kept. The pose
  // is the station's place, turned as the points are.
  // INVALID_ARGUMENT: no scan can be made of the points; or many lie behind others, as where a file
  // has the points of several stations.
  absl::StatusOr<ImportedScan> ToScan(const ImportLimits& limits) const;

 private:
  Eigen::Vector3d station_;
  double unit_;                          // m
  std::vector<Eigen::Vector3f> points_;  // m, from the station; zero: too far
  AppearanceKinds has_;
  Appearance appearance_;
  FarReturns far_;
};

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_POINT_CLOUD_H_

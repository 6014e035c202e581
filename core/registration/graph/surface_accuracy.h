// How far the points that were measured lie off their true places, at 95 %: by how well the
// stations' poses are known, and by the instrument's noise.
#ifndef VANTAGE_CORE_REGISTRATION_GRAPH_SURFACE_ACCURACY_H_
#define VANTAGE_CORE_REGISTRATION_GRAPH_SURFACE_ACCURACY_H_

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"

namespace vantage::registration {

using PoseCovariance = Eigen::Matrix<double, 6, 6>;

// A station as points that were measured from it need it.
struct KnownStation {
  Eigen::Vector3d position;  // m, model frame, centre of projection
  // Of the error of its pose, over [rotation about the model's axes, rad; translation, m], about
  // `position`. Nothing: it is not known.
  std::optional<PoseCovariance> covariance;
  double range_max = 0;  // m
};

// Variance of a measured point along its ray by the instrument alone, m2, from a station at a range
// (m).
using InstrumentVariance = absl::FunctionRef<double(size_t station, double range)>;

// Of a group of surface.
struct SurfaceAccuracy {
  double area = 0;  // m2, whose accuracy is known
  // Length that 95 % of its points lie within of their true places, m; nothing without area.
  std::optional<double> bound;
  double area_unknown = 0;  // m2: of stations whose pose's covariance is not known
};

struct SurfaceAccuracies {
  std::vector<SurfaceAccuracy> groups;
  SurfaceAccuracy all;  // of all groups together
};

// By group of measured surface: `group_of` says which of `groups` a place (m, model frame) is in,
// or none: then it does not count. A point counts as measured from the nearest station in whose
// range and sight it is; where none of the eight nearest sees it, as from the worst of these. Of
// more surface than `most_points` voxels every second, third, ... is looked at. Nothing when
// cancelled on the way.
std::optional<SurfaceAccuracies> MeasureSurfaceAccuracy(
    const model::PlanningView& model, std::span<const KnownStation> stations,
    InstrumentVariance instrument, size_t groups,
    absl::FunctionRef<std::optional<size_t>(const Eigen::Vector3d&)> group_of,
    size_t most_points = 50'000, const parallel::Cancellation& cancelled = {});

// Of a point `arm` (m) from a pose's centre: covariance of its error, m2.
Eigen::Matrix3d PointCovariance(const PoseCovariance& covariance, const Eigen::Vector3d& arm);

// Length that a normally distributed error with this covariance (m2) is within at 95 %, m. Its
// square is taken as a multiple of a chi-square variable with the same mean and variance
// (Satterthwaite 1946), which is exact where the error has one direction, or the same variance in
// two or three; in between the length is right to 4 %.
double Bound95(const Eigen::Matrix3d& covariance);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_GRAPH_SURFACE_ACCURACY_H_

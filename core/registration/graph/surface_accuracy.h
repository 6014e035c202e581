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
// (m) and the cosine of the incidence.
using InstrumentVariance =
    absl::FunctionRef<double(size_t station, double range, double cos_incidence)>;

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
// range and sight it is; where none of the eight nearest sees it, as from the worst of these. Its
// error is taken as normally distributed in three dimensions with the standard deviation of its
// worst direction in all of them, which is never too small. Of more surface than `most_points`
// voxels every second, third, ... is looked at. Nothing when cancelled on the way.
std::optional<SurfaceAccuracies> MeasureSurfaceAccuracy(
    const model::PlanningView& model, std::span<const KnownStation> stations,
    InstrumentVariance instrument, size_t groups,
    absl::FunctionRef<std::optional<size_t>(const Eigen::Vector3d&)> group_of,
    size_t most_points = 50'000, const parallel::Cancellation& cancelled = {});

// Of a point `arm` (m) from a pose's centre: variance of its error in the worst direction, m2.
double WorstPointVariance(const PoseCovariance& covariance, const Eigen::Vector3d& arm);

// Length that a normally distributed error of these axes' standard deviation (m) is within at 95 %,
// m.
double Bound95(double sigma);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_GRAPH_SURFACE_ACCURACY_H_

#include "core/registration/graph/surface_accuracy.h"

#include <algorithm>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <utility>

namespace vantage::registration {
namespace {

constexpr double kShare = 0.95;
constexpr size_t kNearestStations = 8;

// A squared length's distribution: `scale` times a chi-square variable with `freedom`.
struct SquaredLength {
  double scale = 0;  // m2
  double freedom = 1;
};

SquaredLength SquaredLengthOf(const Eigen::Matrix3d& covariance) {
  const double mean = covariance.trace();
  const double squares = covariance.squaredNorm();
  if (!(mean > 0)) return {};
  return {squares / mean, std::clamp(mean * mean / squares, 1.0, 3.0)};
}

double ShareWithin(double length, const SquaredLength& of) {
  if (!(of.scale > 0)) return 1;
  return boost::math::gamma_p(0.5 * of.freedom, 0.5 * length * length / of.scale);
}

// Points of one distribution, as many as their area.
struct Points {
  SquaredLength error;
  double area = 0;  // m2
};

// The length that `kShare` of all points' errors are within.
double LengthOf(std::span<const Points> points) {
  double area = 0;
  double largest = 0;
  for (const Points& of : points) {
    area += of.area;
    largest = std::max(largest, of.error.scale);
  }
  double low = 0;
  double high = 3 * std::sqrt(largest);  // 99 % of three directions
  for (int i = 0; i < 40 && high - low > 1e-6 * high; ++i) {
    const double middle = 0.5 * (low + high);
    double within = 0;
    for (const Points& of : points) within += of.area * ShareWithin(middle, of.error);
    (within < kShare * area ? low : high) = middle;
  }
  return high;
}

// True where nothing measured stands between the two places but what is at the point itself.
bool Sees(const model::PlanningView& model, const Eigen::Vector3d& from,
          const Eigen::Vector3d& point) {
  const Eigen::Vector3d way = point - from;
  const double length = way.norm();
  const double step = model.voxel_size();
  // A surface has thickness, and a voxel a diagonal.
  const double end = length - 2 * step;
  for (double at = step; at < end; at += step) {
    const model::VoxelState state = model.State(model.At(from + way * (at / length)));
    if (state == model::VoxelState::kTrueSurface || state == model::VoxelState::kAbsorbed) {
      return false;
    }
  }
  return true;
}

// How far off a point is, as from the station that it counts for.
class PointErrors {
 public:
  PointErrors(const model::PlanningView& model, std::span<const KnownStation> stations,
              InstrumentVariance instrument)
      : model_(model), stations_(stations), instrument_(instrument) {}

  // Nothing where the pose of that station is not known.
  std::optional<SquaredLength> Of(const Eigen::Vector3d& point) {
    nearest_.clear();
    for (size_t i = 0; i < stations_.size(); ++i) {
      const double distance = (stations_[i].position - point).norm();
      if (distance <= stations_[i].range_max) nearest_.emplace_back(distance, i);
    }
    // Surface beyond every station's range has come with one all the same.
    if (nearest_.empty()) {
      for (size_t i = 0; i < stations_.size(); ++i) {
        nearest_.emplace_back((stations_[i].position - point).norm(), i);
      }
    }
    const size_t looked_at = std::min(kNearestStations, nearest_.size());
    std::partial_sort(nearest_.begin(), nearest_.begin() + static_cast<std::ptrdiff_t>(looked_at),
                      nearest_.end());
    std::optional<Eigen::Matrix3d> worst;
    bool all_known = looked_at > 0;
    for (size_t k = 0; k < looked_at; ++k) {
      const size_t station = nearest_[k].second;
      const std::optional<Eigen::Matrix3d> error = From(station, point);
      if (Sees(model_, stations_[station].position, point)) {
        return error.has_value() ? std::optional(SquaredLengthOf(*error)) : std::nullopt;
      }
      all_known = all_known && error.has_value();
      if (error.has_value() && (!worst.has_value() || error->trace() > worst->trace())) {
        worst = error;
      }
    }
    return all_known ? std::optional(SquaredLengthOf(*worst)) : std::nullopt;
  }

 private:
  std::optional<Eigen::Matrix3d> From(size_t station, const Eigen::Vector3d& point) const {
    const KnownStation& from = stations_[station];
    if (!from.covariance.has_value()) return std::nullopt;
    const Eigen::Vector3d arm = point - from.position;
    const Eigen::Vector3d ray = arm.normalized();
    return PointCovariance(*from.covariance, arm) +
           instrument_(station, arm.norm()) * ray * ray.transpose();
  }

  const model::PlanningView& model_;
  const std::span<const KnownStation> stations_;
  const InstrumentVariance instrument_;
  std::vector<std::pair<double, size_t>> nearest_;
};

}  // namespace

double Bound95(const Eigen::Matrix3d& covariance) {
  const Points alone{SquaredLengthOf(covariance), 1};
  return LengthOf({&alone, 1});
}

Eigen::Matrix3d PointCovariance(const PoseCovariance& covariance, const Eigen::Vector3d& arm) {
  // A small turn by w moves the point by w x arm.
  Eigen::Matrix<double, 3, 6> moves;
  moves << 0, arm.z(), -arm.y(), 1, 0, 0,  //
      -arm.z(), 0, arm.x(), 0, 1, 0,       //
      arm.y(), -arm.x(), 0, 0, 0, 1;
  return moves * covariance * moves.transpose();
}

std::optional<SurfaceAccuracies> MeasureSurfaceAccuracy(
    const model::PlanningView& model, std::span<const KnownStation> stations,
    InstrumentVariance instrument, size_t groups,
    absl::FunctionRef<std::optional<size_t>(const Eigen::Vector3d&)> group_of, size_t most_points,
    const parallel::Cancellation& cancelled) {
  SurfaceAccuracies accuracies;
  accuracies.groups.resize(groups);
  std::vector<Points> all;
  std::vector<std::vector<Points>> points(groups);
  const size_t stride = 1 + model.SurfaceCount() / std::max<size_t>(1, most_points);
  PointErrors errors(model, stations, instrument);
  size_t number = 0;
  bool stopped = false;
  model.ForEachSurface(
      [&](const model::VoxelIndex&, model::VoxelState state, const model::SurfaceVoxel& surface) {
        if (state != model::VoxelState::kTrueSurface || number++ % stride != 0 || stopped) return;
        if (number % 1024 == 0 && cancelled.Requested()) stopped = true;
        const Eigen::Vector3d place = surface.centroid.cast<double>();
        const std::optional<size_t> group = group_of(place);
        if (!group.has_value()) return;
        const double area = static_cast<double>(surface.area) * static_cast<double>(stride);
        const std::optional<SquaredLength> of = errors.Of(place);
        if (of.has_value()) {
          all.push_back({*of, area});
          points[*group].push_back({*of, area});
          accuracies.groups[*group].area += area;
          accuracies.all.area += area;
        } else {
          accuracies.groups[*group].area_unknown += area;
          accuracies.all.area_unknown += area;
        }
      });
  if (stopped) return std::nullopt;
  for (size_t i = 0; i < groups; ++i) {
    if (!points[i].empty()) accuracies.groups[i].bound = LengthOf(points[i]);
  }
  if (!all.empty()) accuracies.all.bound = LengthOf(all);
  return accuracies;
}

}  // namespace vantage::registration

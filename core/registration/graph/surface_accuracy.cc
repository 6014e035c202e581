#include "core/registration/graph/surface_accuracy.h"

#include <algorithm>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <map>
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

// Points by the distribution of their errors, as many as their area. Distributions that are nearly
// the same (2 % in scale, a fiftieth of a degree of freedom) are one, of their mean.
class Points {
 public:
  void Add(const SquaredLength& error, double area) {
    const double scale = std::max(error.scale, 1e-14);
    Group& group = groups_[{static_cast<int>(std::floor(std::log(scale) / 0.02)),
                            static_cast<int>(std::floor(error.freedom / 0.02))}];
    group.area += area;
    group.scale += area * error.scale;
    group.freedom += area * error.freedom;
  }
  bool empty() const { return groups_.empty(); }

  // The length that `kShare` of all points' errors are within.
  double Length() const {
    double area = 0;
    double largest = 0;
    for (const auto& [key, of] : groups_) {
      area += of.area;
      largest = std::max(largest, of.scale / of.area);
    }
    double low = 0;
    double high = 3 * std::sqrt(largest);  // 97 % of three directions
    for (int i = 0; i < 40 && high - low > 1e-6 * high; ++i) {
      const double middle = 0.5 * (low + high);
      double within = 0;
      for (const auto& [key, of] : groups_) {
        within += of.area * ShareWithin(middle, {of.scale / of.area, of.freedom / of.area});
      }
      (within < kShare * area ? low : high) = middle;
    }
    return high;
  }

 private:
  struct Group {
    double area = 0;   // m2
    double scale = 0;  // times area, as the next
    double freedom = 0;
  };
  std::map<std::pair<int, int>, Group> groups_;
};

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
  std::optional<SquaredLength> Of(const Eigen::Vector3d& point,
                                  const model::SurfaceVoxel& surface) {
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
      // From behind a surface nobody sees it, as far as it is known which side that is.
      const bool before = surface.ambiguous || surface.normal.cast<double>().dot(
                                                   stations_[station].position - point) > 0;
      if (before && Sees(model_, stations_[station].position, point)) {
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
  Points alone;
  alone.Add(SquaredLengthOf(covariance), 1);
  return alone.Length();
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
  Points all;
  std::vector<Points> points(groups);
  const size_t stride = 1 + model.SurfaceCount() / std::max<size_t>(1, most_points);
  PointErrors errors(model, stations, instrument);
  size_t number = 0;
  size_t looked_at = 0;
  bool stopped = false;
  model.ForEachSurface(
      [&](const model::VoxelIndex&, model::VoxelState state, const model::SurfaceVoxel& surface) {
        if (stopped || state != model::VoxelState::kTrueSurface || number++ % stride != 0) return;
        if (looked_at++ % 1024 == 0 && cancelled.Requested()) stopped = true;
        const Eigen::Vector3d place = surface.centroid.cast<double>();
        const std::optional<size_t> group = group_of(place);
        if (!group.has_value()) return;
        const double area = static_cast<double>(surface.area) * static_cast<double>(stride);
        const std::optional<SquaredLength> of = errors.Of(place, surface);
        for (SurfaceAccuracy* accuracy : {&accuracies.groups[*group], &accuracies.all}) {
          (of.has_value() ? accuracy->area : accuracy->area_unknown) += area;
        }
        if (!of.has_value()) return;
        all.Add(*of, area);
        points[*group].Add(*of, area);
      });
  if (stopped) return std::nullopt;
  for (size_t i = 0; i < groups; ++i) {
    if (!points[i].empty()) accuracies.groups[i].bound = points[i].Length();
  }
  if (!all.empty()) accuracies.all.bound = all.Length();
  return accuracies;
}

}  // namespace vantage::registration

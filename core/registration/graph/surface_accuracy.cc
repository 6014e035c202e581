#include "core/registration/graph/surface_accuracy.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace vantage::registration {
namespace {

constexpr double kShare = 0.95;
// The root of the 95 % quantile of chi-square with three degrees of freedom.
constexpr double kBound95 = 2.7955;
constexpr size_t kNearestStations = 8;

// Points of one variance, as many as their area.
struct Points {
  double variance = 0;  // m2
  double area = 0;      // m2
};

// Share of the errors of this variance that are no longer than `length`: Maxwell's distribution.
double ShareWithin(double length, double variance) {
  if (variance <= 0) return 1;
  const double x = length / std::sqrt(variance);
  return std::erf(x / std::numbers::sqrt2) -
         std::sqrt(2 / std::numbers::pi) * x * std::exp(-0.5 * x * x);
}

// The length that `kShare` of all points' errors are within.
double LengthOf(std::span<const Points> points) {
  double area = 0;
  double largest = 0;
  for (const Points& of : points) {
    area += of.area;
    largest = std::max(largest, of.variance);
  }
  double low = 0;
  double high = kBound95 * std::sqrt(largest);
  for (int i = 0; i < 50 && high - low > 1e-7; ++i) {
    const double middle = 0.5 * (low + high);
    double within = 0;
    for (const Points& of : points) within += of.area * ShareWithin(middle, of.variance);
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

// The variance of a point as from one station, m2; nothing where that one's pose is not known.
class PointVariance {
 public:
  PointVariance(const model::PlanningView& model, std::span<const KnownStation> stations,
                InstrumentVariance instrument)
      : model_(model), stations_(stations), instrument_(instrument) {}

  std::optional<double> Of(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
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
    std::optional<double> worst = 0;
    for (size_t k = 0; k < looked_at; ++k) {
      const size_t station = nearest_[k].second;
      const std::optional<double> variance = From(station, point, normal);
      if (Sees(model_, stations_[station].position, point)) return variance;
      if (!variance.has_value() || !worst.has_value()) {
        worst = std::nullopt;
      } else {
        worst = std::max(*worst, *variance);
      }
    }
    return looked_at == 0 ? std::nullopt : worst;
  }

 private:
  std::optional<double> From(size_t station, const Eigen::Vector3d& point,
                             const Eigen::Vector3d& normal) const {
    const KnownStation& from = stations_[station];
    if (!from.covariance.has_value()) return std::nullopt;
    const Eigen::Vector3d arm = point - from.position;
    const double range = arm.norm();
    const double cosine = range > 0 ? std::abs(arm.dot(normal)) / range : 1;
    return WorstPointVariance(*from.covariance, arm) + instrument_(station, range, cosine);
  }

  const model::PlanningView& model_;
  const std::span<const KnownStation> stations_;
  const InstrumentVariance instrument_;
  std::vector<std::pair<double, size_t>> nearest_;
};

}  // namespace

double Bound95(double sigma) { return kBound95 * sigma; }

double WorstPointVariance(const PoseCovariance& covariance, const Eigen::Vector3d& arm) {
  // A small turn by w moves the point by w x arm.
  Eigen::Matrix<double, 3, 6> moves;
  moves << 0, arm.z(), -arm.y(), 1, 0, 0,  //
      -arm.z(), 0, arm.x(), 0, 1, 0,       //
      arm.y(), -arm.x(), 0, 0, 0, 1;
  const Eigen::Matrix3d of_point = moves * covariance * moves.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(of_point, Eigen::EigenvaluesOnly);
  return std::max(0.0, solver.eigenvalues().maxCoeff());
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
  PointVariance variance(model, stations, instrument);
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
        const std::optional<double> of = variance.Of(place, surface.normal.cast<double>());
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

#include "core/model/scan/scan_planes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

namespace vantage::model {

namespace {

// Distance to the neighbours from which a normal is computed, m: a noise of 3 mm then turns it by a
// degree, and most furniture is wider. When cells are farther apart, the next ones are used.
constexpr double kBaseline = 0.12;
constexpr int kSample = 16'000;      // cells looked at
constexpr double kLeastArea = 0.25;  // m^2: a cupboard's door
constexpr size_t kLeastCells = 12;   // of the sample: four for each of a plane's three parameters
// Of the sample, spread over it: a plane that holds a tenth of it is missed once in 150 times.
constexpr size_t kHypotheses = 48;
constexpr int kMostPoor = 16;  // poor planes that are put aside before the search ends

// How far samples of one plane may be off it, and normals off its own: what walls are uneven by,
// skirting boards and frames, or what noise explains where that is more.
struct PlaneTolerance {
  explicit PlaneTolerance(double range_sigma)
      : flat(std::max(0.02, 4 * range_sigma)),
        on_plane(static_cast<float>(std::max(0.03, 5 * range_sigma))),
        // Both ends of a baseline are noisy, and its neighbours' likewise: four sigma.
        same_normal(static_cast<float>(
            std::min(0.985, std::cos(4 * std::sqrt(2.0) * range_sigma / (2 * kBaseline))))) {}

  double flat;        // m, of a normal's neighbours off its cell; 20 mm up to a noise of 5 mm
  float on_plane;     // m; 30 mm up to a noise of 6 mm
  float same_normal;  // cosine; 10 degrees up to a noise of 7 mm
};

struct PlaneCandidate {
  ScanCell cell;
  Eigen::Vector3f point;
  Eigen::Vector3f normal;
  float area;  // m^2 that it stands for, over the share of directions that the image covers
};

bool On(const PlaneCandidate& candidate, const Eigen::Vector3f& normal, float distance,
        const PlaneTolerance& tolerance) {
  return candidate.normal.dot(normal) > tolerance.same_normal &&
         std::abs(normal.dot(candidate.point) + distance) < tolerance.on_plane;
}

std::vector<PlaneCandidate> FlatCells(const RangeSurface& surface) {
  std::vector<PlaneCandidate> flat;
  const double cells = static_cast<double>(surface.columns()) * surface.rows();
  const int stride = std::max(1, static_cast<int>(std::sqrt(cells / kSample)));
  // As if the image went all around and from pole to pole; FindScanPlanes() puts that right.
  const double solid_step =
      2 * sensor::kPi / surface.columns() * sensor::kPi / surface.rows() * stride * stride;
  for (int c = 0; c < surface.columns(); c += stride) {
    for (int r = 0; r < surface.rows(); r += stride) {
      const Eigen::Vector3d normal = NormalAround(surface, c, r);
      if (normal.isZero()) continue;
      const double range = static_cast<double>(surface.at(c, r));
      const Eigen::Vector3d direction = surface.Direction(c, r);
      const double cosine = std::max(0.2, -normal.dot(direction));
      const double area = range * range * solid_step * direction.head<2>().norm() / cosine;
      flat.push_back({{c, r},
                      (range * direction).cast<float>(),
                      normal.cast<float>(),
                      static_cast<float>(area)});
    }
  }
  return flat;
}

// Refits normal and distance to the candidates on the plane.
void Refit(const std::vector<PlaneCandidate>& flat, const PlaneTolerance& tolerance,
           Eigen::Vector3f& normal, float& distance) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  double weight = 0;
  for (const PlaneCandidate& candidate : flat) {
    if (!On(candidate, normal, distance, tolerance)) continue;
    const Eigen::Vector3d p = candidate.point.cast<double>();
    const double w = static_cast<double>(candidate.area);
    sum += w * p;
    products += w * p * p.transpose();
    weight += w;
  }
  if (!(weight > 0)) return;
  const Eigen::Vector3d mean = sum / weight;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(products / weight -
                                                              mean * mean.transpose());
  Eigen::Vector3d fitted = solver.eigenvectors().col(0);
  if (fitted.dot(mean) > 0) fitted = -fitted;
  normal = fitted.cast<float>();
  distance = static_cast<float>(-fitted.dot(mean));
}

}  // namespace

Eigen::Vector3d NormalAround(const RangeSurface& surface, int column, int row) {
  Eigen::Vector3d none = Eigen::Vector3d::Zero();
  if (!surface.Returned(column, row)) return none;
  const double range = static_cast<double>(surface.at(column, row));
  const Eigen::Vector3d direction = surface.Direction(column, row);
  const double level = std::max(0.05, direction.head<2>().norm());
  const auto cells = [&](double step) {
    return std::clamp(static_cast<int>(std::lround(kBaseline / (range * step))), 1, 100);
  };
  const int across = cells(level * surface.azimuth().mean_step());
  const int along = cells(surface.elevation().mean_step());
  int left = column - across;
  int right = column + across;
  if (surface.azimuth().closed()) {
    left = (left + surface.columns()) % surface.columns();
    right %= surface.columns();
  }
  if (left < 0 || right >= surface.columns() || left == right) return none;
  if (row < along || row + along >= surface.rows()) return none;
  const std::array<ScanCell, 4> around = {
      {{left, row}, {right, row}, {column, row - along}, {column, row + along}}};
  std::array<Eigen::Vector3d, 4> point;
  for (size_t i = 0; i < 4; ++i) {
    const auto& [c, r] = around[i];
    if (!surface.Returned(c, r)) return none;
    point[i] = static_cast<double>(surface.at(c, r)) * surface.Direction(c, r);
  }
  const Eigen::Vector3d centre = range * direction;
  Eigen::Vector3d normal = (point[1] - point[0]).cross(point[3] - point[2]);
  const double length = normal.norm();
  if (!(length > 0)) return none;
  normal /= length;
  if (normal.dot(centre) > 0) normal = -normal;
  const double flat = PlaneTolerance(surface.range_sigma()).flat;
  for (const Eigen::Vector3d& p : point) {
    if (std::abs(normal.dot(p - centre)) > flat) return none;
  }
  return normal;
}

std::vector<ScanPlane> FindScanPlanes(const RangeSurface& surface, int most,
                                      parallel::Parallel& parallel) {
  const PlaneTolerance tolerance(surface.range_sigma());
  // The share of all azimuths and elevations that the image covers.
  const double covered = surface.columns() * surface.azimuth().mean_step() / (2 * sensor::kPi) *
                         surface.rows() * surface.elevation().mean_step() / sensor::kPi;
  std::vector<PlaneCandidate> flat = FlatCells(surface);
  std::vector<ScanPlane> planes;
  int poor = 0;
  while (static_cast<int>(planes.size()) < most && flat.size() >= kLeastCells) {
    // Tries the planes of some cells spread over the rest and takes the one that holds most area.
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();
    float distance = 0;
    float most_area = 0;
    std::array<float, kHypotheses> areas{};
    const auto pick = [&flat](size_t h) -> const PlaneCandidate& {
      return flat[(2 * h + 1) * flat.size() / (2 * kHypotheses)];
    };
    const auto at = [&](size_t h) { return -pick(h).normal.dot(pick(h).point); };
    parallel.For(kHypotheses, [&](size_t h) {
      const Eigen::Vector3f& along = pick(h).normal;
      const float distance_of = at(h);
      float area = 0;
      for (size_t i = h % 4; i < flat.size(); i += 4) {
        if (On(flat[i], along, distance_of, tolerance)) area += flat[i].area;
      }
      areas[h] = area;
    });
    for (size_t h = 0; h < kHypotheses; ++h) {
      if (areas[h] > most_area) {
        most_area = areas[h];
        normal = pick(h).normal;
        distance = at(h);
      }
    }
    if (!(most_area > 0)) break;
    for (int round = 0; round < 3; ++round) Refit(flat, tolerance, normal, distance);
    ScanPlane plane;
    plane.normal = normal.cast<double>();
    plane.distance = static_cast<double>(distance);
    std::vector<PlaneCandidate> rest;
    for (const PlaneCandidate& candidate : flat) {
      if (On(candidate, normal, distance, tolerance)) {
        plane.area += covered * static_cast<double>(candidate.area);
        plane.cells.push_back(candidate.cell);
      } else {
        rest.push_back(candidate);
      }
    }
    // A few far cells can count for more area than a wall nearby. They are put aside, and the
    // search goes on.
    const bool is_plane = plane.cells.size() >= kLeastCells && plane.area >= kLeastArea;
    if (!is_plane && (plane.cells.empty() || ++poor > kMostPoor)) break;
    if (is_plane && plane.distance > 0) planes.push_back(std::move(plane));
    flat = std::move(rest);
  }
  return planes;
}

}  // namespace vantage::model

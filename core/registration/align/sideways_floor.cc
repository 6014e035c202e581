#include "core/registration/align/sideways_floor.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "core/sensor/scanner_model.h"

namespace vantage::registration {
namespace {

constexpr double kTilt = sensor::Radians(15);  // of planes about level, and of walls about upright
constexpr double kApart = 0.15;  // m: nearer to a plane is its relief, skirting boards and noise
constexpr double kThickness = 0.03;  // m, either side of a plane that holds a sample

// m^2 of surface that each sample stands for, by the rays that met it: samples themselves lie twice
// as densely on a plane that noise spreads over two layers of cubes.
std::vector<double> AreasOf(std::span<const SurfaceSample> samples,
                            const sensor::RangeImage& image) {
  const double turn = image.full_turn ? 2 * sensor::kPi / image.columns()
                                      : (image.azimuth.back() - image.azimuth.front()) /
                                            std::max(1, image.columns() - 1);
  const double step =
      turn * (image.elevation.back() - image.elevation.front()) / std::max(1, image.rows() - 1);
  std::vector<double> areas;
  areas.reserve(samples.size());
  for (const SurfaceSample& s : samples) {
    const Eigen::Vector3d p = s.point.cast<double>();
    // range^2 cos(elevation) / cos(incidence); normals have an incidence below a right angle.
    const double facing = -s.normal.cast<double>().dot(p);
    areas.push_back(s.cells * step * p.squaredNorm() * p.head<2>().norm() / facing);
  }
  return areas;
}

// m^2 of the samples in a plane.
double AreaIn(const FloorPlane& plane, std::span<const SurfaceSample> samples,
              std::span<const double> areas) {
  const double least_along = std::cos(kTilt);
  double area = 0;
  for (size_t i = 0; i < samples.size(); ++i) {
    const double off = plane.normal.dot(samples[i].point.cast<double>()) - plane.height;
    if (std::abs(off) > kThickness) continue;
    if (plane.normal.dot(samples[i].normal.cast<double>()) >= least_along) area += areas[i];
  }
  return area;
}

// With z along `up` (unit).
std::vector<SurfaceSample> LevelledBy(std::span<const SurfaceSample> samples,
                                      const Eigen::Vector3d& up) {
  const Eigen::Matrix3f turn = Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ())
                                   .toRotationMatrix()
                                   .cast<float>();
  std::vector<SurfaceSample> turned(samples.begin(), samples.end());
  for (SurfaceSample& s : turned) {
    s.point = turn * s.point;
    s.normal = turn * s.normal;
  }
  return turned;
}

// The directions, rad from +x, that most of what is steep faces. `level`: samples with z up.
std::vector<double> WallDirections(std::span<const SurfaceSample> level,
                                   std::span<const double> areas) {
  constexpr int kBins = 72;
  constexpr int kNeighbours = 3;      // bins, 15 degrees, within which one direction counts
  constexpr double kLeastArea = 1.0;  // m^2, of a plane that is larger than a floor
  const double steepest = std::sin(kTilt);
  std::array<double, kBins> single{};
  for (size_t i = 0; i < level.size(); ++i) {
    const Eigen::Vector3f& normal = level[i].normal;
    if (std::abs(normal.z()) > steepest) continue;
    const double turn = std::atan2(normal.y(), normal.x()) / (2 * sensor::kPi) + 1;
    single[static_cast<size_t>(turn * kBins) % kBins] += areas[i];
  }
  const auto at = [](int bin) { return static_cast<size_t>((bin + kBins) % kBins); };
  std::array<double, kBins> smooth{};
  for (int i = 0; i < kBins; ++i) {
    smooth[at(i)] = single[at(i - 1)] + single[at(i)] + single[at(i + 1)];
  }
  std::vector<double> directions;
  for (int i = 0; i < kBins; ++i) {
    bool most = smooth[at(i)] >= kLeastArea;
    for (int k = 1; most && k <= kNeighbours; ++k) {
      most = smooth[at(i)] >= smooth[at(i + k)] && smooth[at(i)] > smooth[at(i - k)];
    }
    if (most) directions.push_back((i + 0.5) * 2 * sensor::kPi / kBins);
  }
  return directions;
}

// Of the rays within 45 degrees of `direction` (unit, scanner frame) the share that met nothing. 0
// where there are none.
double OpenShare(const sensor::RangeImage& image, const Eigen::Vector3d& direction) {
  constexpr int kStride = 3;  // a ninth of the rays, at most some degrees apart, are enough
  const double least = std::cos(sensor::Radians(45));
  double rays = 0;
  double open = 0;
  for (int c = 0; c < image.columns(); c += kStride) {
    for (int r = 0; r < image.rows(); r += kStride) {
      if (image.Direction(c, r).dot(direction) < least) continue;
      const double weight = std::cos(image.elevation[static_cast<size_t>(r)]);
      rays += weight;
      if (!sensor::RangeImage::IsRange(image.at(c, r))) open += weight;
    }
  }
  return rays > 0 ? open / rays : 0;
}

// m^2, at `distance` m along the axis, within the cone that the scanner does not see from
// `elevation` rad to the axis.
double UnseenArea(double distance, double elevation) {
  constexpr double kWidest = sensor::Radians(60);  // beyond it, walls end the plane
  const double angle = std::clamp(sensor::kPi / 2 - std::abs(elevation), 0.0, kWidest);
  const double radius = distance * std::tan(angle);
  return sensor::kPi * radius * radius;
}

// A floor that is level where `level` has z up, and what lies opposite; nothing where it is none.
std::optional<SidewaysFloor> FloorOf(std::vector<SurfaceSample> level,
                                     std::span<const double> areas, double spacing,
                                     bool open_above) {
  constexpr double kFarthest = 2.2;  // m: no tripod is higher
  constexpr double kLowestRoom = 2;  // m
  constexpr double kBehind = 0.05;   // of its area: what doors and windows in walls let through
  FloorPlane floor;
  if (!FindFloorPlane(level, spacing, kTilt, floor) || -floor.height > kFarthest) return {};
  SidewaysFloor found;
  found.distance = -floor.height;
  found.area = AreaIn(floor, level, areas);
  double behind = 0;
  for (size_t i = 0; i < level.size(); ++i) {
    const double over = floor.normal.dot(level[i].point.cast<double>()) - floor.height;
    if (over < -kApart) behind += areas[i];
  }
  if (behind > kBehind * found.area) return {};
  for (SurfaceSample& s : level) {
    s.point.z() = -s.point.z();
    s.normal.z() = -s.normal.z();
  }
  FloorPlane ceiling;
  if (FindFloorPlane(level, spacing, kTilt, ceiling)) {
    if (-floor.height - ceiling.height < kLowestRoom) return {};
    found.area += AreaIn(ceiling, level, areas);
  } else if (open_above) {
    found.area *= 2;
  }
  return found;
}

// m^2 of all that is level within `level`, seen or hidden from the scanner by its own field of
// view: floors at several heights, ramps, what stands on them, ceilings and pitched roofs.
double LevelArea(std::span<const SurfaceSample> level, std::span<const double> areas,
                 const sensor::RangeImage& image, double floor_height) {
  const double least_up = std::cos(sensor::Radians(60));  // of roofs, which are rarely steeper
  double area = UnseenArea(-floor_height, image.elevation.front());
  double ceiling = 0;  // m
  for (size_t i = 0; i < level.size(); ++i) {
    const SurfaceSample& s = level[i];
    if (std::abs(s.normal.z()) < least_up) continue;
    area += areas[i];
    if (s.normal.z() < 0) ceiling = std::max(ceiling, static_cast<double>(s.point.z()));
  }
  return area + UnseenArea(ceiling, image.elevation.back());
}

}  // namespace

std::optional<SidewaysFloor> FindSidewaysFloor(std::span<const SurfaceSample> samples,
                                               const sensor::RangeImage& image, double spacing,
                                               const FloorPlane& floor) {
  // Of some 1,250 upright scans of flats, houses, offices, halls and bare rooms none had more
  // than 1.11 times as much.
  constexpr double kClearlyMore = 1.15;
  // Of the rays within 45 degrees: houses in a yard leave more of the sky, and beside a scanner the
  // ground is in half of them.
  constexpr double kSky = 0.7;
  if (OpenShare(image, floor.normal) >= kSky) return {};
  const std::vector<double> areas = AreasOf(samples, image);
  const std::vector<SurfaceSample> level = LevelledBy(samples, floor.normal);
  const double level_area = LevelArea(level, areas, image, floor.height);
  const Eigen::Quaterniond turn =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), floor.normal);
  std::optional<SidewaysFloor> best;
  for (const double heading : WallDirections(level, areas)) {
    const Eigen::Vector3d sideways =
        turn * Eigen::Vector3d(std::cos(heading), std::sin(heading), 0);
    std::optional<SidewaysFloor> rival =
        FloorOf(LevelledBy(samples, sideways), areas, spacing, OpenShare(image, sideways) >= kSky);
    if (!rival.has_value() || rival->area < kClearlyMore * level_area) continue;
    if (best.has_value() && best->area >= rival->area) continue;
    rival->level_area = level_area;
    best = rival;
  }
  return best;
}

}  // namespace vantage::registration

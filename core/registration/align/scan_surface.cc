#include "core/registration/align/scan_surface.h"

#include <pcl/common/centroid.h>
#include <pcl/common/eigen.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "absl/container/flat_hash_map.h"
#include "core/sensor/range_image.h"
#include "core/sensor/scan.h"
#include "core/sensor/scanner_model.h"

namespace vantage::registration {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

// Neighbours are gathered out to this distance, m, or to the next cells where those are farther.
constexpr double kNeighbourhood = 0.12;
// The neighbourhood that is tried when the larger one is not a plane. The side of a pilaster or a
// door's jamb may be one, and may be all that fixes a scan along a wall. Such a small plane must be
// flat up to noise, or every edge would be rounded off.
constexpr double kSmallNeighbourhood = 0.05;
constexpr double kSmallNoise =
    2.0;  // times the scanner's noise, one sigma: hardly any plane has more
constexpr int kNeighboursPerSide = 3;  // so at most 7 x 7, whatever the image's resolution
constexpr int kMinNeighbours = 6;
// A neighbourhood is a surface when it is flat to this (m, rms): a noise of 1 cm, and relief; or to
// this share of its own width (rms, too): the normal of six samples is then right to 3 degrees, one
// sigma.
constexpr double kFlat = 0.015;
constexpr double kFlatShare = 0.12;
// m, rms across: a strip less than 3 cm wide, whose normal noise of 1 cm may turn by anything.
constexpr double kLeastWidth = 0.008;
// Of its width, that a surface may deviate in any case, up to kFlat: the normal of six samples is
// then right to 8 degrees, one sigma. Small planes met with noise are so.
constexpr double kMostNoiseShare = 0.35;

Cloud ToCloud(const sensor::RangeImage& image, parallel::Parallel& parallel) {
  Cloud cloud(static_cast<uint32_t>(image.rows()), static_cast<uint32_t>(image.columns()));
  std::vector<Eigen::Vector2d> rows(static_cast<size_t>(image.rows()));
  for (size_t r = 0; r < rows.size(); ++r) {
    rows[r] = {std::cos(image.elevation[r]), std::sin(image.elevation[r])};
  }
  parallel.For(image.azimuth.size(), [&](size_t column) {
    const double cos_a = std::cos(image.azimuth[column]);
    const double sin_a = std::sin(image.azimuth[column]);
    for (size_t r = 0; r < rows.size(); ++r) {
      const size_t i = image.Index(static_cast<int>(column), static_cast<int>(r));
      const double range = sensor::RangeImage::IsRange(image.range[i])
                               ? static_cast<double>(image.range[i])
                               : std::numeric_limits<double>::quiet_NaN();
      const double flat = range * rows[r].x();
      cloud[i].x = static_cast<float>(flat * cos_a);
      cloud[i].y = static_cast<float>(flat * sin_a);
      cloud[i].z = static_cast<float>(range * rows[r].y());
    }
  });
  return cloud;
}

struct Picked {
  uint64_t cube = 0;
  uint32_t cell = 0;
  float distance = std::numeric_limits<float>::max();  // to the cube's centre, squared
  float cells = 0;
};

// Keeps in each cube the sample nearest to its centre; of equally near ones the first.
class Cubes {
 public:
  void Add(const Picked& sample) {
    const auto [it, fresh] = at_.try_emplace(sample.cube, static_cast<uint32_t>(picked_.size()));
    if (fresh) {
      picked_.push_back(sample);
      return;
    }
    Picked& best = picked_[it->second];
    best.cells += sample.cells;
    if (sample.distance < best.distance) {
      best.distance = sample.distance;
      best.cell = sample.cell;
    }
  }
  // In the order in which the cubes were first met.
  const std::vector<Picked>& picked() const { return picked_; }

 private:
  absl::flat_hash_map<uint64_t, uint32_t> at_;
  std::vector<Picked> picked_;
};

// In each cube that holds samples, the one nearest to its centre. Near the scanner, where samples
// are far denser than the cubes, a regular subset of the image is looked at.
std::vector<Picked> Thin(const sensor::RangeImage& image, const Cloud& cloud, double spacing,
                         parallel::Parallel& parallel) {
  const double step = std::max(image.native_azimuth_step, image.native_elevation_step);
  const auto inverse = static_cast<float>(1.0 / spacing);
  const auto scale = static_cast<float>(spacing / (4.0 * step));
  const auto thin = [&](int column, Cubes& cubes) {
    for (int row = 0; row < image.rows(); ++row) {
      const size_t i = image.Index(column, row);
      const float range = image.range[i];
      if (!sensor::RangeImage::IsRange(range)) continue;
      const float ratio = scale / range;
      const int stride = ratio >= 8 ? 8 : ratio >= 4 ? 4 : ratio >= 2 ? 2 : 1;
      if ((column & (stride - 1)) != 0 || (row & (stride - 1)) != 0) continue;
      const Eigen::Array3f scaled = cloud[i].getArray3fMap() * inverse;
      const Eigen::Array3f corner = scaled.floor();
      const Eigen::Array3i cube = corner.cast<int>() + (1 << 19);
      Picked sample;
      sample.cube = (static_cast<uint64_t>(cube.x()) << 42) |
                    (static_cast<uint64_t>(cube.y()) << 21) | static_cast<uint64_t>(cube.z());
      sample.cell = static_cast<uint32_t>(i);
      sample.distance = (scaled - corner - 0.5f).matrix().squaredNorm();
      sample.cells = static_cast<float>(stride * stride);
      cubes.Add(sample);
    }
  };
  // Works by sectors and joins them in order, with the same result as a single one.
  constexpr int kSector = 64;  // columns
  std::vector<Cubes> sectors(static_cast<size_t>((image.columns() + kSector - 1) / kSector));
  parallel.For(sectors.size(), [&](size_t sector) {
    const int from = static_cast<int>(sector) * kSector;
    const int to = std::min(image.columns(), from + kSector);
    for (int column = from; column < to; ++column) thin(column, sectors[sector]);
  });
  Cubes all;
  for (const Cubes& sector : sectors) {
    for (const Picked& picked : sector.picked()) all.Add(picked);
  }
  return all.picked();
}

struct PlaneFit {
  SurfaceSample sample;
  float rms = -1;  // m, of the neighbours from their plane; negative: there is no plane
};

// Fits a plane to the neighbours within `neighbourhood` (m). `flat`: the largest rms distance from
// the plane, m, in addition to the other conditions.
PlaneFit FitPlane(const sensor::Scan& scan, const Cloud& cloud, const Picked& picked,
                  double neighbourhood, double flat, pcl::Indices& neighbours) {
  const sensor::RangeImage& image = scan.image;
  const int column = static_cast<int>(picked.cell / image.elevation.size());
  const int row = static_cast<int>(picked.cell % image.elevation.size());
  const double range = image.range[picked.cell];
  const auto reach = [&](double step) {
    return std::max(1, static_cast<int>(std::lround(neighbourhood / (range * step))));
  };
  const double step_a = 2 * sensor::kPi / std::max(1, image.columns());
  const double azimuth_step =
      image.full_turn ? step_a
                      : (image.azimuth.back() - image.azimuth.front()) / (image.columns() - 1);
  const double elevation_step =
      (image.elevation.back() - image.elevation.front()) / (image.rows() - 1);
  const double cos_e = std::max(0.05, std::cos(image.elevation[static_cast<size_t>(row)]));
  const int half_c = std::min(reach(azimuth_step * cos_e), image.columns() / 4);
  const int half_r = reach(elevation_step);
  const int stride_c = std::max(1, half_c / kNeighboursPerSide);
  const int stride_r = std::max(1, half_r / kNeighboursPerSide);
  const Eigen::Vector3f centre = cloud[picked.cell].getVector3fMap();
  const double gate =
      std::max({2 * neighbourhood, 3.0 * range * elevation_step, 3.0 * range * azimuth_step});
  const auto gate_squared = static_cast<float>(gate * gate);

  neighbours.clear();
  for (int dc = -half_c; dc <= half_c; dc += stride_c) {
    int c = column + dc;
    if (c < 0 || c >= image.columns()) {
      if (!image.full_turn) continue;
      c = (c + image.columns()) % image.columns();
    }
    for (int dr = -half_r; dr <= half_r; dr += stride_r) {
      const int r = row + dr;
      if (r < 0 || r >= image.rows()) continue;
      const size_t i = image.Index(c, r);
      if (!sensor::RangeImage::IsRange(image.range[i])) continue;
      if ((cloud[i].getVector3fMap() - centre).squaredNorm() > gate_squared) continue;
      neighbours.push_back(static_cast<pcl::index_t>(i));
    }
  }
  PlaneFit fit;
  if (neighbours.size() < kMinNeighbours) return fit;
  Eigen::Matrix3f covariance = Eigen::Matrix3f::Zero();
  Eigen::Vector4f mean = Eigen::Vector4f::Zero();
  pcl::computeMeanAndCovarianceMatrix(cloud, neighbours, covariance, mean);
  Eigen::Matrix3f vectors = Eigen::Matrix3f::Zero();
  Eigen::Vector3f values = Eigen::Vector3f::Zero();
  pcl::eigen33(covariance, vectors, values);
  const double rms = std::sqrt(std::max(0.0f, values[0]));
  const double width = std::sqrt(std::max(0.0f, values[1]));
  // A strip that is too thin, or points that are not flat, have no normal.
  if (!(width > kLeastWidth) || !(rms <= flat) ||
      !(rms < std::max(kFlatShare * width, std::min(kFlat, kMostNoiseShare * width)))) {
    return fit;
  }
  Eigen::Vector3f normal = vectors.col(0).normalized();
  if (normal.dot(centre) > 0) normal = -normal;
  const double cos_incidence = -normal.dot(centre.normalized());
  if (cos_incidence < std::cos(scan.scanner.max_incidence)) return fit;
  const float off = normal.dot(centre - mean.head<3>());
  if (std::abs(off) > 3 * std::max(rms, scan.scanner.RangeSigma(range))) return fit;
  fit.rms = static_cast<float>(rms);
  fit.sample.point = centre - off * normal;
  fit.sample.normal = normal;
  fit.sample.sigma =
      static_cast<float>(std::max(scan.scanner.RangeSigma(range) * cos_incidence, rms));
  fit.sample.cells = picked.cells;
  return fit;
}

}  // namespace

// Orders samples by taking from groups (direction of normal x cubic metre of space) in turn, so
// that rare directions come as early as common ones: a door's jamb constrains the pose more than
// the tenth square metre of wall.
void SpreadSamples(std::vector<SurfaceSample>& samples) {
  // A fixed pseudo-random order: key in the high half, index in the low one.
  std::vector<uint64_t> shuffled(samples.size());
  for (uint32_t i = 0; i < samples.size(); ++i) {
    shuffled[i] = (static_cast<uint64_t>(i * 2654435761U) << 32) | i;
  }
  std::sort(shuffled.begin(), shuffled.end());
  absl::flat_hash_map<uint64_t, uint32_t> taken;
  // By position in `shuffled`: the number of samples of its group before it.
  std::vector<uint32_t> turn(samples.size());
  std::vector<uint32_t> begin;  // by turn: the number of samples, then the index of the first
  for (size_t k = 0; k < shuffled.size(); ++k) {
    const SurfaceSample& s = samples[static_cast<uint32_t>(shuffled[k])];
    int axis = 0;
    s.normal.cwiseAbs().maxCoeff(&axis);
    const auto side = static_cast<uint64_t>(2 * axis + (s.normal[axis] < 0 ? 1 : 0));
    const Eigen::Array3i cell = s.point.array().floor().cast<int>() + (1 << 15);
    const uint64_t key = (side << 60) | (static_cast<uint64_t>(cell.x()) << 40) |
                         (static_cast<uint64_t>(cell.y()) << 20) | static_cast<uint64_t>(cell.z());
    turn[k] = taken[key]++;
    if (turn[k] == begin.size()) begin.push_back(0);
    ++begin[turn[k]];
  }
  std::exclusive_scan(begin.begin(), begin.end(), begin.begin(), 0U);
  std::vector<SurfaceSample> spread(samples.size());
  for (size_t k = 0; k < shuffled.size(); ++k) {
    spread[begin[turn[k]]++] = samples[static_cast<uint32_t>(shuffled[k])];
  }
  samples = std::move(spread);
}

ScanSurface SampleSurface(const sensor::Scan& scan, double spacing, parallel::Parallel& parallel) {
  const Cloud cloud = ToCloud(scan.image, parallel);
  const std::vector<Picked> picked = Thin(scan.image, cloud, spacing, parallel);
  std::vector<PlaneFit> fits(picked.size());
  constexpr size_t kChunk = 512;
  parallel.For((picked.size() + kChunk - 1) / kChunk, [&](size_t chunk) {
    pcl::Indices neighbours;
    const size_t end = std::min(picked.size(), (chunk + 1) * kChunk);
    for (size_t i = chunk * kChunk; i < end; ++i) {
      constexpr double kAny = std::numeric_limits<double>::infinity();
      fits[i] = FitPlane(scan, cloud, picked[i], kNeighbourhood, kAny, neighbours);
      if (fits[i].rms >= 0) continue;
      const double noise = scan.scanner.RangeSigma(scan.image.range[picked[i].cell]);
      fits[i] =
          FitPlane(scan, cloud, picked[i], kSmallNeighbourhood, kSmallNoise * noise, neighbours);
    }
  });
  ScanSurface surface;
  std::vector<float> rms;
  for (const PlaneFit& fit : fits) {
    if (fit.rms < 0) continue;
    surface.samples.push_back(fit.sample);
    rms.push_back(fit.rms);
  }
  surface.image_samples = static_cast<double>(scan.image.SampleCount());
  surface.scanner = scan.scanner;
  if (!rms.empty()) {
    const auto middle = rms.begin() + static_cast<ptrdiff_t>(rms.size() / 2);
    std::nth_element(rms.begin(), middle, rms.end());
    surface.roughness = *middle;
  }
  SpreadSamples(surface.samples);
  return surface;
}

}  // namespace vantage::registration

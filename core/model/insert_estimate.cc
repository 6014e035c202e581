#include "core/model/insert_estimate.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "core/model/carve/carve_room.h"
#include "core/model/carve/thin_layer.h"
#include "core/model/view/brick_pages.h"
#include "core/sensor/range_image.h"
#include "core/sensor/scanner_model.h"

namespace vantage::model {
namespace {

constexpr double kLookedAt = 1e6;     // cells
constexpr double kAnyScan = 2 << 20;  // bytes, whatever the size
// Of the voxels that a surface crosses, those in which a point of it comes to lie.
constexpr double kHit = 0.9;
// Sheets beside thin things, and beside what did not come back, are partly the same voxels.
constexpr double kApart = 0.6;

// Faces of voxels that a plane of unit area (in faces) crosses, in a model that is turned around
// the vertical by any angle.
double Crossed(const Eigen::Vector3d& normal) {
  constexpr double kAnyTurn = 4 / sensor::kPi;  // mean of |cos| + |sin|
  return std::abs(normal.z()) + kAnyTurn * normal.head<2>().norm();
}

}  // namespace

InsertSize::InsertSize(const sensor::Scan& scan, const ModelConfig& config) {
  const sensor::RangeImage& image = scan.image;
  cells_ = static_cast<double>(image.cells());
  kept_cells_ = static_cast<double>(KeptCells(image));
  const double face = config.voxel_size * config.voxel_size;
  const auto stride = std::max(1, static_cast<int>(std::ceil(std::sqrt(cells_ / kLookedAt))));
  const double stands_for = static_cast<double>(stride) * stride;
  // Returns beyond the range are cut, and beyond the site.
  const double reach = std::min(scan.scanner.range_max, 2 * config.max_half_extent.norm());
  const auto range = [&](int c, int r) {
    return std::clamp(static_cast<double>(image.at(c, r)), 0.0, reach);
  };
  const auto azimuth = [&](int c) { return image.azimuth[static_cast<size_t>(c)]; };
  const auto elevation = [&](int r) { return image.elevation[static_cast<size_t>(r)]; };
  // Two neighbours are one surface unless the segment between them is nearly along the ray.
  const double steepest = 1 / std::tan(config.discontinuity_angle);
  const auto joined = [&](double a, double b, double angle) {
    return a > 0 && b > 0 &&
           std::abs(a - b) <
               std::min(a, b) * angle * steepest + 4 * scan.scanner.RangeSigma(std::max(a, b));
  };
  double volume = 0;  // m3
  for (int c = 0; c < image.columns(); c += stride) {
    for (int r = 0; r + 1 < image.rows(); r += stride) {
      const double here = range(c, r);
      const double rise = elevation(r + 1) - elevation(r);
      const double turn = (azimuth(image.columns() - 1) - azimuth(0)) / (image.columns() - 1);
      const double level = std::cos(elevation(r)) * turn;
      volume += stands_for * here * here * here / 3 * rise * level;
      // Neighbours about half a voxel away: nearer ones differ by noise, and are in one voxel.
      const double apart = here * std::max(rise, level);
      const int step =
          apart > 0 ? std::clamp(static_cast<int>(config.voxel_size / 2 / apart), 1, 64) : 1;
      const int above = r + step;
      const int beside = (c + step) % image.columns();
      if (above >= image.rows() || (c + step >= image.columns() && !image.full_turn)) continue;
      const double right = range(beside, r);
      const double up = range(c, above);
      const bool to_right = joined(here, right, step * level);
      const bool to_up = joined(here, up, step * rise);
      const double part = stands_for / step / step;
      if (to_right && to_up) {
        const Eigen::Vector3d p = here * image.Direction(c, r);
        const Eigen::Vector3d n =
            (right * image.Direction(beside, r) - p).cross(up * image.Direction(c, above) - p);
        if (n.norm() > 0) surface_ += kHit * part * n.norm() / face * Crossed(n.normalized());
      } else if (here > 0) {
        surface_ += part;  // a sample that is joined to no surface
      }
      // Beside a ray that sees farther, a sheet along it: half the difference of the squares.
      const auto sheet = [&](double a, double b, double angle) {
        return kApart * part * std::abs(a * a - b * b) / 2 * step * angle / face;
      };
      if (!to_right) boundary_ += sheet(here, right, rise);
      if (!to_up) boundary_ += sheet(here, up, level);
    }
  }
  const double page = BrickPage::kVoxels * config.voxel_size;
  pages_ = volume / (page * page * page) + surface_ / (BrickPage::kVoxels * BrickPage::kVoxels) / 2;
}

int64_t InsertSize::PeakBytes() const {
  const double merging = kept_cells_ * kBytesOfCellKept + surface_ * kBytesOfSurface +
                         boundary_ * kBytesOfBoundary + pages_ * kBytesOfPage;
  return static_cast<int64_t>(kAnyScan + std::max(cells_ * kBytesOfCell, merging));
}

int64_t InsertSize::KeptBytes() const {
  return static_cast<int64_t>(kAnyScan + kept_cells_ * kBytesOfCellKept +
                              surface_ * kBytesOfSurfaceKept + boundary_ * kBytesOfBoundary +
                              pages_ * kBytesOfPage);
}

}  // namespace vantage::model

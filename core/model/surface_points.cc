#include "core/model/surface_points.h"

#include <algorithm>
#include <cmath>

namespace vantage {

void SurfacePoints::Add(const Eigen::Vector3d& point, bool measured) {
  const Eigen::Vector3d scaled = point / voxel_size_;
  const Eigen::Vector3d floor = scaled.array().floor();
  const VoxelIndex voxel = floor.cast<int>();
  const BrickKey key = KeyOf(Brick::Of(voxel));
  if (key != last_key_) {
    const auto [it, fresh] = index_.try_emplace(key, bricks_.size());
    if (fresh) {
      bricks_.emplace_back(key, BrickSums{});
      bricks_.back().second.slot.fill(-1);
    }
    last_key_ = key;
    last_ = it->second;
  }
  BrickSums& brick = bricks_[last_].second;
  int16_t& slot = brick.slot[static_cast<size_t>(Brick::LocalOf(voxel))];
  if (slot < 0) {
    slot = static_cast<int16_t>(brick.sums.size());
    brick.sums.emplace_back();
  }
  std::array<uint32_t, 3> offset;
  for (int i = 0; i < 3; ++i) {
    const int units = static_cast<int>((scaled[i] - floor[i]) * SurfaceSums::kUnits);
    offset[static_cast<size_t>(i)] =
        static_cast<uint32_t>(std::clamp(units, 0, SurfaceSums::kUnits - 1));
  }
  brick.sums[static_cast<size_t>(slot)].Add(offset, measured);
}

void SurfacePoints::AddTo(ScanLayer& layer) const {
  for (const auto& [key, from] : bricks_) {
    LayerBrick& to = layer.bricks[key];
    BrickMask united = to.surface;
    for (int local = 0; local < Brick::kVoxels; ++local) {
      if (from.slot[static_cast<size_t>(local)] >= 0) united.Set(local);
    }
    std::vector<SurfaceSums> sums;
    sums.reserve(static_cast<size_t>(united.Count()));
    for (int local = 0; local < Brick::kVoxels; ++local) {
      if (!united.Has(local)) continue;
      SurfaceSums sum;
      if (to.surface.Has(local)) sum = to.sums[static_cast<size_t>(to.surface.Rank(local))];
      const int16_t slot = from.slot[static_cast<size_t>(local)];
      if (slot >= 0) sum.Add(from.sums[static_cast<size_t>(slot)]);
      sums.push_back(sum);
    }
    to.surface = united;
    to.sums = std::move(sums);
  }
}

namespace {

class Interpolator {
 public:
  Interpolator(const ScanLayer& layer, double voxel_size)
      : surface_(layer.range_surface), pose_(layer.T_model_scan), spacing_(voxel_size / 2) {}

  Eigen::Vector3d Point(int column, int row) const {
    return pose_ *
           (static_cast<double>(surface_.at(column, row)) * surface_.Direction(column, row));
  }

  // What the cells from (column, row) to the next column and row imply between them.
  void Fill(int column, int row, SurfacePoints& points) const {
    const int next = surface_.NextColumn(column);
    if (next < 0 || row + 1 >= surface_.rows()) return;
    const bool bottom = surface_.JoinedToNextColumn(column, row);
    const bool top = surface_.JoinedToNextColumn(column, row + 1);
    const bool left = surface_.JoinedToNextRow(column, row);
    const bool right = surface_.JoinedToNextRow(next, row);
    if (bottom && top && left && right) {
      Quad(Point(column, row), Point(next, row), Point(column, row + 1), Point(next, row + 1),
           points);
    } else if (bottom && left) {
      Triangle(Point(column, row), Point(next, row), Point(column, row + 1), points);
    } else if (bottom && right) {
      Triangle(Point(next, row), Point(column, row), Point(next, row + 1), points);
    } else if (top && left) {
      Triangle(Point(column, row + 1), Point(next, row + 1), Point(column, row), points);
    } else if (top && right) {
      Triangle(Point(next, row + 1), Point(column, row + 1), Point(next, row), points);
    }
  }

 private:
  int Steps(double length) const { return static_cast<int>(std::ceil(length / spacing_)); }

  void Quad(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
            const Eigen::Vector3d& d, SurfacePoints& points) const {
    const int nu = Steps(std::sqrt(std::max((b - a).squaredNorm(), (d - c).squaredNorm())));
    const int nv = Steps(std::sqrt(std::max((c - a).squaredNorm(), (d - b).squaredNorm())));
    if (nu <= 1 && nv <= 1) return;  // its corners say it all
    for (int i = 0; i <= nu; ++i) {
      for (int j = 0; j <= nv; ++j) {
        const double u = nu == 0 ? 0 : static_cast<double>(i) / nu;
        const double v = nv == 0 ? 0 : static_cast<double>(j) / nv;
        points.Add((1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d), false);
      }
    }
  }

  // a is the corner between the two joined sides.
  void Triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                SurfacePoints& points) const {
    const int n = Steps(
        std::sqrt(std::max({(b - a).squaredNorm(), (c - a).squaredNorm(), (c - b).squaredNorm()})));
    if (n <= 1) return;
    for (int i = 0; i <= n; ++i) {
      for (int j = 0; i + j <= n; ++j) {
        points.Add(
            a + (b - a) * (static_cast<double>(i) / n) + (c - a) * (static_cast<double>(j) / n),
            false);
      }
    }
  }

  const RangeSurface& surface_;
  const Eigen::Isometry3d& pose_;
  double spacing_;
};

}  // namespace

void AddSurfacePoints(double voxel_size, Parallel& parallel, ScanLayer& layer) {
  const RangeSurface& surface = layer.range_surface;
  const Interpolator interpolator(layer, voxel_size);
  // Few parts: each may hold its own copy of a brick's sums.
  const size_t parts = static_cast<size_t>(parallel.width());
  std::vector<SurfacePoints> sums(parts, SurfacePoints(voxel_size));
  std::vector<size_t> samples(parts, 0);
  parallel.For(parts, [&](size_t part) {
    const int begin = static_cast<int>(part * static_cast<size_t>(surface.columns()) / parts);
    const int end = static_cast<int>((part + 1) * static_cast<size_t>(surface.columns()) / parts);
    for (int c = begin; c < end; ++c) {
      for (int r = 0; r < surface.rows(); ++r) {
        if (!RangeImage::IsRange(surface.at(c, r))) continue;
        ++samples[part];
        sums[part].Add(interpolator.Point(c, r), true);
      }
      for (int r = 0; r + 1 < surface.rows(); ++r) interpolator.Fill(c, r, sums[part]);
    }
  });
  for (size_t part = 0; part < parts; ++part) {
    sums[part].AddTo(layer);
    layer.samples += samples[part];
  }
}

}  // namespace vantage

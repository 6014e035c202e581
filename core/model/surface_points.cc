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

// A sample's place.
struct Place {
  Eigen::Vector3d point;  // m, model frame
  VoxelIndex voxel;
};

// Finds the voxels that joined samples imply between them.
class Interpolator {
 public:
  Interpolator(const RangeSurface& surface, double voxel_size)
      : surface_(surface), voxel_size_(voxel_size), spacing_(voxel_size / 3) {}

  // The cells from (column, row) to the next column and row; `here` and `next` are the two columns.
  void Fill(int column, int row, const std::vector<Place>& here, const std::vector<Place>& next,
            SurfacePoints& points) const {
    const int beside = surface_.NextColumn(column);
    const size_t low = static_cast<size_t>(row);
    const size_t high = low + 1;
    if (surface_.QuadJoined(column, row)) {
      Quad({&here[low], &next[low], &here[high], &next[high]}, points);
      return;
    }
    const bool bottom = surface_.JoinedToNextColumn(column, row);
    const bool top = surface_.JoinedToNextColumn(column, row + 1);
    const bool left = surface_.JoinedToNextRow(column, row);
    const bool right = surface_.JoinedToNextRow(beside, row);
    if (bottom && left) {
      Triangle({&here[low], &next[low], &here[high]}, points);
    } else if (bottom && right) {
      Triangle({&next[low], &here[low], &next[high]}, points);
    } else if (top && left) {
      Triangle({&here[high], &next[high], &here[low]}, points);
    } else if (top && right) {
      Triangle({&next[high], &here[high], &next[low]}, points);
    }
  }

 private:
  // The piece lies in the box of voxels that its corners span. Where they fill it there is nothing
  // to find, and for most pieces of a dense scan they do.
  template <size_t N>
  static bool CornersFillTheirBox(const std::array<const Place*, N>& corners) {
    VoxelIndex low = corners[0]->voxel;
    VoxelIndex high = low;
    for (const Place* corner : corners) {
      low = low.cwiseMin(corner->voxel);
      high = high.cwiseMax(corner->voxel);
    }
    const int volume = (high - low + VoxelIndex::Ones()).prod();
    if (volume <= 2) return true;
    if (volume > static_cast<int>(N)) return false;
    for (size_t i = 0; i < N; ++i) {
      for (size_t j = 0; j < i; ++j) {
        if (corners[i]->voxel == corners[j]->voxel) return false;
      }
    }
    return volume == static_cast<int>(N);
  }

  template <size_t N>
  void AddBetween(const Eigen::Vector3d& point, const std::array<const Place*, N>& corners,
                  SurfacePoints& points) const {
    const VoxelIndex voxel = (point / voxel_size_).array().floor().cast<int>();
    for (const Place* corner : corners) {
      if (corner->voxel == voxel) return;  // a sample says more
    }
    points.Add(point, false);
  }

  // At least two, so that the corner of a voxel between two samples is not passed over.
  int Steps(double squared_length) const {
    return std::max(2, static_cast<int>(std::ceil(std::sqrt(squared_length) / spacing_)));
  }

  void Quad(const std::array<const Place*, 4>& corners, SurfacePoints& points) const {
    if (CornersFillTheirBox(corners)) return;
    const Eigen::Vector3d& a = corners[0]->point;
    const Eigen::Vector3d& b = corners[1]->point;
    const Eigen::Vector3d& c = corners[2]->point;
    const Eigen::Vector3d& d = corners[3]->point;
    const int nu = Steps(std::max((b - a).squaredNorm(), (d - c).squaredNorm()));
    const int nv = Steps(std::max((c - a).squaredNorm(), (d - b).squaredNorm()));
    for (int i = 0; i <= nu; ++i) {
      for (int j = 0; j <= nv; ++j) {
        const double u = static_cast<double>(i) / nu;
        const double v = static_cast<double>(j) / nv;
        AddBetween((1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d), corners, points);
      }
    }
  }

  // The first corner is the one between the two joined sides.
  void Triangle(const std::array<const Place*, 3>& corners, SurfacePoints& points) const {
    if (CornersFillTheirBox(corners)) return;
    const Eigen::Vector3d& a = corners[0]->point;
    const Eigen::Vector3d u = corners[1]->point - a;
    const Eigen::Vector3d v = corners[2]->point - a;
    const int n = Steps(std::max({u.squaredNorm(), v.squaredNorm(), (v - u).squaredNorm()}));
    for (int i = 0; i <= n; ++i) {
      for (int j = 0; i + j <= n; ++j) {
        AddBetween(a + u * (static_cast<double>(i) / n) + v * (static_cast<double>(j) / n), corners,
                   points);
      }
    }
  }

  const RangeSurface& surface_;
  double voxel_size_;
  double spacing_;
};

}  // namespace

void AddSurfacePoints(double voxel_size, Parallel& parallel, ScanLayer& layer) {
  const RangeSurface& surface = layer.range_surface;
  const Interpolator interpolator(surface, voxel_size);
  const auto places_of = [&](int column, std::vector<Place>& places) {
    places.resize(static_cast<size_t>(surface.rows()));
    for (int r = 0; r < surface.rows(); ++r) {
      const float range = surface.at(column, r);
      if (!RangeImage::IsRange(range)) continue;
      Place& place = places[static_cast<size_t>(r)];
      place.point =
          layer.T_model_scan * (static_cast<double>(range) * surface.Direction(column, r));
      place.voxel = (place.point / voxel_size).array().floor().cast<int>();
    }
  };
  // Few parts: each may hold its own copy of a brick's sums.
  const size_t parts = static_cast<size_t>(parallel.width());
  std::vector<SurfacePoints> sums(parts, SurfacePoints(voxel_size));
  std::vector<size_t> samples(parts, 0);
  parallel.For(parts, [&](size_t part) {
    const int begin = static_cast<int>(part * static_cast<size_t>(surface.columns()) / parts);
    const int end = static_cast<int>((part + 1) * static_cast<size_t>(surface.columns()) / parts);
    std::vector<Place> here;
    std::vector<Place> next;
    if (begin < end) places_of(begin, here);
    for (int c = begin; c < end; ++c) {
      const int beside = surface.NextColumn(c);
      if (beside >= 0) places_of(beside, next);
      for (int r = 0; r < surface.rows(); ++r) {
        if (RangeImage::IsRange(surface.at(c, r))) {
          ++samples[part];
          sums[part].Add(here[static_cast<size_t>(r)].point, true);
        }
        if (beside >= 0 && r + 1 < surface.rows()) interpolator.Fill(c, r, here, next, sums[part]);
      }
      std::swap(here, next);
    }
  });
  for (size_t part = 0; part < parts; ++part) {
    sums[part].AddTo(layer);
    layer.samples += samples[part];
  }
}

}  // namespace vantage

#include "core/model/carve/surface_points.h"

#include <algorithm>
#include <cmath>

namespace vantage::model {

void SurfacePoints::Add(const VoxelIndex& voxel, const SurfaceSums& sums) {
  const BrickKey key = KeyOf(Brick::Of(voxel));
  if (key != last_key_) {
    const auto [it, fresh] = index_.try_emplace(key, bricks_.size());
    if (fresh) bricks_.emplace_back(key, BrickSums{});
    last_key_ = key;
    last_ = it->second;
  }
  BrickSums& brick = bricks_[last_].second;
  const int local = Brick::LocalOf(voxel);
  int16_t& slot = brick.slot[static_cast<size_t>(local)];
  if (brick.held.Has(local)) {
    brick.sums[static_cast<size_t>(slot)].Add(sums);
  } else {
    brick.held.Set(local);
    ++voxels_;
    slot = static_cast<int16_t>(brick.sums.size());
    brick.sums.push_back(sums);
  }
}

void SurfacePoints::AddInterpolated(const Eigen::Vector3d& point, double voxel_size) {
  const Eigen::Vector3d scaled = point / voxel_size;
  const Eigen::Vector3d floor = scaled.array().floor();
  std::array<uint32_t, 3> offset;
  for (int i = 0; i < 3; ++i) {
    const int units = static_cast<int>((scaled[i] - floor[i]) * SurfaceSums::kUnits);
    offset[static_cast<size_t>(i)] =
        static_cast<uint32_t>(std::clamp(units, 0, SurfaceSums::kUnits - 1));
  }
  SurfaceSums sums;
  sums.Add(offset, false);
  Add(floor.cast<int>(), sums);
}

void SurfacePoints::AddTo(ScanLayer& layer) const {
  for (const auto& entry : bricks_) {
    const BrickSums& from = entry.second;
    LayerBrick& to = layer.bricks[entry.first];
    BrickMask united = to.surface;
    for (size_t w = 0; w < united.word.size(); ++w) united.word[w] |= from.held.word[w];
    std::vector<SurfaceSums> sums;
    sums.reserve(static_cast<size_t>(united.Count()));
    size_t before = 0;  // rank in `to`
    united.ForEach([&](int local) {
      const bool held = from.held.Has(local);
      const size_t slot = held ? static_cast<size_t>(from.slot[static_cast<size_t>(local)]) : 0;
      if (!to.surface.Has(local)) {
        sums.push_back(from.sums[slot]);
        return;
      }
      sums.push_back(to.sums[before++]);
      if (held) sums.back().Add(from.sums[slot]);
    });
    to.surface = united;
    to.sums = PackedSums(sums);
  }
}

namespace {

// Positions in the model in 1/1024 voxel, counted from a corner so far below the scan that none is
// negative. A shift then gives the voxel, and a mask the position in it.
class FixedFrame {
 public:
  static constexpr int kShift = 10;
  static_assert(1 << kShift == SurfaceSums::kUnits);
  static constexpr int kBias = 1 << 19;  // voxels from the corner to the scanner

  FixedFrame(const Eigen::Isometry3d& T_model_scan, double voxel_size)
      : scale_((1 << kShift) / voxel_size) {
    const Eigen::Vector3d origin = T_model_scan.translation() / voxel_size;
    corner_ = origin.array().floor().cast<int>() - kBias;
    translation_ = (origin - corner_.cast<double>()) * (1 << kShift);
    rotation_ = scale_ * T_model_scan.linear();
  }

  const Eigen::Vector3d& translation() const { return translation_; }
  const Eigen::Matrix3d& rotation() const { return rotation_; }  // from metres of the scan's frame

  // Packed so that one comparison tells voxels apart.
  static uint64_t VoxelOf(int32_t x, int32_t y, int32_t z) {
    return static_cast<uint64_t>(z >> kShift) << 42 | static_cast<uint64_t>(y >> kShift) << 21 |
           static_cast<uint64_t>(x >> kShift);
  }
  static VoxelIndex Unpack(uint64_t voxel) {
    constexpr uint64_t kMask = (1 << 21) - 1;
    return {static_cast<int>(voxel & kMask), static_cast<int>(voxel >> 21 & kMask),
            static_cast<int>(voxel >> 42)};
  }
  static std::array<uint32_t, 3> OffsetOf(int32_t x, int32_t y, int32_t z) {
    constexpr int32_t kMask = (1 << kShift) - 1;
    return {static_cast<uint32_t>(x & kMask), static_cast<uint32_t>(y & kMask),
            static_cast<uint32_t>(z & kMask)};
  }
  VoxelIndex ToModel(uint64_t voxel) const { return Unpack(voxel) + corner_; }

 private:
  double scale_;
  VoxelIndex corner_;
  Eigen::Vector3d translation_;
  Eigen::Matrix3d rotation_;
};

// The positions of one column's samples.
struct Column {
  static constexpr uint64_t kNone = ~uint64_t{0};
  std::vector<int32_t> x, y, z;
  std::vector<uint64_t> voxel;  // kNone: no sample

  Eigen::Vector3d At(size_t row) const {
    return Eigen::Vector3i(x[row], y[row], z[row]).cast<double>();
  }
};

void PlaceColumn(const RangeSurface& surface, const FixedFrame& frame, int column, Column& to) {
  const auto rows = static_cast<size_t>(surface.rows());
  to.x.resize(rows);
  to.y.resize(rows);
  to.z.resize(rows);
  to.voxel.resize(rows);
  const size_t c = static_cast<size_t>(column);
  const Eigen::Vector3d level =
      frame.rotation() * Eigen::Vector3d(surface.cos_azimuth()[c], surface.sin_azimuth()[c], 0);
  const Eigen::Vector3d up = frame.rotation().col(2);
  const Eigen::Vector3d& t = frame.translation();
  const float* range = surface.Column(column);
  const double* cosine = surface.cos_elevation().data();
  const double* sine = surface.sin_elevation().data();
  int32_t* x = to.x.data();
  int32_t* y = to.y.data();
  int32_t* z = to.z.data();
  for (size_t r = 0; r < rows; ++r) {
    const double a = static_cast<double>(range[r]) * cosine[r];
    const double b = static_cast<double>(range[r]) * sine[r];
    x[r] = static_cast<int32_t>(t.x() + level.x() * a + up.x() * b);
    y[r] = static_cast<int32_t>(t.y() + level.y() * a + up.y() * b);
    z[r] = static_cast<int32_t>(t.z() + level.z() * a + up.z() * b);
  }
  for (size_t r = 0; r < rows; ++r) {
    to.voxel[r] = surface.Returned(column, static_cast<int>(r))
                      ? FixedFrame::VoxelOf(x[r], y[r], z[r])
                      : Column::kNone;
  }
}

// Samples that follow each other in a column mostly share a voxel, and are added up before they
// are looked up.
size_t AddSamples(const FixedFrame& frame, const Column& column, SurfacePoints& points) {
  size_t samples = 0;
  const size_t rows = column.voxel.size();
  for (size_t r = 0; r < rows;) {
    const uint64_t voxel = column.voxel[r];
    if (voxel == Column::kNone) {
      ++r;
      continue;
    }
    SurfaceSums sums;
    for (; r < rows && column.voxel[r] == voxel; ++r) {
      sums.Add(FixedFrame::OffsetOf(column.x[r], column.y[r], column.z[r]), false);
    }
    sums.samples = sums.points;
    sums.sample_sum = sums.point_sum;
    samples += sums.samples;
    points.Add(frame.ToModel(voxel), sums);
  }
  return samples;
}

// The position of a sample.
struct Place {
  Eigen::Vector3d point;  // 1/1024 voxel
  uint64_t voxel;
};

// Finds the voxels that joined samples imply between them.
class Interpolator {
 public:
  Interpolator(const RangeSurface& surface, const FixedFrame& frame)
      : surface_(surface), frame_(frame) {}

  // Between a column and the next one.
  void FillBetween(int column, const Column& here, const Column& next,
                   SurfacePoints& points) const {
    for (size_t r = 0; r + 1 < here.voxel.size(); ++r) {
      const std::array<uint64_t, 4> voxels = {here.voxel[r], here.voxel[r + 1], next.voxel[r],
                                              next.voxel[r + 1]};
      if (!InOneOrTwo(voxels)) Fill(column, r, here, next, points);
    }
  }

 private:
  static constexpr double kSpacing = SurfaceSums::kUnits / 3.0;

  // True when the corners lie in one voxel, or in two that share a face. Then no other voxel lies
  // between them. This is so for most of a dense scan.
  static bool InOneOrTwo(const std::array<uint64_t, 4>& voxels) {
    const auto [low, high] = std::minmax({voxels[0], voxels[1], voxels[2], voxels[3]});
    if (low == high) return true;
    const uint64_t apart = high - low;
    if (apart != 1 && apart != uint64_t{1} << 21 && apart != uint64_t{1} << 42) return false;
    return std::all_of(voxels.begin(), voxels.end(), [low = low, high = high](uint64_t voxel) {
      return voxel == low || voxel == high;
    });
  }

  void Fill(int column, size_t low, const Column& here, const Column& next,
            SurfacePoints& points) const {
    const int row = static_cast<int>(low);
    const size_t high = low + 1;
    const auto at = [](const Column& in, size_t r) { return Place{in.At(r), in.voxel[r]}; };
    if (surface_.QuadJoined(column, row)) {
      Quad({at(here, low), at(next, low), at(here, high), at(next, high)}, points);
      return;
    }
    const bool bottom = surface_.JoinedToNextColumn(column, row);
    const bool top = surface_.JoinedToNextColumn(column, row + 1);
    if (!bottom && !top) return;
    const bool left = surface_.JoinedToNextRow(column, row);
    const bool right = surface_.JoinedToNextRow(surface_.NextColumn(column), row);
    if (bottom && left) {
      Triangle({at(here, low), at(next, low), at(here, high)}, points);
    } else if (bottom && right) {
      Triangle({at(next, low), at(here, low), at(next, high)}, points);
    } else if (top && left) {
      Triangle({at(here, high), at(next, high), at(here, low)}, points);
    } else if (top && right) {
      Triangle({at(next, high), at(here, high), at(next, low)}, points);
    }
  }

  // The piece lies in the box of voxels that its corners span. Where the corners fill that box, as
  // for most pieces of a dense scan, there is no other voxel to find.
  template <size_t N>
  static bool CornersFillTheirBox(const std::array<Place, N>& corners) {
    VoxelIndex low = FixedFrame::Unpack(corners[0].voxel);
    VoxelIndex high = low;
    for (size_t i = 1; i < N; ++i) {
      const VoxelIndex voxel = FixedFrame::Unpack(corners[i].voxel);
      low = low.cwiseMin(voxel);
      high = high.cwiseMax(voxel);
    }
    const int volume = (high - low + VoxelIndex::Ones()).prod();
    if (volume <= 2) return true;
    if (volume > static_cast<int>(N)) return false;
    for (size_t i = 0; i < N; ++i) {
      for (size_t j = 0; j < i; ++j) {
        if (corners[i].voxel == corners[j].voxel) return false;
      }
    }
    return volume == static_cast<int>(N);
  }

  template <size_t N>
  void AddBetween(const Eigen::Vector3d& point, const std::array<Place, N>& corners,
                  SurfacePoints& points) const {
    const Eigen::Vector3i at = point.cast<int>();
    const uint64_t voxel = FixedFrame::VoxelOf(at.x(), at.y(), at.z());
    for (const Place& corner : corners) {
      if (corner.voxel == voxel) return;  // a sample is better than an interpolated point
    }
    SurfaceSums sums;
    sums.Add(FixedFrame::OffsetOf(at.x(), at.y(), at.z()), false);
    points.Add(frame_.ToModel(voxel), sums);
  }

  // At least two, so that the corner of a voxel between two samples is not passed over.
  static int Steps(double squared_length) {
    return std::max(2, static_cast<int>(std::ceil(std::sqrt(squared_length) / kSpacing)));
  }

  void Quad(const std::array<Place, 4>& corners, SurfacePoints& points) const {
    if (CornersFillTheirBox(corners)) return;
    const Eigen::Vector3d& a = corners[0].point;
    const Eigen::Vector3d& b = corners[1].point;
    const Eigen::Vector3d& c = corners[2].point;
    const Eigen::Vector3d& d = corners[3].point;
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
  void Triangle(const std::array<Place, 3>& corners, SurfacePoints& points) const {
    if (CornersFillTheirBox(corners)) return;
    const Eigen::Vector3d& a = corners[0].point;
    const Eigen::Vector3d u = corners[1].point - a;
    const Eigen::Vector3d v = corners[2].point - a;
    const int n = Steps(std::max({u.squaredNorm(), v.squaredNorm(), (v - u).squaredNorm()}));
    for (int i = 0; i <= n; ++i) {
      for (int j = 0; i + j <= n; ++j) {
        AddBetween(a + u * (static_cast<double>(i) / n) + v * (static_cast<double>(j) / n), corners,
                   points);
      }
    }
  }

  const RangeSurface& surface_;
  const FixedFrame& frame_;
};

}  // namespace

void AddSurfacePoints(double voxel_size, parallel::Parallel& parallel, CarveRoom& room,
                      ScanLayer& layer) {
  const RangeSurface& surface = layer.range_surface;
  const FixedFrame frame(layer.T_model_scan, voxel_size);
  const Interpolator interpolator(surface, frame);
  // Few parts: each may hold its own copy of a brick's sums.
  const size_t parts = static_cast<size_t>(parallel.width());
  std::vector<SurfacePoints> sums(parts);
  std::vector<size_t> samples(parts, 0);
  parallel.For(parts, [&](size_t part) {
    const int begin = static_cast<int>(part * static_cast<size_t>(surface.columns()) / parts);
    const int end = static_cast<int>((part + 1) * static_cast<size_t>(surface.columns()) / parts);
    Column here;
    Column next;
    if (begin < end) PlaceColumn(surface, frame, begin, here);
    size_t counted = 0;  // voxels
    for (int c = begin; c < end; ++c) {
      const size_t voxels = sums[part].voxels();
      const double taken = kBytesOfSurface * static_cast<double>(voxels - counted);
      counted = voxels;
      if (!room.Take(static_cast<int64_t>(taken))) return;
      samples[part] += AddSamples(frame, here, sums[part]);
      const int beside = surface.NextColumn(c);
      if (beside < 0) break;
      PlaceColumn(surface, frame, beside, next);
      interpolator.FillBetween(c, here, next, sums[part]);
      std::swap(here, next);
    }
  });
  if (room.spent()) return;
  for (size_t part = 0; part < parts; ++part) {
    sums[part].AddTo(layer);
    layer.samples += samples[part];
  }
}

}  // namespace vantage::model

#include "core/model/carve/carve.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/model/carve/carve_room.h"
#include "core/model/carve/cut_returns.h"
#include "core/model/carve/sky_rays.h"
#include "core/model/carve/station.h"
#include "core/model/carve/surface_points.h"
#include "core/model/carve/thin_layer.h"
#include "core/model/carve/voxel_visibility.h"
#include "core/model/reflections/reflections.h"
#include "core/model/scan/range_pyramid.h"

namespace vantage::model {

namespace {

constexpr double kHalfDiagonal = 0.8660254037844386;  // of a unit cube

// Empty space, from the root cube down. Cubes are counted in voxels.
class EmptySpace {
 public:
  struct Output {
    std::vector<std::pair<VoxelIndex, BrickMask>> mixed;  // bricks that are empty in part
    BrickMask whole;                                      // of the page: bricks that are wholly so
  };

  EmptySpace(const ModelConfig& config, const ScanLayer& layer, const RangePyramid& pyramid)
      : surface_(layer.range_surface),
        pyramid_(pyramid),
        centres_(layer.range_surface, layer.T_model_scan, config.voxel_size),
        voxel_size_(config.voxel_size),
        site_(config.max_half_extent.array()),
        origin_(layer.T_model_scan.translation()),
        R_scan_model_(layer.T_model_scan.linear().transpose()) {}

  // The pages (page coordinates) of a cube of at least one, aligned to its size, that are not
  // wholly unknown; not all of them when there is no room for them.
  void FindPages(const VoxelIndex& corner, int side, CarveRoom& room,
                 std::vector<VoxelIndex>& pages) const {
    if (room.spent() || Decide(corner, side) == Verdict::kUnknown) return;
    if (side == BrickPage::kVoxels) {
      if (!room.Take(static_cast<int64_t>(kBytesOfPage))) return;
      pages.push_back(BrickPage::Of(Brick::Of(corner)));
      return;
    }
    ForEachOctant(corner, side,
                  [&](const VoxelIndex& part) { FindPages(part, side / 2, room, pages); });
  }

  // A cube of at least one brick and at most a page, aligned to its size.
  void Split(const VoxelIndex& corner, int side, Output& output) const {
    switch (Decide(corner, side)) {
      case Verdict::kUnknown:
        return;
      case Verdict::kEmpty:
        for (int z = 0; z < side; z += Brick::kSide) {
          for (int y = 0; y < side; y += Brick::kSide) {
            for (int x = 0; x < side; x += Brick::kSide) {
              output.whole.Set(Brick::LocalOf(Brick::Of(corner + VoxelIndex(x, y, z))));
            }
          }
        }
        return;
      case Verdict::kMixed:
        break;
    }
    if (side > Brick::kSide) {
      ForEachOctant(corner, side, [&](const VoxelIndex& part) { Split(part, side / 2, output); });
      return;
    }
    BrickMask mask;
    ForEachOctant(corner, side, [&](const VoxelIndex& part) { Fill(part, mask); });
    if (mask.Any()) output.mixed.emplace_back(Brick::Of(corner), mask);
  }

 private:
  enum class Verdict { kEmpty, kUnknown, kMixed };

  template <typename Fn>
  static void ForEachOctant(const VoxelIndex& corner, int side, Fn&& fn) {
    const int half = side / 2;
    for (int octant = 0; octant < 8; ++octant) {
      fn(corner + half * VoxelIndex(octant & 1, octant >> 1 & 1, octant >> 2));
    }
  }

  // An eighth of a brick.
  void Fill(const VoxelIndex& corner, BrickMask& mask) const {
    constexpr int kSide = VoxelVisibility::kSide;
    static_assert(2 * kSide == Brick::kSide);
    uint64_t empty = 0;
    switch (Decide(corner, kSide)) {
      case Verdict::kUnknown:
        return;
      case Verdict::kEmpty:
        empty = ~uint64_t{0};
        break;
      case Verdict::kMixed: {
        const VoxelVisibility::Block block = centres_.Test(corner);
        empty = block.empty;
        for (uint64_t left = block.untold; left != 0; left &= left - 1) {
          const int bit = std::countr_zero(left);
          const VoxelIndex voxel =
              corner + VoxelIndex(bit % kSide, bit / kSide % kSide, bit / (kSide * kSide));
          // No ray passes through a voxel that is wholly beyond what was seen.
          if (Decide(voxel, 1) != Verdict::kUnknown && centres_.MostRaysPass(voxel)) {
            empty |= uint64_t{1} << bit;
          }
        }
        if (Beyond(corner, kSide)) {
          for (uint64_t left = empty; left != 0; left &= left - 1) {
            const int bit = std::countr_zero(left);
            const Eigen::Array3d voxel =
                (corner + VoxelIndex(bit % kSide, bit / kSide % kSide, bit / (kSide * kSide)))
                    .cast<double>();
            if ((((voxel + 0.5) * voxel_size_).abs() >= site_).any()) {
              empty &= ~(uint64_t{1} << bit);
            }
          }
        }
      }
    }
    for (int row = 0; row < kSide * kSide; ++row) {
      const int local = Brick::LocalOf(corner + VoxelIndex(0, row % kSide, row / kSide));
      mask.word[static_cast<size_t>(local / 64)] |= (empty >> (kSide * row) & 15) << (local % 64);
    }
  }

  // True when a part of the cube is outside the site.
  bool Beyond(const VoxelIndex& corner, int side) const {
    const Eigen::Array3d low = corner.cast<double>().array() * voxel_size_;
    return (low.abs().max((low + side * voxel_size_).abs()) > site_).any();
  }

  // Conservative: compares the cube's bounding sphere with the range image. Outside the site all is
  // unknown.
  Verdict Decide(const VoxelIndex& corner, int side) const {
    const Eigen::Array3d low = corner.cast<double>().array() * voxel_size_;
    if ((low >= site_).any() || (low + side * voxel_size_ <= -site_).any()) {
      return Verdict::kUnknown;
    }
    const double half = 0.5 * side * voxel_size_;
    const Eigen::Vector3d centre =
        (corner.cast<double>() * voxel_size_).array() + half - origin_.array();
    const Eigen::Array3d away = centre.array().abs();
    const double nearest = (away - half).max(0.0).matrix().norm();
    const double farthest = (away + half).matrix().norm();
    const double distance = centre.norm();
    const double radius = 2 * half * kHalfDiagonal;
    if (distance <= radius) return Verdict::kMixed;

    const Eigen::Vector3d in_scan = R_scan_model_ * centre;
    const double reach = std::asin(radius / distance);
    const double elevation = std::asin(std::clamp(in_scan.z() / distance, -1.0, 1.0));
    const AngularAxis::Span rows = surface_.elevation().Cover(elevation - reach, elevation + reach);
    if (rows.count == 0) return Verdict::kUnknown;
    AngularAxis::Span columns;
    const double level = std::cos(elevation);
    if (std::abs(elevation) + reach >= sensor::kPi / 2 || std::sin(reach) >= level) {
      columns = surface_.azimuth().Cover(-sensor::kPi, 2 * sensor::kPi);  // a pole: every azimuth
      if (!surface_.azimuth().closed()) columns.cut = true;
    } else {
      const double azimuth = std::atan2(in_scan.y(), in_scan.x());
      const double turn = std::asin(std::sin(reach) / level);
      columns = surface_.azimuth().Cover(azimuth - turn, azimuth + turn);
    }
    if (columns.count == 0) return Verdict::kUnknown;

    float min = std::numeric_limits<float>::infinity();
    float max = 0;
    for (int i = 0; i < columns.count; ++i) {
      const RangePyramid::Bounds bounds =
          pyramid_.Over(columns.first[i], columns.last[i], rows.first[0], rows.last[0]);
      min = std::min(min, bounds.min);
      max = std::max(max, bounds.max);
    }
    if (nearest >= static_cast<double>(max)) return Verdict::kUnknown;
    if (farthest < static_cast<double>(min) && !rows.cut && !columns.cut && !Beyond(corner, side)) {
      return Verdict::kEmpty;
    }
    return Verdict::kMixed;
  }

  const RangeSurface& surface_;
  const RangePyramid& pyramid_;
  VoxelVisibility centres_;
  double voxel_size_;
  Eigen::Array3d site_;  // m, half its side
  Eigen::Vector3d origin_;
  Eigen::Matrix3d R_scan_model_;
};

// A brick that is empty in part: the boundary of what is empty crosses it, about once.
constexpr int64_t kBytesOfMixedBrick =
    static_cast<int64_t>(kBytesOfBoundary * Brick::kSide * Brick::kSide);

void CarveEmptySpace(const ModelConfig& config, parallel::Parallel& parallel, CarveRoom& room,
                     ScanLayer& layer) {
  const double voxel_size = config.voxel_size;
  const RangePyramid pyramid(layer.range_surface, parallel);
  const RangePyramid::Bounds all =
      pyramid.Over(0, layer.range_surface.columns() - 1, 0, layer.range_surface.rows() - 1);
  const EmptySpace empty_space(config, layer, pyramid);
  // The work is divided by pages. They are found by halving the cubes that hold everything within
  // the longest range: after a single far return most pages in these are wholly unknown.
  const double reach = static_cast<double>(all.max);
  const Eigen::Vector3d origin = layer.T_model_scan.translation();
  int side = BrickPage::kVoxels;
  while (side * voxel_size < 2 * reach) side *= 2;
  const auto cube_of = [&](double offset) -> VoxelIndex {
    return ((origin.array() + offset) / (voxel_size * side)).floor().cast<int>();
  };
  const VoxelIndex first = cube_of(-reach);
  const VoxelIndex last = cube_of(reach);
  std::vector<VoxelIndex> pages;
  for (int z = first.z(); z <= last.z(); ++z) {
    for (int y = first.y(); y <= last.y(); ++y) {
      for (int x = first.x(); x <= last.x(); ++x) {
        empty_space.FindPages(VoxelIndex(x, y, z) * side, side, room, pages);
      }
    }
  }
  if (room.spent()) return;
  std::vector<EmptySpace::Output> outputs(pages.size());
  parallel.For(pages.size(), [&](size_t i) {
    if (room.spent()) return;
    empty_space.Split(pages[i] * BrickPage::kVoxels, BrickPage::kVoxels, outputs[i]);
    (void)room.Take(static_cast<int64_t>(outputs[i].mixed.size()) * kBytesOfMixedBrick);
  });
  if (room.spent()) return;
  for (size_t i = 0; i < pages.size(); ++i) {
    for (const auto& [brick, mask] : outputs[i].mixed) {
      layer.bricks.Put(KeyOf(brick), LayerBrick{.empty = mask, .surface = {}, .sums = {}});
    }
    layer.bricks.PutEmpty(pages[i], outputs[i].whole);
  }
}

}  // namespace

std::unique_ptr<ScanLayer> Carve(const sensor::Scan& scan, const Eigen::Isometry3d& T_model_scan,
                                 const ModelConfig& config, parallel::Parallel& parallel) {
  return *CarveWithin(CarveRoom::kUnlimited, scan, T_model_scan, config, parallel);
}

absl::StatusOr<std::unique_ptr<ScanLayer>> CarveWithin(int64_t memory_limit,
                                                       const sensor::Scan& scan,
                                                       const Eigen::Isometry3d& T_model_scan,
                                                       const ModelConfig& config,
                                                       parallel::Parallel& parallel) {
  const auto exhausted = [memory_limit] {
    return absl::ResourceExhaustedError(absl::StrCat(
        "model: merging this scan takes more than the ", memory_limit >> 20,
        " MiB of memory that it may: it covers too much for voxel_size; use larger voxels, or a "
        "smaller range or site"));
  };
  CarveRoom room(memory_limit);
  const auto cells = static_cast<double>(scan.image.cells());
  if (static_cast<double>(memory_limit) < cells * kBytesOfCell) return exhausted();
  (void)room.Take(
      static_cast<int64_t>(static_cast<double>(KeptCells(scan.image)) * kBytesOfCellKept));
  // Density is computed from the steps the instrument measured with, not the grid's.
  sensor::ScannerModel scanner = scan.scanner;
  scanner.azimuth_step = scan.image.native_azimuth_step;
  scanner.elevation_step = scan.image.native_elevation_step;
  OpenRangeSurface surface(scan.image, scan.scanner, config.discontinuity_angle, parallel);
  const CutReturns cut = CutReturnsBeyondLimits(config, scan.scanner, T_model_scan, surface);
  Reflections reflections = EndAndSuspectReflections(surface, parallel);
  const size_t sky_rays = EndSkyRays(config, scanner, T_model_scan, surface);

  const std::vector<double>& rows = scan.image.elevation;
  auto layer = std::unique_ptr<ScanLayer>(
      new ScanLayer{.range_surface = std::move(surface).Finish(parallel),
                    .scanner = scanner,
                    .elevation_first = rows[0] - (rows[1] - rows[0]) / 2,
                    .elevation_last = rows.back() + (rows.back() - rows[rows.size() - 2]) / 2,
                    .T_model_scan = T_model_scan,
                    .reflectors = std::move(reflections.reflectors),
                    .suspects = std::move(reflections.suspects),
                    .site = config.max_half_extent,
                    .cut = cut,
                    .sky_rays = sky_rays});
  layer->holes = HoleMap(layer->range_surface);
  CarveEmptySpace(config, parallel, room, *layer);
  if (room.spent()) return exhausted();
  AddSurfacePoints(config.voxel_size, parallel, room, *layer);
  if (room.spent()) return exhausted();
  ClearStation(config.voxel_size, *layer);
  ThinLayer(parallel, *layer);
  for (const auto& [page, bricks] : layer->bricks.empty()) {
    layer->empty_voxels += static_cast<size_t>(Brick::kVoxels * bricks.Count());
  }
  for (auto& [key, brick] : layer->bricks.own()) {
    // A voxel that holds surface is surface, wherever its centre lies.
    for (size_t w = 0; w < brick.empty.word.size(); ++w) {
      brick.empty.word[w] &= ~brick.surface.word[w];
    }
    layer->empty_voxels += static_cast<size_t>(brick.empty.Count());
    layer->surface_voxels += static_cast<size_t>(brick.surface.Count());
  }
  return layer;
}

}  // namespace vantage::model

#include "core/model/publish_brick.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "core/model/fuse.h"
#include "core/model/halo_mask.h"

namespace vantage {

namespace {

constexpr std::array<std::array<int, 3>, 6> kFaces = {
    {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};

// Glass, mirror or black: where the rays of two scans went through and did not come back, and one
// of them should have, a third's won't either. Which way false surface faces says little of what is
// in it, so the second may look at it askew.
constexpr int kMissesToGiveUp = 2;

class Publisher {
 public:
  Publisher(const VoxelIndex& brick, const BrickNeighbourhood<MergedBrick>& around,
            std::span<const ScanLayer* const> layers, double voxel_size)
      : brick_(brick),
        around_(around),
        layers_(layers),
        h_(voxel_size),
        empty_(around, [](const MergedBrick& b) { return b.united ? &b.united->empty : nullptr; }),
        surface_(around,
                 [](const MergedBrick& b) { return b.united ? &b.united->surface : nullptr; }) {
    for (const ScanLayer* layer : layers) {
      const BrickNeighbourhood<LayerBrick> own(brick,
                                               [&](const VoxelIndex& b) { return layer->Find(b); });
      if (own.Any()) witnesses_.emplace_back(layer, own);
    }
  }

  std::shared_ptr<const Brick> Publish(const std::shared_ptr<const Brick>& all_empty) const {
    auto out = std::make_shared<Brick>();
    const MergedBrick* own = around_.middle();
    const UnitedBrick* united = own == nullptr ? nullptr : own->united.get();
    BrickMask empty;
    BrickMask measured;
    if (united != nullptr) {
      empty = united->empty;
      measured = united->surface;
    }
    bool any = false;
    bool only_empty = true;
    for (const uint64_t word : empty.word) {
      any |= word != 0;
      only_empty &= word == ~uint64_t{0};
    }
    if (only_empty) return all_empty;
    empty.ForEach([&](int local) { out->state[static_cast<size_t>(local)] = VoxelState::kEmpty; });

    // Where there is anything else to say: measured surface, and what touches empty space.
    BrickMask rest;
    for (int row = 0; row < Brick::kSide * Brick::kSide; ++row) {
      const uint64_t near = empty_.FaceNeighbours(row % Brick::kSide, row / Brick::kSide);
      rest.word[static_cast<size_t>(row / Brick::kSide)] |=
          near << (Brick::kSide * (row % Brick::kSide));
    }
    for (size_t w = 0; w < rest.word.size(); ++w) {
      rest.word[w] = (rest.word[w] & ~empty.word[w]) | measured.word[w];
    }
    size_t rank = 0;
    rest.ForEach([&](int local) {
      VoxelState& state = out->state[static_cast<size_t>(local)];
      std::optional<SurfaceVoxel> surface;
      if (measured.Has(local)) {
        if (own->absorbed[rank] >= 0) {
          state = VoxelState::kAbsorbed;
        } else {
          state = VoxelState::kTrueSurface;
          surface = TrueSurface(local, rank);
        }
        ++rank;
      } else {
        surface = Frontier(local, state);
      }
      any |= state != VoxelState::kUnknown;
      if (surface.has_value()) {
        out->surface_mask[static_cast<size_t>(local / 64)] |= uint64_t{1} << (local % 64);
        out->surface.push_back(*surface);
      }
    });
    return any ? out : nullptr;
  }

 private:
  bool Empty(int x, int y, int z) const { return empty_.Has(x, y, z); }
  Eigen::Vector3d Centre(int local) const {
    return (PlanningView::Global(brick_, local).cast<double>().array() + 0.5) * h_;
  }

  // The voxel's own points and those of the voxels that it absorbed.
  SurfaceVoxel TrueSurface(int local, size_t rank) const {
    const int x = local & 7, y = local >> 3 & 7, z = local >> 6;
    const LocalPlane& plane = around_.middle()->plane[rank];
    int64_t samples = 0;
    int64_t points = 0;
    std::array<int64_t, 3> sample_sum{};
    std::array<int64_t, 3> point_sum{};
    std::vector<std::array<int, 3>> members;
    surface_.ForEachAround(x, y, z, kFuseReach, [&](int dx, int dy, int dz) {
      const auto [there, at] = around_.At(x + dx, y + dy, z + dz);
      const size_t i = static_cast<size_t>(there->united->surface.Rank(at));
      const bool itself = dx == 0 && dy == 0 && dz == 0;
      if (!itself && there->absorbed[i] != OffsetCode(-dx, -dy, -dz)) return;
      members.push_back({x + dx, y + dy, z + dz});
      const SurfaceSums& sums = there->united->sums[i];
      const std::array<int64_t, 3> shift = {int64_t{dx}, int64_t{dy}, int64_t{dz}};
      for (size_t k = 0; k < 3; ++k) {
        const int64_t units = shift[k] * SurfaceSums::kUnits;
        sample_sum[k] += static_cast<int64_t>(sums.sample_sum[k]) + units * sums.samples;
        point_sum[k] += static_cast<int64_t>(sums.point_sum[k]) + units * sums.points;
      }
      samples += sums.samples;
      points += sums.points;
    });
    const VoxelIndex voxel = PlanningView::Global(brick_, local);
    const auto& sum = samples > 0 ? sample_sum : point_sum;
    const double n =
        static_cast<double>(samples > 0 ? samples : points) * double{SurfaceSums::kUnits};
    Eigen::Vector3d centroid;
    for (int k = 0; k < 3; ++k) {
      centroid[k] = (voxel[k] + static_cast<double>(sum[static_cast<size_t>(k)]) / n +
                     0.5 / SurfaceSums::kUnits) *
                    h_;
    }
    SurfaceVoxel surface;
    surface.centroid = centroid.cast<float>();
    surface.normal = plane.normal;
    surface.area = static_cast<float>(h_ * h_) / plane.normal.lpNorm<1>();
    surface.samples = static_cast<uint32_t>(std::min<int64_t>(samples, UINT32_MAX));
    surface.density = Density(members, centroid, plane.normal.cast<double>());
    surface.ambiguous = EmptyOnBothSides(local, plane.normal);
    return surface;
  }

  float Density(const std::vector<std::array<int, 3>>& members, const Eigen::Vector3d& centroid,
                const Eigen::Vector3d& normal) const {
    double best = 0;
    for (const auto& witness : witnesses_) {
      const ScanLayer* layer = witness.first;
      const BrickNeighbourhood<LayerBrick>& around = witness.second;
      const bool measured = std::any_of(members.begin(), members.end(), [&](const auto& m) {
        const auto [brick, local] = around.At(m[0], m[1], m[2]);
        return brick != nullptr && brick->surface.Has(local);
      });
      if (measured) best = std::max(best, layer->DensityAt(centroid, normal, h_));
    }
    return static_cast<float>(best);
  }

  // One voxel thick, with empty space before and behind: which side it faces is a guess.
  bool EmptyOnBothSides(int local, const Eigen::Vector3f& normal) const {
    const int x = local & 7, y = local >> 3 & 7, z = local >> 6;
    const auto empty_towards = [&](float side) {
      const Eigen::Vector3i step = (side * 1.45f * normal).array().round().cast<int>();
      return Empty(x + step.x(), y + step.y(), z + step.z());
    };
    return empty_towards(1) && empty_towards(-1);
  }

  // An unknown voxel next to empty space: false surface, or absorbed along true surface.
  std::optional<SurfaceVoxel> Frontier(int local, VoxelState& state) const {
    const int x = local & 7, y = local >> 3 & 7, z = local >> 6;
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();
    empty_.ForEachAround(x, y, z, 1, [&](int dx, int dy, int dz) {
      normal +=
          Eigen::Vector3f(static_cast<float>(dx), static_cast<float>(dy), static_cast<float>(dz));
    });
    SurfaceVoxel surface;
    // Empty on opposite sides: any of them is as good, so the first.
    if (normal.squaredNorm() < 0.5f) {
      surface.ambiguous = true;
      for (const auto& face : kFaces) {
        if (!Empty(x + face[0], y + face[1], z + face[2])) continue;
        normal = Eigen::Vector3f(static_cast<float>(face[0]), static_cast<float>(face[1]),
                                 static_cast<float>(face[2]));
        break;
      }
    }
    surface.normal = normal.normalized();
    surface.ambiguous |= EmptyOnBothSides(local, surface.normal);
    if (IsSliver(local, surface.normal)) {
      state = VoxelState::kAbsorbed;
      return std::nullopt;
    }
    state = Cause(local);
    surface.centroid = Centre(local).cast<float>();
    surface.area = static_cast<float>(h_ * h_) / surface.normal.lpNorm<Eigen::Infinity>();
    int misses = 0;
    for (const auto& [layer, around] : witnesses_) {
      const ScanLayer::Miss miss = layer->MissAt(Centre(local), surface.normal.cast<double>(), h_);
      if (miss == ScanLayer::Miss::kNone) continue;
      ++misses;
      if (miss == ScanLayer::Miss::kSquare && surface.missed < UINT8_MAX) ++surface.missed;
    }
    surface.given_up = surface.missed > 0 && misses >= kMissesToGiveUp;
    return surface;
  }

  bool IsSliver(int local, const Eigen::Vector3f& normal) const {
    const int x = local & 7, y = local >> 3 & 7, z = local >> 6;
    const Eigen::Vector3f centre = Centre(local).cast<float>();
    const float reach = static_cast<float>(1.5 * h_);
    bool sliver = false;
    surface_.ForEachAround(x, y, z, kFuseReach, [&](int dx, int dy, int dz) {
      if (sliver) return;
      const auto [there, at] = around_.At(x + dx, y + dy, z + dz);
      const LocalPlane& plane = there->plane[static_cast<size_t>(there->united->surface.Rank(at))];
      sliver = plane.normal.dot(normal) >= 0.7f &&
               std::abs(plane.normal.dot(centre - plane.centroid)) <= reach;
    });
    return sliver;
  }

  VoxelState Cause(int local) const {
    const int x = local & 7, y = local >> 3 & 7, z = local >> 6;
    UnknownReason first = UnknownReason::kImage;
    bool any = false;
    for (const auto& witness : witnesses_) {
      const ScanLayer* layer = witness.first;
      const BrickNeighbourhood<LayerBrick>& around = witness.second;
      const bool touches = std::any_of(kFaces.begin(), kFaces.end(), [&](const auto& face) {
        const auto [brick, at] = around.At(x + face[0], y + face[1], z + face[2]);
        return brick != nullptr && brick->empty.Has(at);
      });
      if (!touches) continue;
      const UnknownReason reason = layer->ReasonAt(Centre(local));
      if (reason == UnknownReason::kNone) continue;
      first = any ? std::min(first, reason) : reason;
      any = true;
    }
    if (!any || first == UnknownReason::kOcclusion) return VoxelState::kFalseOcclusion;
    return first == UnknownReason::kHole ? VoxelState::kFalseHole : VoxelState::kFalseImage;
  }

  const VoxelIndex& brick_;
  const BrickNeighbourhood<MergedBrick>& around_;
  std::span<const ScanLayer* const> layers_;
  double h_;
  HaloMask empty_;
  HaloMask surface_;
  std::vector<std::pair<const ScanLayer*, BrickNeighbourhood<LayerBrick>>> witnesses_;
};

}  // namespace

std::shared_ptr<const Brick> PublishBrick(const VoxelIndex& brick,
                                          const BrickNeighbourhood<MergedBrick>& around,
                                          std::span<const ScanLayer* const> layers,
                                          double voxel_size,
                                          const std::shared_ptr<const Brick>& all_empty) {
  return Publisher(brick, around, layers, voxel_size).Publish(all_empty);
}

}  // namespace vantage

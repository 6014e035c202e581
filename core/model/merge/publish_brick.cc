#include "core/model/merge/publish_brick.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "core/model/merge/dropouts.h"
#include "core/model/merge/fuse.h"
#include "core/model/merge/halo_mask.h"
#include "core/model/merge/open_sky.h"
#include "core/model/view/target_distances.h"

namespace vantage::model {

namespace {

constexpr std::array<std::array<int, 3>, 6> kFaces = {
    {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};

// Surface that two scans should have measured and did not will not be measured by a third either
// (algorithm.md section 4, 'What never comes'): it is glass, a mirror or black, or a crevice
// between measured surfaces that no ray enters. The normal of false surface says little of the
// matter in it, so of two rays that went through it and did not come back one may meet it at any
// angle.
constexpr int kMissesToGiveUp = 2;

// A miss tells something if the scan should have put this many samples on the surface: density
// times area, for any scanner and voxel.
constexpr double kTellingSamples = 2;

class Publisher {
 public:
  Publisher(const VoxelIndex& brick, const BrickNeighbourhood<MergedBrick>& around,
            double voxel_size)
      : brick_(brick),
        around_(around),
        h_(voxel_size),
        empty_(around, [](const MergedBrick& b) { return b.united ? &b.united->empty : nullptr; }),
        surface_(around,
                 [](const MergedBrick& b) { return b.united ? &b.united->surface : nullptr; }),
        given_away_(around, [](const MergedBrick& b) {
          return b.given_away.Any() ? &b.given_away : nullptr;
        }) {}

  // `witnesses()` -> std::vector<Witness>: asked for only where there is more to say than what is
  // empty. `layers`: all there are.
  template <typename AskWitnesses>
  std::shared_ptr<const Brick> Publish(std::span<const ScanLayer* const> layers,
                                       AskWitnesses&& witnesses) {
    const MergedBrick* own = around_.middle();
    BrickMask empty;
    BrickMask measured;
    if (own->united != nullptr) {
      empty = own->united->empty;
      measured = own->united->surface;
    }
    // The voxels that need more than this: measured surface, and unknown voxels beside empty ones.
    BrickMask rest;
    for (int row = 0; row < Brick::kSide * Brick::kSide; ++row) {
      const uint64_t near = empty_.FaceNeighbours(row % Brick::kSide, row / Brick::kSide);
      rest.word[static_cast<size_t>(row / Brick::kSide)] |=
          near << (Brick::kSide * (row % Brick::kSide));
    }
    for (size_t w = 0; w < rest.word.size(); ++w) {
      rest.word[w] = (rest.word[w] & ~empty.word[w]) | measured.word[w];
    }
    bool any = empty.Any();
    if (!any && !rest.Any()) return nullptr;
    auto out = std::make_shared<Brick>();
    empty.ForEach([&](int local) { out->state[static_cast<size_t>(local)] = VoxelState::kEmpty; });
    if (!rest.Any()) return out;
    witnesses_ = witnesses();
    for (const ScanLayer* layer : layers) {
      if (MayHaveDropouts(*layer, brick_, h_)) dropout_layers_.push_back(layer);
      if (MayHaveSky(*layer, brick_, h_)) sky_layers_.push_back(layer);
    }
    out->surface = SurfaceVoxels(brick_, h_);
    out->surface.reserve(static_cast<size_t>(rest.Count()));
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
        if (IsFalseSurface(state)) {
          out->surface.AddFalse(*surface, local);
        } else {
          out->surface.push_back(*surface);
        }
      }
    });
    if (!any) return nullptr;
    out->surface.shrink_to_fit();
    out->dropouts = std::move(dropouts_);
    return out;
  }

 private:
  // Voxels that are one surface voxel in the end, as offsets from the brick's first.
  struct Members {
    std::array<std::array<int, 3>, 125> at;
    size_t count = 0;
  };

  bool Empty(int x, int y, int z) const { return empty_.Has(x, y, z); }
  Eigen::Vector3d Centre(int local) const {
    return (PlanningView::Global(brick_, local).cast<double>().array() + 0.5) * h_;
  }

  // The voxel's own points and those of the voxels that it absorbed.
  SurfaceVoxel TrueSurface(int local, size_t rank) {
    const int x = local & 7, y = local >> 3 & 7, z = local >> 6;
    const LocalPlane& plane = around_.middle()->plane[rank];
    int64_t samples = 0;
    int64_t points = 0;
    std::array<int64_t, 3> sample_sum{};
    std::array<int64_t, 3> point_sum{};
    Members members;
    const auto add = [&](int dx, int dy, int dz, const SurfaceSums& sums) {
      members.at[members.count++] = {x + dx, y + dy, z + dz};
      const std::array<int64_t, 3> shift = {int64_t{dx}, int64_t{dy}, int64_t{dz}};
      for (size_t k = 0; k < 3; ++k) {
        const int64_t units = shift[k] * SurfaceSums::kUnits;
        sample_sum[k] += static_cast<int64_t>(sums.sample_sum[k]) + units * sums.samples;
        point_sum[k] += static_cast<int64_t>(sums.point_sum[k]) + units * sums.points;
      }
      samples += sums.samples;
      points += sums.points;
    };
    add(0, 0, 0, around_.middle()->united->sums[rank]);
    given_away_.ForEachAround(x, y, z, kFuseReach, [&](int dx, int dy, int dz) {
      const auto [there, at] = around_.At(x + dx, y + dy, z + dz);
      const size_t i = there->united->Rank(at);
      if (there->absorbed[i] != OffsetCode(-dx, -dy, -dz)) return;
      add(dx, dy, dz, there->united->sums[i]);
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
    const ScanLayer::Density density = BestDensity(members, centroid, plane.normal.cast<double>());
    surface.density = static_cast<float>(density.recorded);
    if (density.recorded > 0) {
      surface.spread = static_cast<uint8_t>(
          std::min(255.0, std::ceil(256 * (density.at_point / density.recorded - 1))));
    }
    surface.ambiguous = EmptyOnBothSides(local, plane.normal);
    for (const Witness& witness : witnesses_) {
      if (surface.missed == UINT8_MAX || Measured(witness.around, members)) continue;
      if (DroppedOut(witness, local, centroid, surface)) ++surface.missed;
    }
    surface.given_up = surface.missed >= kMissesToGiveUp;
    AddDropouts(local, surface, [&](const ScanLayer* layer) {
      return std::any_of(witnesses_.begin(), witnesses_.end(), [&](const Witness& witness) {
        return witness.layer == layer && Measured(witness.around, members);
      });
    });
    return surface;
  }

  // Adds the dropouts of those layers that did not measure the voxel by another ray.
  template <typename MeasuredBy>
  void AddDropouts(int local, const SurfaceVoxel& surface, MeasuredBy&& measured_by) {
    if (dropout_layers_.empty() || surface.given_up) return;
    std::vector<Eigen::Vector3f> from;
    for (const ScanLayer* layer : dropout_layers_) {
      if (!IsDropout(*layer, surface, h_) || measured_by(layer)) continue;
      from.emplace_back(layer->T_model_scan.translation().cast<float>());
    }
    for (const Eigen::Vector3f& dropout : NearestDropouts(surface.centroid, std::move(from))) {
      dropouts_.push_back({dropout, static_cast<uint32_t>(local)});
    }
  }

  static bool Measured(const BrickNeighbourhood<LayerBrick>& around, const Members& members) {
    const auto end = members.at.begin() + static_cast<std::ptrdiff_t>(members.count);
    return std::any_of(members.at.begin(), end, [&](const auto& m) {
      const auto [brick, local] = around.At(m[0], m[1], m[2]);
      return brick != nullptr && brick->surface.Has(local);
    });
  }

  // True when a scan, which did not measure the surface, saw the space in front of it squarely and
  // densely enough that it should have measured it.
  bool DroppedOut(const Witness& witness, int local, const Eigen::Vector3d& centroid,
                  const SurfaceVoxel& surface) const {
    const Eigen::Vector3i own(local & 7, local >> 3 & 7, local >> 6);
    const bool in_front =
        std::any_of(kTargetDistances.begin(), kTargetDistances.end(), [&](double distance) {
          const Eigen::Vector3i target =
              own +
              (distance * surface.normal.cast<double>().array() + 0.5).floor().cast<int>().matrix();
          const auto [brick, at] = witness.around.At(target.x(), target.y(), target.z());
          return brick != nullptr && brick->empty.Has(at);
        });
    if (!in_front) return false;
    const Eigen::Vector3d normal = surface.normal.cast<double>();
    const ScanLayer::Density density = witness.layer->DensityAt(centroid, normal, h_);
    return density.at_point * static_cast<double>(surface.area) >= kTellingSamples &&
           witness.layer->ReasonAt(centroid) != UnknownReason::kImage;
  }

  ScanLayer::Density BestDensity(const Members& members, const Eigen::Vector3d& centroid,
                                 const Eigen::Vector3d& normal) const {
    ScanLayer::Density best;
    for (const Witness& witness : witnesses_) {
      if (!Measured(witness.around, members)) continue;
      const ScanLayer::Density density =
          witness.layer->DensityAt(centroid, normal, h_, best.recorded);
      if (density.recorded > best.recorded) best = density;
    }
    return best;
  }

  // One voxel thick, with empty space before and behind: which side it faces is a guess.
  bool EmptyOnBothSides(int local, const Eigen::Vector3f& normal) const {
    const int x = local & 7, y = local >> 3 & 7, z = local >> 6;
    // As far as a planned ray aims (kTargetDistances): out of the voxel whatever the normal.
    const auto empty_towards = [&](float side) {
      const Eigen::Vector3i step = (side * 1.45f * normal).array().round().cast<int>();
      return Empty(x + step.x(), y + step.y(), z + step.z());
    };
    return empty_towards(1) && empty_towards(-1);
  }

  // An unknown voxel next to empty space: false surface, or absorbed along true surface.
  std::optional<SurfaceVoxel> Frontier(int local, VoxelState& state) {
    const int x = local & 7, y = local >> 3 & 7, z = local >> 6;
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();
    empty_.ForEachAround(x, y, z, 1, [&](int dx, int dy, int dz) {
      normal +=
          Eigen::Vector3f(static_cast<float>(dx), static_cast<float>(dy), static_cast<float>(dz));
    });
    SurfaceVoxel surface;
    // Empty on opposite sides: no direction is better than another, so the first is taken.
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
    if (NothingToLookFor(local)) return std::nullopt;
    state = Cause(local);
    surface.centroid = Centre(local).cast<float>();
    surface.area = static_cast<float>(h_ * h_) / surface.normal.lpNorm<Eigen::Infinity>();
    int misses = 0;
    for (const Witness& witness : witnesses_) {
      ScanLayer::Miss miss =
          witness.layer->MissAt(Centre(local), surface.normal.cast<double>(), h_);
      if (miss == ScanLayer::Miss::kNone && DroppedOut(witness, local, Centre(local), surface)) {
        miss = ScanLayer::Miss::kSquare;
      }
      if (miss == ScanLayer::Miss::kNone) continue;
      ++misses;
      if (miss == ScanLayer::Miss::kSquare && surface.missed < UINT8_MAX) ++surface.missed;
    }
    surface.given_up = surface.missed > 0 && misses >= kMissesToGiveUp;
    AddDropouts(local, surface, [](const ScanLayer*) { return false; });
    return surface;
  }

  bool IsSliver(int local, const Eigen::Vector3f& normal) const {
    const int x = local & 7, y = local >> 3 & 7, z = local >> 6;
    const Eigen::Vector3f centre = Centre(local).cast<float>();
    // Half a voxel for the surface's own, and one more. Noise of a third of a voxel stays within.
    const float reach = static_cast<float>(1.5 * h_);
    constexpr float kSameWay = 0.7f;  // cosine, 45 degrees: false surface faces along an axis
    bool sliver = false;
    surface_.ForEachAround(x, y, z, kFuseReach, [&](int dx, int dy, int dz) {
      if (sliver) return;
      const auto [there, at] = around_.At(x + dx, y + dy, z + dz);
      const LocalPlane& plane = there->plane[there->united->Rank(at)];
      sliver = plane.normal.dot(normal) >= kSameWay &&
               std::abs(plane.normal.dot(centre - plane.centroid)) <= reach;
    });
    return sliver;
  }

  // True when there is nothing to look for: the voxel is outside the site, or some scan says that
  // it is in the open sky. That scan need not be a witness: its ray may have ended before the
  // brick, where it would have met level ground. The voxel stays unknown.
  bool NothingToLookFor(int local) const {
    const Eigen::Vector3d centre = Centre(local);
    if (!witnesses_.empty() && !witnesses_.front().layer->WithinSite(centre)) return true;
    return std::any_of(sky_layers_.begin(), sky_layers_.end(),
                       [&](const ScanLayer* layer) { return layer->InSky(centre, h_); });
  }

  VoxelState Cause(int local) const {
    const int x = local & 7, y = local >> 3 & 7, z = local >> 6;
    UnknownReason first = UnknownReason::kImage;
    bool any = false;
    for (const Witness& witness : witnesses_) {
      const BrickNeighbourhood<LayerBrick>& around = witness.around;
      const bool touches = std::any_of(kFaces.begin(), kFaces.end(), [&](const auto& face) {
        const auto [brick, at] = around.At(x + face[0], y + face[1], z + face[2]);
        return brick != nullptr && brick->empty.Has(at);
      });
      if (!touches) continue;
      const UnknownReason reason = witness.layer->ReasonAt(Centre(local));
      if (reason == UnknownReason::kNone) continue;
      first = any ? std::min(first, reason) : reason;
      any = true;
    }
    if (!any || first == UnknownReason::kOcclusion) return VoxelState::kFalseOcclusion;
    return first == UnknownReason::kHole ? VoxelState::kFalseHole : VoxelState::kFalseImage;
  }

  const VoxelIndex& brick_;
  const BrickNeighbourhood<MergedBrick>& around_;
  double h_;
  HaloMask empty_;
  HaloMask surface_;
  HaloMask given_away_;
  std::vector<Witness> witnesses_;
  std::vector<const ScanLayer*> dropout_layers_;  // those that may have dropouts at some voxel
  std::vector<const ScanLayer*> sky_layers_;      // those that may see the sky at some voxel
  std::vector<Dropout> dropouts_;
};

}  // namespace

std::shared_ptr<const Brick> PublishBrick(const MergeRegion& region, size_t i, double voxel_size,
                                          const std::shared_ptr<const Brick>& all_empty) {
  const BrickNeighbourhood<MergedBrick> around = region.Around(i);
  const UnitedBrick* united = around.middle()->united.get();
  if (united != nullptr && united->empty.All()) return all_empty;
  return Publisher(region.brick(i), around, voxel_size).Publish(region.layers(), [&] {
    return region.Witnesses(i);
  });
}

}  // namespace vantage::model

#include "core/planning/patches/patches.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "core/model/view/brick_key.h"
#include "core/model/view/brick_mask.h"
#include "core/planning/patches/skyline.h"
#include "core/planning/patches/space_behind.h"
#include "core/visibility/surface_walk.h"

namespace vantage::planning {
namespace {

constexpr uint32_t kCellsBetweenPolls = 8192;
constexpr uint32_t kMembersBetweenPolls = 1024;  // each looks up its 26 neighbours

// A map from a voxel to its deficient cell, by bricks, since each cell looks up 26 neighbours.
// Cells come in the model's order: those of a brick side by side, by place in it.
class CellTable {
 public:
  // Nothing when cancelled on the way.
  static std::optional<CellTable> Of(const DeficientCells& cells,
                                     const parallel::Cancellation& cancelled) {
    CellTable table;
    uint64_t last = ~uint64_t{0};
    for (uint32_t i = 0; i < cells.size(); ++i) {
      if (i % kCellsBetweenPolls == 0 && cancelled.Requested()) return std::nullopt;
      const model::VoxelIndex voxel = cells.Voxel(i);
      const uint64_t key = model::KeyOf(model::Brick::Of(voxel));
      if (key != last) {
        table.slot_.emplace(key, static_cast<uint32_t>(table.bricks_.size()));
        table.bricks_.emplace_back().first.fill(i);
        last = key;
      }
      BrickCells& brick = table.bricks_.back();
      const int local = model::Brick::LocalOf(voxel);
      brick.mask.Set(local);
      for (size_t w = static_cast<size_t>(local / 64) + 1; w < brick.first.size(); ++w) {
        brick.first[w] = i + 1;
      }
    }
    return table;
  }

  template <typename Fn>
  void ForEachNeighbour(const model::VoxelIndex& v, Fn&& fn) const {
    // They lie in its own brick and up to seven others, each of which is looked up at most once.
    std::array<const BrickCells*, 8> beside{};
    std::array<bool, 8> looked_up{};
    const model::VoxelIndex own = model::Brick::Of(v);
    for (int dz = -1; dz <= 1; ++dz) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          if (dx == 0 && dy == 0 && dz == 0) continue;
          const model::VoxelIndex to = v + model::VoxelIndex(dx, dy, dz);
          const model::VoxelIndex at = model::Brick::Of(to);
          const auto which = static_cast<size_t>((at.x() != own.x()) + 2 * (at.y() != own.y()) +
                                                 4 * (at.z() != own.z()));
          if (!looked_up[which]) {
            looked_up[which] = true;
            const auto it = slot_.find(model::KeyOf(at));
            if (it != slot_.end()) beside[which] = &bricks_[it->second];
          }
          if (beside[which] == nullptr) continue;
          const int local = model::Brick::LocalOf(to);
          if (beside[which]->mask.Has(local)) fn(beside[which]->CellAt(local));
        }
      }
    }
  }

 private:
  struct BrickCells {
    model::BrickMask mask;
    std::array<uint32_t, model::Brick::kSide> first;  // the first cell in or after each word

    // Of a voxel in the mask.
    uint32_t CellAt(int local) const {
      const auto w = static_cast<size_t>(local / 64);
      const uint64_t below = (uint64_t{1} << (local % 64)) - 1;
      return first[w] + static_cast<uint32_t>(std::popcount(mask.word[w] & below));
    }
  };

  CellTable() = default;
  absl::flat_hash_map<model::BrickKey, uint32_t> slot_;
  std::vector<BrickCells> bricks_;
};

// The deficit of a patch, each sample by what it counts.
double ImportanceOf(const Patch& patch, const DeficientCells& cells, const PlanningConfig& config) {
  double wanted = 0;
  for (const uint32_t i : patch.cells) {
    const DeficientCell cell = cells[i];
    const double area = cell.area;
    wanted += cell.worth * (area * (cell.enough - cell.density));
  }
  return config.weights[static_cast<size_t>(patch.kind)] * wanted;
}

// Centre, normal, rectangle and sums of cells [begin, end).
Patch Describe(const DeficientCells& cells, uint32_t begin, uint32_t end, double voxel,
               const PlanningConfig& config) {
  Patch patch;
  patch.kind = cells.Kind(begin);
  patch.cells = {begin, end};
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double density = 0;
  for (uint32_t i = begin; i < end; ++i) {
    const DeficientCell cell = cells[i];
    const double area = cell.area;
    patch.area += area;
    density += area * cell.density;
    patch.deficit += area * (cell.enough - cell.density);
    normal += area * cell.normal.cast<double>();
    mean += area * cell.position.cast<double>();
  }
  mean /= patch.area;
  patch.mean_density = density / patch.area;
  patch.normal = normal.norm() > 1e-9 ? Eigen::Vector3d(normal.normalized())
                                      : cells.Normal(begin).cast<double>();
  // The rectangle lies along the principal axes of the cells in the plane.
  const Eigen::Vector3d e1 = patch.normal.unitOrthogonal();
  const Eigen::Vector3d e2 = patch.normal.cross(e1);
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
  for (uint32_t i = begin; i < end; ++i) {
    const Eigen::Vector3d d = cells.Position(i).cast<double>() - mean;
    const Eigen::Vector2d uv(d.dot(e1), d.dot(e2));
    scatter += uv * uv.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(scatter);
  const Eigen::Vector2d major = solver.eigenvectors().col(1);
  patch.axis_u = (major.x() * e1 + major.y() * e2).normalized();
  Eigen::Vector3d axis_v = patch.normal.cross(patch.axis_u);
  Eigen::AlignedBox2d extent;
  for (uint32_t i = begin; i < end; ++i) {
    const Eigen::Vector3d d = cells.Position(i).cast<double>() - mean;
    extent.extend(Eigen::Vector2d(d.dot(patch.axis_u), d.dot(axis_v)));
  }
  extent.min().array() -= voxel / 2;  // cells have a width
  extent.max().array() += voxel / 2;
  const Eigen::Vector2d middle = extent.center();
  patch.centre = mean + middle.x() * patch.axis_u + middle.y() * axis_v;
  patch.length_u = extent.sizes().x();
  patch.length_v = extent.sizes().y();
  if (patch.length_v > patch.length_u) {
    std::swap(patch.length_u, patch.length_v);
    patch.axis_u = axis_v;
  }
  patch.importance = ImportanceOf(patch, cells, config);
  return patch;
}

// Every deficient voxel, in the model's order, with the dropouts that its rays had. False when
// cancelled on the way.
bool CollectDeficient(const model::PlanningView& model, const PlanningConfig& config,
                      const parallel::Cancellation& cancelled, DeficientCells::Builder& deficient,
                      std::vector<Eigen::Vector3f>& all_dropouts) {
  const auto enough = [&](const model::VoxelIndex& v, model::VoxelState state,
                          const model::SurfaceVoxel& surface, double density) {
    // Rays went into a hole and none came back, so no depth behind it counts.
    const bool opening =
        state == model::VoxelState::kFalseOcclusion || state == model::VoxelState::kFalseImage;
    if (config.unknown_depth <= 0 || !opening) return static_cast<float>(density);
    const double depth = DepthBehind(model, v, surface.normal, config.unknown_depth);
    return static_cast<float>(DensityWorthHaving(density, depth));
  };
  std::optional<Skyline> skyline = Skyline::Of(model, cancelled);
  if (!skyline) return false;
  return visibility::WalkSurface(
      model, cancelled,
      [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& surface) {
        if (surface.given_up || !(surface.area > 0)) return;
        const std::optional<Requirement> required = config.RequiredAt(model.Centre(v));
        if (!required.has_value()) return;
        if (surface.density >= static_cast<float>(required->density)) return;
        const bool measured = state == model::VoxelState::kTrueSurface;
        if (!measured && skyline->InSky(v, surface.normal)) return;
        const std::span<const model::Dropout> dropouts = model.Dropouts(v);
        deficient.Add(
            {v, model::KindOf(state), surface.centroid, surface.normal, surface.area,
             model::IsFalseSurface(state) ? 0.0f : surface.density,
             1 + static_cast<float>(surface.spread) / 256, static_cast<float>(required->density),
             enough(v, state, surface, required->density),
             static_cast<float>(SuccessProbability(surface.missed)),
             static_cast<float>(required->worth), measured ? SkylineSines() : skyline->Around(v),
             static_cast<uint32_t>(all_dropouts.size()), static_cast<uint32_t>(dropouts.size())});
        for (const model::Dropout& dropout : dropouts) all_dropouts.push_back(dropout.from);
      });
}

// Grows patches over the deficient cells.
class PatchGrowth {
 public:
  PatchGrowth(const DeficientCells& deficient, const CellTable& table, double voxel,
              const PatchTolerance& tolerance)
      : deficient_(deficient),
        table_(table),
        cos_angle_(static_cast<float>(std::cos(tolerance.angle))),
        max_offset_(static_cast<float>(tolerance.offset * voxel)),
        taken_(deficient.size(), 0) {}

  bool Taken(uint32_t cell) const { return taken_[cell] != 0; }

  // The cells of the patch of `seed`, which is not taken; they are, then. Nothing when cancelled on
  // the way.
  std::optional<std::vector<uint32_t>> From(uint32_t seed,
                                            const parallel::Cancellation& cancelled) {
    const Plane plane = PlaneAround(seed);
    const model::SurfaceKind kind = deficient_.Kind(seed);
    std::vector<uint32_t> members(1, seed);
    taken_[seed] = 1;
    for (size_t head = 0; head < members.size(); ++head) {
      if ((head + 1) % kMembersBetweenPolls == 0 && cancelled.Requested()) return std::nullopt;
      table_.ForEachNeighbour(deficient_.Voxel(members[head]), [&](uint32_t i) {
        if (taken_[i] || !Fits(i, kind, plane)) return;
        taken_[i] = 1;
        members.push_back(i);
      });
    }
    return members;
  }

 private:
  struct Plane {
    Eigen::Vector3f normal;
    Eigen::Vector3f centre;
  };
  bool Fits(uint32_t i, model::SurfaceKind kind, const Plane& plane) const {
    return deficient_.Kind(i) == kind && deficient_.Normal(i).dot(plane.normal) >= cos_angle_ &&
           std::abs(plane.normal.dot(deficient_.Position(i) - plane.centre)) <= max_offset_;
  }
  // The plane is that of the seed and the neighbours that agree with it. It does not move while the
  // patch grows, or the first cells could end up outside the tolerance.
  Plane PlaneAround(uint32_t seed) const {
    const model::SurfaceKind kind = deficient_.Kind(seed);
    const Plane alone{deficient_.Normal(seed), deficient_.Position(seed)};
    Plane plane = alone;
    float count = 1;
    table_.ForEachNeighbour(deficient_.Voxel(seed), [&](uint32_t i) {
      if (!Fits(i, kind, alone)) return;
      plane.normal += deficient_.Normal(i);
      plane.centre += deficient_.Position(i);
      count += 1;
    });
    plane.normal.normalize();
    plane.centre /= count;
    return Fits(seed, kind, plane) ? plane : alone;  // an edge has its own plane
  }

  const DeficientCells& deficient_;
  const CellTable& table_;
  const float cos_angle_;
  const float max_offset_;
  std::vector<uint8_t> taken_;
};

}  // namespace

double SuccessProbability(int missed) { return 2.0 / (2 + missed); }

absl::StatusOr<PatchSet> ExtractPatches(const model::PlanningView& model,
                                        const PlanningConfig& config,
                                        const PatchTolerance& tolerance,
                                        const parallel::Cancellation& cancelled) {
  const absl::Status stopped = absl::CancelledError("extract patches");
  PatchSet set;
  DeficientCells::Builder builder(model.voxel_size());
  if (!CollectDeficient(model, config, cancelled, builder, set.dropouts)) return stopped;
  DeficientCells deficient = std::move(builder).Build();
  const auto table = CellTable::Of(deficient, cancelled);
  if (!table.has_value()) return stopped;
  PatchGrowth growth(deficient, *table, model.voxel_size(), tolerance);
  std::vector<uint32_t> order;  // the cells, patch by patch
  order.reserve(deficient.size());
  std::vector<uint32_t> ends;  // of the patches
  for (uint32_t seed = 0; seed < deficient.size(); ++seed) {
    if (seed % kMembersBetweenPolls == 0 && cancelled.Requested()) return stopped;
    if (growth.Taken(seed)) continue;
    const auto members = growth.From(seed, cancelled);
    if (!members.has_value()) return stopped;
    order.insert(order.end(), members->begin(), members->end());
    ends.push_back(static_cast<uint32_t>(order.size()));
  }
  deficient.Reorder(order);
  set.cells = std::move(deficient);
  std::vector<Patch> patches;
  patches.reserve(ends.size());
  uint32_t begin = 0;
  for (const uint32_t end : ends) {
    if (patches.size() % kMembersBetweenPolls == 0 && cancelled.Requested()) return stopped;
    patches.push_back(Describe(set.cells, begin, end, model.voxel_size(), config));
    set.area += patches.back().area;
    begin = end;
  }
  set.patches = std::move(patches);
  return set;
}

absl::StatusOr<PatchSet> RankPatches(const PlanningConfig& config, PatchSet set,
                                     const parallel::Cancellation& cancelled) {
  const std::span<Patch> patches = set.patches.Mutable();
  for (Patch& patch : patches) patch.importance = ImportanceOf(patch, set.cells, config);
  // Of equal importance, the patch met first comes first.
  std::stable_sort(patches.begin(), patches.end(),
                   [](const Patch& a, const Patch& b) { return a.importance > b.importance; });
  std::vector<uint32_t> order;
  order.reserve(set.cells.size());
  size_t until_poll = 0;
  for (Patch& patch : patches) {
    if (order.size() >= until_poll) {
      if (cancelled.Requested()) return absl::CancelledError("rank patches");
      until_poll = order.size() + kCellsBetweenPolls;
    }
    const auto first = static_cast<uint32_t>(order.size());
    order.insert(order.end(), patch.cells.begin(), patch.cells.end());
    patch.cells = {first, static_cast<uint32_t>(order.size())};
  }
  set.cells.Reorder(order);
  return set;
}

}  // namespace vantage::planning

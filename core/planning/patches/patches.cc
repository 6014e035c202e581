#include "core/planning/patches/patches.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "core/planning/patches/skyline.h"
#include "core/planning/patches/space_behind.h"
#include "core/visibility/surface_walk.h"

namespace vantage::planning {
namespace {

constexpr uint32_t kCellsBetweenPolls = 8192;
constexpr uint32_t kMembersBetweenPolls = 1024;  // each looks up its 26 neighbours
constexpr uint32_t kNoCell = std::numeric_limits<uint32_t>::max();

// A map from a voxel to its deficient cell, by bricks, since each cell looks up 26 neighbours.
class CellTable {
 public:
  // Nothing when cancelled on the way.
  static std::optional<CellTable> Of(const std::vector<DeficientCell>& cells,
                                     const parallel::Cancellation& cancelled) {
    CellTable table;
    for (uint32_t i = 0; i < cells.size(); ++i) {
      if (i % kCellsBetweenPolls == 0 && cancelled.Requested()) return std::nullopt;
      const auto [it, fresh] = table.slot_.try_emplace(Key(model::Brick::Of(cells[i].voxel)),
                                                       static_cast<uint32_t>(table.bricks_.size()));
      if (fresh) {
        table.bricks_.emplace_back();
        table.bricks_.back().fill(kNoCell);
      }
      table.bricks_[it->second][static_cast<size_t>(model::Brick::LocalOf(cells[i].voxel))] = i;
    }
    return table;
  }

  template <typename Fn>
  void ForEachNeighbour(const model::VoxelIndex& v, Fn&& fn) const {
    const bool inner = ((v.array() - (v.array() / 8) * 8) > 0).all() && (v.array() >= 0).all() &&
                       ((v.array() - (v.array() / 8) * 8) < 7).all();
    const auto own = slot_.find(Key(model::Brick::Of(v)));
    for (int dz = -1; dz <= 1; ++dz) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          if (dx == 0 && dy == 0 && dz == 0) continue;
          const model::VoxelIndex to = v + model::VoxelIndex(dx, dy, dz);
          const auto it = inner ? own : slot_.find(Key(model::Brick::Of(to)));
          if (it == slot_.end()) continue;
          const uint32_t cell = bricks_[it->second][static_cast<size_t>(model::Brick::LocalOf(to))];
          if (cell != kNoCell) fn(cell);
        }
      }
    }
  }

 private:
  CellTable() = default;
  static uint64_t Key(const model::VoxelIndex& brick) {
    const auto part = [](int i) { return static_cast<uint64_t>(i + (1 << 20)) & 0x1fffff; };
    return part(brick.x()) | part(brick.y()) << 21 | part(brick.z()) << 42;
  }
  absl::flat_hash_map<uint64_t, uint32_t> slot_;
  std::vector<std::array<uint32_t, model::Brick::kVoxels>> bricks_;
};

// Centre, normal, rectangle and sums of cells [begin, end).
Patch Describe(const std::vector<DeficientCell>& cells, uint32_t begin, uint32_t end, double voxel,
               const PlanningConfig& config) {
  Patch patch;
  patch.kind = cells[begin].kind;
  patch.cells.resize(end - begin);
  std::iota(patch.cells.begin(), patch.cells.end(), begin);
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double density = 0;
  for (uint32_t i = begin; i < end; ++i) {
    const DeficientCell& cell = cells[i];
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
                                      : cells[begin].normal.cast<double>();
  // The rectangle lies along the principal axes of the cells in the plane.
  const Eigen::Vector3d e1 = patch.normal.unitOrthogonal();
  const Eigen::Vector3d e2 = patch.normal.cross(e1);
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
  for (uint32_t i = begin; i < end; ++i) {
    const Eigen::Vector3d d = cells[i].position.cast<double>() - mean;
    const Eigen::Vector2d uv(d.dot(e1), d.dot(e2));
    scatter += uv * uv.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(scatter);
  const Eigen::Vector2d major = solver.eigenvectors().col(1);
  patch.axis_u = (major.x() * e1 + major.y() * e2).normalized();
  Eigen::Vector3d axis_v = patch.normal.cross(patch.axis_u);
  Eigen::AlignedBox2d extent;
  for (uint32_t i = begin; i < end; ++i) {
    const Eigen::Vector3d d = cells[i].position.cast<double>() - mean;
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
  patch.importance = config.weights[static_cast<size_t>(patch.kind)] * patch.deficit;
  return patch;
}

// Every deficient voxel, in the model's order, with the dropouts that its rays had. False when
// cancelled on the way.
bool CollectDeficient(const model::PlanningView& model, const PlanningConfig& config,
                      const parallel::Cancellation& cancelled,
                      std::vector<DeficientCell>& deficient,
                      std::vector<Eigen::Vector3f>& all_dropouts) {
  const auto density = static_cast<float>(config.required_density);
  const auto enough = [&](const model::VoxelIndex& v, model::VoxelState state,
                          const model::SurfaceVoxel& surface) {
    // Rays went into a hole and none came back, so no depth behind it counts.
    const bool opening =
        state == model::VoxelState::kFalseOcclusion || state == model::VoxelState::kFalseImage;
    if (config.unknown_depth <= 0 || !opening) return density;
    const double depth = DepthBehind(model, v, surface.normal, config.unknown_depth);
    return static_cast<float>(DensityWorthHaving(config.required_density, depth));
  };
  std::optional<Skyline> skyline = Skyline::Of(model, cancelled);
  if (!skyline) return false;
  return visibility::WalkSurface(
      model, cancelled,
      [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& surface) {
        if (surface.given_up || !(surface.area > 0) || surface.density >= density) return;
        if (config.region_of_interest.has_value() &&
            !config.region_of_interest->contains(model.Centre(v))) {
          return;
        }
        const bool measured = state == model::VoxelState::kTrueSurface;
        if (!measured && skyline->InSky(v, surface.normal)) return;
        const std::span<const model::Dropout> dropouts = model.Dropouts(v);
        deficient.push_back(
            {v, model::KindOf(state), surface.centroid, surface.normal, surface.area,
             model::IsFalseSurface(state) ? 0.0f : surface.density,
             1 + static_cast<float>(surface.spread) / 256, enough(v, state, surface),
             static_cast<float>(SuccessProbability(surface.missed)),
             measured ? SkylineSines() : skyline->Around(v),
             static_cast<uint32_t>(all_dropouts.size()), static_cast<uint32_t>(dropouts.size())});
        for (const model::Dropout& dropout : dropouts) all_dropouts.push_back(dropout.from);
      });
}

// Grows patches over the deficient cells.
class PatchGrowth {
 public:
  PatchGrowth(const std::vector<DeficientCell>& deficient, const CellTable& table, double voxel,
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
    std::vector<uint32_t> members(1, seed);
    taken_[seed] = 1;
    for (size_t head = 0; head < members.size(); ++head) {
      if ((head + 1) % kMembersBetweenPolls == 0 && cancelled.Requested()) return std::nullopt;
      table_.ForEachNeighbour(deficient_[members[head]].voxel, [&](uint32_t i) {
        if (taken_[i] || !Fits(i, deficient_[seed].kind, plane)) return;
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
    return deficient_[i].kind == kind && deficient_[i].normal.dot(plane.normal) >= cos_angle_ &&
           std::abs(plane.normal.dot(deficient_[i].position - plane.centre)) <= max_offset_;
  }
  // The plane is that of the seed and the neighbours that agree with it. It does not move while the
  // patch grows, or the first cells could end up outside the tolerance.
  Plane PlaneAround(uint32_t seed) const {
    const DeficientCell& own = deficient_[seed];
    const Plane alone{own.normal, own.position};
    Plane plane = alone;
    float count = 1;
    table_.ForEachNeighbour(own.voxel, [&](uint32_t i) {
      if (!Fits(i, own.kind, alone)) return;
      plane.normal += deficient_[i].normal;
      plane.centre += deficient_[i].position;
      count += 1;
    });
    plane.normal.normalize();
    plane.centre /= count;
    return Fits(seed, own.kind, plane) ? plane : alone;  // an edge has its own plane
  }

  const std::vector<DeficientCell>& deficient_;
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
  std::vector<DeficientCell> deficient;
  if (!CollectDeficient(model, config, cancelled, deficient, set.dropouts)) return stopped;
  const auto table = CellTable::Of(deficient, cancelled);
  if (!table.has_value()) return stopped;
  PatchGrowth growth(deficient, *table, model.voxel_size(), tolerance);
  set.cells.reserve(deficient.size());
  for (uint32_t seed = 0; seed < deficient.size(); ++seed) {
    if (seed % kMembersBetweenPolls == 0 && cancelled.Requested()) return stopped;
    if (growth.Taken(seed)) continue;
    const auto members = growth.From(seed, cancelled);
    if (!members.has_value()) return stopped;
    const auto begin = static_cast<uint32_t>(set.cells.size());
    for (const uint32_t i : *members) set.cells.push_back(deficient[i]);
    set.patches.push_back(Describe(set.cells, begin, static_cast<uint32_t>(set.cells.size()),
                                   model.voxel_size(), config));
    set.area += set.patches.back().area;
  }
  return set;
}

absl::StatusOr<PatchSet> RankPatches(const PlanningConfig& config, PatchSet set,
                                     const parallel::Cancellation& cancelled) {
  for (Patch& patch : set.patches) {
    patch.importance = config.weights[static_cast<size_t>(patch.kind)] * patch.deficit;
  }
  // Of equal importance, the patch met first comes first.
  std::stable_sort(set.patches.begin(), set.patches.end(),
                   [](const Patch& a, const Patch& b) { return a.importance > b.importance; });
  std::vector<DeficientCell> cells;
  cells.reserve(set.cells.size());
  size_t until_poll = 0;
  for (Patch& patch : set.patches) {
    if (cells.size() >= until_poll) {
      if (cancelled.Requested()) return absl::CancelledError("rank patches");
      until_poll = cells.size() + kCellsBetweenPolls;
    }
    for (uint32_t& cell : patch.cells) {
      cells.push_back(set.cells[cell]);
      cell = static_cast<uint32_t>(cells.size() - 1);
    }
  }
  set.cells = std::move(cells);
  return set;
}

}  // namespace vantage::planning

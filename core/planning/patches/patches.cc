#include "core/planning/patches/patches.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>
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
  static std::optional<CellTable> Of(const std::vector<DeficientCell>& cells,
                                     const parallel::Cancellation& cancelled) {
    CellTable table;
    uint64_t last = ~uint64_t{0};
    for (uint32_t i = 0; i < cells.size(); ++i) {
      if (i % kCellsBetweenPolls == 0 && cancelled.Requested()) return std::nullopt;
      const uint64_t key = model::KeyOf(model::Brick::Of(cells[i].voxel));
      if (key != last) {
        table.slot_.emplace(key, static_cast<uint32_t>(table.bricks_.size()));
        table.bricks_.emplace_back().first.fill(i);
        last = key;
      }
      BrickCells& brick = table.bricks_.back();
      const int local = model::Brick::LocalOf(cells[i].voxel);
      brick.mask.Set(local);
      for (size_t w = static_cast<size_t>(local / 64) + 1; w < brick.first.size(); ++w) {
        brick.first[w] = i + 1;
      }
    }
    return table;
  }

  template <typename Fn>
  void ForEachNeighbour(const model::VoxelIndex& v, Fn&& fn) const {
    const bool inner = ((v.array() - (v.array() / 8) * 8) > 0).all() && (v.array() >= 0).all() &&
                       ((v.array() - (v.array() / 8) * 8) < 7).all();
    const auto own = slot_.find(model::KeyOf(model::Brick::Of(v)));
    for (int dz = -1; dz <= 1; ++dz) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          if (dx == 0 && dy == 0 && dz == 0) continue;
          const model::VoxelIndex to = v + model::VoxelIndex(dx, dy, dz);
          const auto it = inner ? own : slot_.find(model::KeyOf(model::Brick::Of(to)));
          if (it == slot_.end()) continue;
          const BrickCells& brick = bricks_[it->second];
          const int local = model::Brick::LocalOf(to);
          if (brick.mask.Has(local)) fn(brick.CellAt(local));
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
double ImportanceOf(const Patch& patch, const std::vector<DeficientCell>& cells,
                    const PlanningConfig& config) {
  double wanted = 0;
  for (const uint32_t i : patch.cells) {
    const DeficientCell& cell = cells[i];
    const double area = cell.area;
    wanted += cell.worth * (area * (cell.enough - cell.density));
  }
  return config.weights[static_cast<size_t>(patch.kind)] * wanted;
}

// Puts cells in an order: at `k` the one that was at order[k]. `order` is used up.
void Reorder(std::vector<uint32_t>& order, std::vector<DeficientCell>& cells) {
  for (uint32_t begin = 0; begin < order.size(); ++begin) {
    // Along a cycle of the permutation; what is in its place is marked by its own number.
    if (order[begin] == begin) continue;
    const DeficientCell first = cells[begin];
    uint32_t to = begin;
    while (order[to] != begin) {
      const uint32_t from = order[to];
      cells[to] = cells[from];
      order[to] = to;
      to = from;
    }
    cells[to] = first;
    order[to] = to;
  }
}

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
  patch.importance = ImportanceOf(patch, cells, config);
  return patch;
}

// Every deficient voxel, in the model's order, with the dropouts that its rays had. False when
// cancelled on the way.
bool CollectDeficient(const model::PlanningView& model, const PlanningConfig& config,
                      const parallel::Cancellation& cancelled,
                      std::vector<DeficientCell>& deficient,
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
        deficient.push_back(
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
  Reorder(order, deficient);
  set.cells = std::move(deficient);
  set.patches.reserve(ends.size());
  uint32_t begin = 0;
  for (const uint32_t end : ends) {
    if (set.patches.size() % kMembersBetweenPolls == 0 && cancelled.Requested()) return stopped;
    set.patches.push_back(Describe(set.cells, begin, end, model.voxel_size(), config));
    set.area += set.patches.back().area;
    begin = end;
  }
  return set;
}

absl::StatusOr<PatchSet> RankPatches(const PlanningConfig& config, PatchSet set,
                                     const parallel::Cancellation& cancelled) {
  for (Patch& patch : set.patches) {
    patch.importance = ImportanceOf(patch, set.cells, config);
  }
  // Of equal importance, the patch met first comes first.
  std::stable_sort(set.patches.begin(), set.patches.end(),
                   [](const Patch& a, const Patch& b) { return a.importance > b.importance; });
  std::vector<uint32_t> order;
  order.reserve(set.cells.size());
  size_t until_poll = 0;
  for (Patch& patch : set.patches) {
    if (order.size() >= until_poll) {
      if (cancelled.Requested()) return absl::CancelledError("rank patches");
      until_poll = order.size() + kCellsBetweenPolls;
    }
    for (uint32_t& cell : patch.cells) {
      order.push_back(cell);
      cell = static_cast<uint32_t>(order.size() - 1);
    }
  }
  Reorder(order, set.cells);
  return set;
}

}  // namespace vantage::planning

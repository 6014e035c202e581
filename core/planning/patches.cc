#include "core/planning/patches.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "core/planning/space_behind.h"
#include "core/planning/surface_walk.h"

namespace vantage {
namespace {

constexpr uint32_t kCellsBetweenPolls = 8192;
constexpr uint32_t kMembersBetweenPolls = 1024;  // each asks for its 26 neighbours
constexpr uint32_t kNoCell = std::numeric_limits<uint32_t>::max();

// From a voxel to its needy cell, by bricks: neighbours are looked up 26 times a cell.
class CellTable {
 public:
  // Not to be used when the budget has expired on the way.
  CellTable(const std::vector<NeedyCell>& cells, const Budget& budget) {
    for (uint32_t i = 0; i < cells.size(); ++i) {
      if (i % kCellsBetweenPolls == 0 && budget.Expired()) return;
      const auto [it, fresh] =
          slot_.try_emplace(Key(Brick::Of(cells[i].voxel)), static_cast<uint32_t>(bricks_.size()));
      if (fresh) {
        bricks_.emplace_back();
        bricks_.back().fill(kNoCell);
      }
      bricks_[it->second][static_cast<size_t>(Brick::LocalOf(cells[i].voxel))] = i;
    }
  }

  template <typename Fn>
  void ForEachNeighbour(const VoxelIndex& v, Fn&& fn) const {
    const bool inner = ((v.array() - (v.array() / 8) * 8) > 0).all() && (v.array() >= 0).all() &&
                       ((v.array() - (v.array() / 8) * 8) < 7).all();
    const auto own = slot_.find(Key(Brick::Of(v)));
    for (int dz = -1; dz <= 1; ++dz) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          if (dx == 0 && dy == 0 && dz == 0) continue;
          const VoxelIndex to = v + VoxelIndex(dx, dy, dz);
          const auto it = inner ? own : slot_.find(Key(Brick::Of(to)));
          if (it == slot_.end()) continue;
          const uint32_t cell = bricks_[it->second][static_cast<size_t>(Brick::LocalOf(to))];
          if (cell != kNoCell) fn(cell);
        }
      }
    }
  }

 private:
  static uint64_t Key(const VoxelIndex& brick) {
    const auto part = [](int i) { return static_cast<uint64_t>(i + (1 << 20)) & 0x1fffff; };
    return part(brick.x()) | part(brick.y()) << 21 | part(brick.z()) << 42;
  }
  absl::flat_hash_map<uint64_t, uint32_t> slot_;
  std::vector<std::array<uint32_t, Brick::kVoxels>> bricks_;
};

// Centre, normal, rectangle and sums of cells [begin, end).
Patch Describe(const std::vector<NeedyCell>& cells, uint32_t begin, uint32_t end, double voxel,
               const PlanningConfig& config) {
  Patch patch;
  patch.kind = cells[begin].kind;
  patch.cells.resize(end - begin);
  std::iota(patch.cells.begin(), patch.cells.end(), begin);
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double density = 0;
  for (uint32_t i = begin; i < end; ++i) {
    const NeedyCell& cell = cells[i];
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

}  // namespace

double SuccessProbability(int missed) { return 2.0 / (2 + missed); }

PatchSet ExtractPatches(const PlanningView& model, const PlanningConfig& config,
                        const PatchTolerance& tolerance, const Budget& budget) {
  PatchSet set;
  std::vector<NeedyCell> needy;
  const auto density = static_cast<float>(config.required_density);
  const auto enough = [&](const VoxelIndex& v, VoxelState state, const SurfaceVoxel& surface) {
    // Rays have gone into a hole, and nothing came back.
    const bool opening = state == VoxelState::kFalseOcclusion || state == VoxelState::kFalseImage;
    if (config.depth_behind <= 0 || !opening) return density;
    const double depth = DepthBehind(model, v, surface.normal, config.depth_behind);
    return static_cast<float>(DensityWorthHaving(config.required_density, depth));
  };
  WalkSurface(
      model, budget, [&](const VoxelIndex& v, VoxelState state, const SurfaceVoxel& surface) {
        if (surface.given_up || !(surface.area > 0) || surface.density >= density) return;
        if (config.region_of_interest.has_value() &&
            !config.region_of_interest->contains(model.Centre(v))) {
          return;
        }
        const std::span<const VainLook> vain = model.VainLooks(v);
        needy.push_back({v, KindOf(state), surface.centroid, surface.normal, surface.area,
                         IsFalseSurface(state) ? 0.0f : surface.density,
                         1 + static_cast<float>(surface.spread) / 256, enough(v, state, surface),
                         static_cast<float>(SuccessProbability(surface.missed)),
                         static_cast<uint32_t>(set.vain.size()),
                         static_cast<uint32_t>(vain.size())});
        for (const VainLook& look : vain) set.vain.push_back(look.from);
      });
  if (budget.Expired()) return set;

  const CellTable table(needy, budget);
  if (budget.Expired()) return set;
  const double voxel = model.voxel_size();
  const auto cos_angle = static_cast<float>(std::cos(tolerance.angle));
  const auto max_offset = static_cast<float>(tolerance.offset * voxel);
  std::vector<uint8_t> taken(needy.size(), 0);
  std::vector<uint32_t> members;
  set.cells.reserve(needy.size());
  for (uint32_t seed = 0; seed < needy.size(); ++seed) {
    if (seed % kMembersBetweenPolls == 0 && budget.Expired()) return set;
    if (taken[seed]) continue;
    // The plane is that of the seed and those around it that agree with it, and stays: a plane
    // that moved while the patch grew could leave its first cells outside the tolerance.
    Eigen::Vector3f normal = needy[seed].normal;
    Eigen::Vector3f centre = needy[seed].position;
    float count = 1;
    table.ForEachNeighbour(needy[seed].voxel, [&](uint32_t i) {
      if (needy[i].kind != needy[seed].kind ||
          needy[i].normal.dot(needy[seed].normal) < cos_angle ||
          std::abs(needy[seed].normal.dot(needy[i].position - needy[seed].position)) > max_offset) {
        return;
      }
      normal += needy[i].normal;
      centre += needy[i].position;
      count += 1;
    });
    normal.normalize();
    centre /= count;
    const auto fits = [&](uint32_t i) {
      return needy[i].kind == needy[seed].kind && needy[i].normal.dot(normal) >= cos_angle &&
             std::abs(normal.dot(needy[i].position - centre)) <= max_offset;
    };
    if (!fits(seed)) {  // an edge: its own plane then
      normal = needy[seed].normal;
      centre = needy[seed].position;
    }
    members.assign(1, seed);
    taken[seed] = 1;
    for (size_t head = 0; head < members.size(); ++head) {
      if ((head + 1) % kMembersBetweenPolls == 0 && budget.Expired()) return set;
      table.ForEachNeighbour(needy[members[head]].voxel, [&](uint32_t i) {
        if (taken[i] || !fits(i)) return;
        taken[i] = 1;
        members.push_back(i);
      });
    }
    const auto begin = static_cast<uint32_t>(set.cells.size());
    for (const uint32_t i : members) set.cells.push_back(needy[i]);
    set.patches.push_back(
        Describe(set.cells, begin, static_cast<uint32_t>(set.cells.size()), voxel, config));
    set.area += set.patches.back().area;
  }
  set.finished = true;
  return set;
}

void RankPatches(const PlanningConfig& config, PatchSet& set, const Budget& budget) {
  for (Patch& patch : set.patches) {
    patch.importance = config.weights[static_cast<size_t>(patch.kind)] * patch.deficit;
  }
  // Equal importance: the patch met first comes first.
  std::stable_sort(set.patches.begin(), set.patches.end(),
                   [](const Patch& a, const Patch& b) { return a.importance > b.importance; });
  std::vector<NeedyCell> cells;
  cells.reserve(set.cells.size());
  size_t until_poll = 0;
  for (Patch& patch : set.patches) {
    if (cells.size() >= until_poll) {
      if (budget.Expired()) {
        set.finished = false;
        return;
      }
      until_poll = cells.size() + kCellsBetweenPolls;
    }
    for (uint32_t& cell : patch.cells) {
      cells.push_back(set.cells[cell]);
      cell = static_cast<uint32_t>(cells.size() - 1);
    }
  }
  set.cells = std::move(cells);
}

}  // namespace vantage

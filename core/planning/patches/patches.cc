#include "core/planning/patches/patches.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "absl/status/status.h"
#include "core/planning/patches/cell_table.h"
#include "core/planning/patches/collect_deficient.h"

namespace vantage::planning {
namespace {

constexpr uint32_t kCellsBetweenPolls = 8192;
constexpr uint32_t kMembersBetweenPolls = 1024;  // each looks up its 26 neighbours

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
Patch Describe(const DeficientCells& cells, uint32_t begin, uint32_t end, double edge,
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
  extent.min().array() -= edge / 2;  // cells have a width
  extent.max().array() += edge / 2;
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

// Grows patches over the deficient cells. Table: CellTable, or CoarseCellTable.
template <typename Table>
class PatchGrowth {
 public:
  PatchGrowth(const DeficientCells& deficient, const Table& table, double edge,
              const PatchTolerance& tolerance)
      : deficient_(deficient),
        table_(table),
        cos_angle_(static_cast<float>(std::cos(tolerance.angle))),
        max_offset_(static_cast<float>(tolerance.offset * edge)),
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
  const Table& table_;
  const float cos_angle_;
  const float max_offset_;
  std::vector<uint8_t> taken_;
};

// The cells, patch by patch, and where each patch ends.
struct Groups {
  std::vector<uint32_t> order;
  std::vector<uint32_t> ends;
};

// Nothing when cancelled on the way, or when `table` is nothing for that reason. `edge`: m, of what
// a cell stands for.
template <typename Table>
std::optional<Groups> Grow(const DeficientCells& deficient, const std::optional<Table>& table,
                           double edge, const PatchTolerance& tolerance,
                           const parallel::Cancellation& cancelled) {
  if (!table.has_value()) return std::nullopt;
  PatchGrowth growth(deficient, *table, edge, tolerance);
  Groups groups;
  groups.order.reserve(deficient.size());
  for (uint32_t seed = 0; seed < deficient.size(); ++seed) {
    if (seed % kMembersBetweenPolls == 0 && cancelled.Requested()) return std::nullopt;
    if (growth.Taken(seed)) continue;
    const auto members = growth.From(seed, cancelled);
    if (!members.has_value()) return std::nullopt;
    groups.order.insert(groups.order.end(), members->begin(), members->end());
    groups.ends.push_back(static_cast<uint32_t>(groups.order.size()));
  }
  return groups;
}

}  // namespace

absl::StatusOr<PatchSet> ExtractPatches(const model::PlanningView& model,
                                        const PlanningConfig& config,
                                        const PatchTolerance& tolerance,
                                        const parallel::Cancellation& cancelled,
                                        const Region& told) {
  const absl::Status stopped = absl::CancelledError("extract patches");
  PatchSet set;
  const std::optional<int> shift = CubeShiftOf(model, config, cancelled);
  if (!shift.has_value()) return stopped;
  set.cube = 1 << *shift;
  auto collected = CollectDeficient(model, config, *shift, told, set.dropouts, cancelled);
  if (!collected.has_value()) return stopped;
  DeficientCells deficient = *std::move(collected);
  const double edge = set.cube * model.voxel_size();
  std::optional<Groups> groups =
      *shift == 0
          ? Grow<CellTable>(deficient, CellTable::Of(deficient, cancelled), edge, tolerance,
                            cancelled)
          : Grow<CoarseCellTable>(deficient, CoarseCellTable::Of(deficient, *shift, cancelled),
                                  edge, tolerance, cancelled);
  if (!groups.has_value()) return stopped;
  deficient.Reorder(groups->order);
  set.cells = std::move(deficient);
  std::vector<Patch> patches;
  patches.reserve(groups->ends.size());
  uint32_t begin = 0;
  for (const uint32_t end : groups->ends) {
    if (patches.size() % kMembersBetweenPolls == 0 && cancelled.Requested()) return stopped;
    patches.push_back(Describe(set.cells, begin, end, edge, config));
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

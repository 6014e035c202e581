#include "core/planning/feasibility/feasible_views.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace vantage::planning {
namespace {

constexpr double kSlack = 1e-9;     // m, for limits that fall on a cell's face
constexpr double kOverFloor = 0.3;  // m that a place may be given below its floor

int FloorDiv(int a, int b) { return a >= 0 ? a / b : -((-a + b - 1) / b); }

// row | row << 1 | row >> 1, with opaque space beyond both ends.
void Dilate(std::span<const uint64_t> row, std::span<uint64_t> out) {
  for (size_t w = 0; w < row.size(); ++w) {
    const uint64_t below = w == 0 ? 1 : row[w - 1] >> 63;
    const uint64_t above = w + 1 == row.size() ? uint64_t{1} << 63 : row[w + 1] << 63;
    out[w] = row[w] | row[w] << 1 | below | row[w] >> 1 | above;
  }
}

bool AnyBit(const uint64_t* words, int first, int count) {
  for (int bit = first; bit < first + count; ++bit) {
    if ((words[bit >> 6] >> (bit & 63)) & 1) return true;
  }
  return false;
}

}  // namespace

absl::StatusOr<FeasibleViews> FeasibleViews::Find(const model::PlanningView& model,
                                                  const visibility::OpaqueGrid& grid,
                                                  const sensor::ScannerModel& scanner,
                                                  const PlanningConfig& config,
                                                  parallel::Parallel& parallel,
                                                  const parallel::Cancellation& cancelled) {
  FeasibleViews views;
  views.voxel_ = model.voxel_size();
  views.voxels_per_cell_ =
      std::max(1, static_cast<int>(std::lround(config.viewcell_size / model.voxel_size())));
  const int n = views.voxels_per_cell_;
  views.cell_size_ = n * model.voxel_size();
  const model::VoxelBox& box = model.bounds();
  if (box.empty()) return views;
  for (int a = 0; a < 3; ++a) {
    views.first_[a] = FloorDiv(box.min[a], n);
    views.size_[a] = FloorDiv(box.max[a] - 1, n) + 1 - views.first_[a];
  }
  if (!views.Judge(model, grid, scanner, config, parallel, cancelled)) {
    return absl::CancelledError("feasible views");
  }
  views.ListFeasible(config.require_reachable);
  return views;
}

// Why each cell is not feasible, reachability apart. False when cancelled on the way.
bool FeasibleViews::Judge(const model::PlanningView& model, const visibility::OpaqueGrid& grid,
                          const sensor::ScannerModel& scanner, const PlanningConfig& config,
                          parallel::Parallel& parallel, const parallel::Cancellation& cancelled) {
  const size_t layer = static_cast<size_t>(size_.x()) * static_cast<size_t>(size_.y());
  why_.assign(layer * static_cast<size_t>(size_.z()),
              static_cast<uint8_t>(Infeasibility::kNoFloor));
  auto floor = FloorMap::Find(model, config.floor_z, cancelled);
  if (!floor.ok()) return false;
  floor_ = *std::move(floor);
  rows_.assign(static_cast<size_t>(size_.y()), {});
  parallel.For(rows_.size(), [&](size_t row) {
    if (cancelled.Requested()) return;
    const int cy = first_.y() + static_cast<int>(row);
    for (int cx = first_.x(); cx < first_.x() + size_.x(); ++cx) {
      rows_[row].begin.push_back(static_cast<uint32_t>(rows_[row].floors.size()));
      FindCellFloors(cx, cy, grid, rows_[row].floors);
    }
    rows_[row].begin.push_back(static_cast<uint32_t>(rows_[row].floors.size()));
    for (int cx = first_.x(); cx < first_.x() + size_.x(); ++cx) JudgeColumn(cx, cy, config);
  });
  if (cancelled.Requested()) return false;
  if (!CarveClearance(grid, scanner.clearance, parallel, cancelled)) return false;
  ExemptStations(model, scanner.clearance);
  auto reach = ReachMap::Find(model, grid, floor_, config, first_.head<2>(), size_.head<2>(),
                              voxels_per_cell_, cancelled);
  if (!reach.ok()) return false;
  reach_ = *std::move(reach);
  return true;
}

// A scanner can stand where one has stood: the little that its blind cone and rays without a return
// leave unknown does not rule the place out.
void FeasibleViews::ExemptStations(const model::PlanningView& model, double clearance) {
  for (const model::Station& station : model.stations()) {
    if (station.clearance < clearance - kSlack) continue;  // it had too little clearance
    const CellIndex cell = CellOf(station.position);
    const Infeasibility why = Why(cell);
    if (why == Infeasibility::kAboveObject || why == Infeasibility::kClearance) {
      why_[Offset(cell)] = static_cast<uint8_t>(Infeasibility::kNone);
    }
  }
}

std::vector<FeasibleViews::CellIndex> FeasibleViews::Unreachable() const {
  std::vector<CellIndex> cells;
  if (counts_[static_cast<size_t>(Infeasibility::kUnreachable)] == 0) return cells;
  const size_t layer = static_cast<size_t>(size_.x()) * static_cast<size_t>(size_.y());
  for (size_t at = 0; at < why_.size(); ++at) {
    if (static_cast<Infeasibility>(why_[at]) != Infeasibility::kUnreachable) continue;
    cells.push_back(first_ +
                    CellIndex(static_cast<int>(at % static_cast<size_t>(size_.x())),
                              static_cast<int>(at % layer / static_cast<size_t>(size_.x())),
                              static_cast<int>(at / layer)));
  }
  return cells;
}

void FeasibleViews::ListFeasible(bool require_reachable) {
  const size_t layer = static_cast<size_t>(size_.x()) * static_cast<size_t>(size_.y());
  index_.assign(why_.size(), -1);
  for (size_t at = 0; at < why_.size(); ++at) {
    auto why = static_cast<Infeasibility>(why_[at]);
    const CellIndex cell =
        first_ + CellIndex(static_cast<int>(at % static_cast<size_t>(size_.x())),
                           static_cast<int>(at % layer / static_cast<size_t>(size_.x())),
                           static_cast<int>(at / layer));
    const Eigen::Vector3d centre = (cell.cast<double>().array() + 0.5) * cell_size_;
    if (why == Infeasibility::kNone && require_reachable && !reach_.Reached(centre)) {
      why = Infeasibility::kUnreachable;
      why_[at] = static_cast<uint8_t>(why);
    }
    ++counts_[static_cast<size_t>(why)];
    if (why != Infeasibility::kNone) continue;
    index_[at] = static_cast<int32_t>(cells_.size());
    cells_.push_back(cell);
  }
}

void FeasibleViews::FindCellFloors(int cx, int cy, const visibility::OpaqueGrid& grid,
                                   std::vector<CellFloor>& floors) const {
  const int n = voxels_per_cell_;
  const FloorColumns& columns = floor_.columns();
  std::vector<const Floor*> under(static_cast<size_t>(n) * static_cast<size_t>(n));
  for (const Floor& first : columns.At(cx * n, cy * n)) {
    // It goes on from column to column of voxels, by a step at most.
    bool whole = true;
    for (size_t i = 0; whole && i < under.size(); ++i) {
      const int x = static_cast<int>(i) % n;
      const int y = static_cast<int>(i) / n;
      const Floor* before = i == 0 ? &first : under[x > 0 ? i - 1 : i - static_cast<size_t>(n)];
      under[i] = columns.Near(cx * n + x, cy * n + y, before->height, kMaxStep);
      whole = under[i] != nullptr;
    }
    if (!whole) continue;
    CellFloor floor{first.height, first.height, std::numeric_limits<int>::max(), true};
    for (size_t i = 0; i < under.size(); ++i) {
      floor.low = std::min(floor.low, under[i]->height);
      floor.high = std::max(floor.high, under[i]->height);
      floor.measured &= under[i]->measured();
      int z = FirstLayerOverFloor(under[i]->height, voxel_);
      while (z < floor.top &&
             grid.Empty({cx * n + static_cast<int>(i) % n, cy * n + static_cast<int>(i) / n, z})) {
        ++z;
      }
      floor.top = std::min(floor.top, z);
    }
    floors.push_back(floor);
  }
}

std::span<const CellFloor> FeasibleViews::CellFloors(int cx, int cy) const {
  const Row& row = rows_[static_cast<size_t>(cy - first_.y())];
  const auto at = static_cast<size_t>(cx - first_.x());
  return std::span<const CellFloor>(row.floors)
      .subspan(row.begin[at], row.begin[at + 1] - row.begin[at]);
}

// The lowest where the cell is lower than all, so that it is too low and not without a floor.
const CellFloor* FeasibleViews::FloorOf(const CellIndex& cell) const {
  const std::span<const CellFloor> floors = CellFloors(cell.x(), cell.y());
  if (floors.empty()) return nullptr;
  const double over = (cell.z() + 1) * cell_size_;
  const CellFloor* below = &floors.front();
  for (const CellFloor& floor : floors) {
    if (static_cast<double>(floor.low) < over) below = &floor;
  }
  return below;
}

// All rules except clearance and reachability, for the cells of one column.
void FeasibleViews::JudgeColumn(int cx, int cy, const PlanningConfig& config) {
  for (int cz = first_.z(); cz < first_.z() + size_.z(); ++cz) {
    const CellFloor* floor = FloorOf({cx, cy, cz});
    if (floor == nullptr) return;  // kNoFloor, as initialised
    why_[Offset({cx, cy, cz})] = static_cast<uint8_t>(JudgeCell({cx, cy, cz}, *floor, config));
  }
}

Infeasibility FeasibleViews::JudgeCell(const CellIndex& index, const CellFloor& floor,
                                       const PlanningConfig& config) const {
  const Eigen::Vector3d corner(index.x() * cell_size_, index.y() * cell_size_,
                               index.z() * cell_size_);
  const Region cell(corner, corner + Eigen::Vector3d::Constant(cell_size_));
  if (cell.min().z() < floor.high + config.min_viewpoint_height - kSlack) {
    return Infeasibility::kTooLow;
  }
  if (cell.max().z() > floor.low + config.max_viewpoint_height + kSlack) {
    return Infeasibility::kTooHigh;
  }
  if ((index.z() + 1) * voxels_per_cell_ > floor.top) return Infeasibility::kAboveObject;
  if (config.region_of_interest.has_value() &&
      ((cell.min().array() < config.region_of_interest->min().array() - kSlack).any() ||
       (cell.max().array() > config.region_of_interest->max().array() + kSlack).any())) {
    return Infeasibility::kOutsideRegion;
  }
  for (const Region& keep_out : config.keep_out) {
    if ((cell.min().array() < keep_out.max().array() - kSlack).all() &&
        (cell.max().array() > keep_out.min().array() + kSlack).all()) {
      return Infeasibility::kKeepOut;
    }
  }
  for (const RejectedPlace& place : config.rejected) {
    const double dx =
        std::max({0.0, cell.min().x() - place.position.x(), place.position.x() - cell.max().x()});
    const double dy =
        std::max({0.0, cell.min().y() - place.position.y(), place.position.y() - cell.max().y()});
    if (dx * dx + dy * dy >= place.radius * place.radius) continue;
    // It was rejected on one storey, if one knows on which.
    const std::optional<int> storey = Storey(place.position + Eigen::Vector3d(0, 0, kOverFloor));
    if (!storey.has_value() || *storey == floor_.storeys().At(static_cast<double>(floor.low))) {
      return Infeasibility::kRejected;
    }
  }
  return Infeasibility::kNone;
}

// A voxel lacks clearance when the gap between its box and that of a non-empty voxel is less than
// the clearance; a cell lacks it when one of its voxels does. The gap is a whole number of voxels
// on each axis, so growing rows of bits by whole voxels is exact.
bool FeasibleViews::CarveClearance(const visibility::OpaqueGrid& grid, double clearance,
                                   parallel::Parallel& parallel,
                                   const parallel::Cancellation& cancelled) {
  const int n = voxels_per_cell_;
  const double limit = clearance / voxel_ - 1e-6;  // voxels
  // Offsets of rows with the number of voxels by which theirs must be grown along x.
  struct Offset2 {
    int dy, dz, grow;
  };
  std::vector<Offset2> offsets;
  int most = 0;
  const int reach = static_cast<int>(std::ceil(limit)) + 1;
  for (int dz = -reach; dz <= reach; ++dz) {
    for (int dy = -reach; dy <= reach; ++dy) {
      const int gy = std::max(0, std::abs(dy) - 1);
      const int gz = std::max(0, std::abs(dz) - 1);
      const double rest = limit * limit - gy * gy - gz * gz;
      if (rest <= 0) continue;
      const int grow = static_cast<int>(std::ceil(std::sqrt(rest)));  // largest gap below, plus 1
      offsets.push_back({dy, dz, grow});
      most = std::max(most, grow);
    }
  }
  // Only layers near cells that are still undecided matter.
  const size_t layer = static_cast<size_t>(size_.x()) * static_cast<size_t>(size_.y());
  std::vector<uint8_t> wanted(static_cast<size_t>(size_.z()), 0);
  for (size_t cz = 0; cz < wanted.size(); ++cz) {
    const auto begin = why_.begin() + static_cast<ptrdiff_t>(cz * layer);
    wanted[cz] = std::any_of(begin, begin + static_cast<ptrdiff_t>(layer),
                             [](uint8_t why) { return why == 0; });
  }
  const model::VoxelBox& box = grid.box();
  const size_t words = grid.words_per_row();
  const size_t rows = static_cast<size_t>(box.max.y() - box.min.y());
  const size_t block = rows * words;  // one layer grown by one amount
  const auto levels = static_cast<size_t>(most) + 1;

  parallel.For(wanted.size(), [&](size_t slot) {
    if (!wanted[slot] || cancelled.Requested()) return;
    const int cz = first_.z() + static_cast<int>(slot);
    std::vector<uint64_t> grown(block * levels);
    std::vector<uint64_t> lacking(block, 0);
    for (int layer_z = cz * n - reach; layer_z < cz * n + n + reach; ++layer_z) {
      if (cancelled.Requested()) return;
      const bool outside = layer_z < box.min.z() || layer_z >= box.max.z();
      if (!outside) {
        for (size_t row = 0; row < rows; ++row) {
          const auto source = grid.Row(box.min.y() + static_cast<int>(row), layer_z);
          std::copy(source.begin(), source.end(),
                    grown.begin() + static_cast<ptrdiff_t>(row * words));
          for (size_t g = 1; g < levels; ++g) {
            Dilate({grown.data() + (g - 1) * block + row * words, words},
                   {grown.data() + g * block + row * words, words});
          }
        }
      }
      // The gap along z is that of the cell's nearest own layer, so one pass over dy is enough for
      // a layer.
      const int own = std::clamp(layer_z, cz * n, cz * n + n - 1);
      for (const Offset2& offset : offsets) {
        if (offset.dz != layer_z - own) continue;
        if (outside) {
          std::fill(lacking.begin(), lacking.end(), ~uint64_t{0});
          break;
        }
        const uint64_t* level = grown.data() + static_cast<size_t>(offset.grow) * block;
        for (size_t row = 0; row < rows; ++row) {
          const int64_t from = static_cast<int64_t>(row) + offset.dy;
          uint64_t* to = lacking.data() + row * words;
          if (from < 0 || from >= static_cast<int64_t>(rows)) {
            std::fill(to, to + words, ~uint64_t{0});
            continue;
          }
          const uint64_t* source = level + static_cast<size_t>(from) * words;
          for (size_t w = 0; w < words; ++w) to[w] |= source[w];
        }
      }
    }
    for (int cy = first_.y(); cy < first_.y() + size_.y(); ++cy) {
      for (int cx = first_.x(); cx < first_.x() + size_.x(); ++cx) {
        uint8_t& why = why_[Offset({cx, cy, cz})];
        if (why != 0) continue;
        for (int y = cy * n; y < cy * n + n; ++y) {
          const size_t row = static_cast<size_t>(y - box.min.y());
          if (AnyBit(lacking.data() + row * words, cx * n - box.min.x(), n)) {
            why = static_cast<uint8_t>(Infeasibility::kClearance);
          }
        }
      }
    }
  });
  return !cancelled.Requested();
}

const Floor* FeasibleViews::FloorUnder(const Eigen::Vector3d& p) const {
  return floor_.columns().Below(static_cast<int>(std::floor(p.x() / voxel_)),
                                static_cast<int>(std::floor(p.y() / voxel_)), p.z());
}

double FeasibleViews::HeightOverFloor(const Eigen::Vector3d& p) const {
  const Floor* floor = FloorUnder(p);
  return floor == nullptr ? std::numeric_limits<double>::quiet_NaN()
                          : p.z() - static_cast<double>(floor->height);
}

std::optional<int> FeasibleViews::Storey(const Eigen::Vector3d& p) const {
  const Floor* floor = FloorUnder(p);
  if (floor == nullptr) return std::nullopt;
  return floor_.storeys().At(static_cast<double>(floor->height));
}

bool FeasibleViews::FloorMeasured(const Eigen::Vector3d& p) const {
  const CellIndex cell = CellOf(p);
  if (!Inside(cell)) return false;
  const CellFloor* floor = FloorOf(cell);
  return floor != nullptr && floor->measured;
}

std::string InfeasibilityWords(Infeasibility why, const sensor::ScannerModel& scanner,
                               const PlanningConfig& config) {
  switch (why) {
    case Infeasibility::kNone:
      return "feasible";
    case Infeasibility::kNoFloor:
      return "no floor is known below it: scan nearer to it, or set floor_z";
    case Infeasibility::kTooLow:
      return absl::StrFormat("lower than min_viewpoint_height, %.2f m over the floor",
                             config.min_viewpoint_height);
    case Infeasibility::kTooHigh:
      return absl::StrFormat("higher than max_viewpoint_height, %.2f m over the floor",
                             config.max_viewpoint_height);
    case Infeasibility::kAboveObject:
      return "something that is not known to be empty lies between it and the floor";
    case Infeasibility::kOutsideRegion:
      return "outside the region of interest";
    case Infeasibility::kKeepOut:
      return "inside a keep-out zone";
    case Infeasibility::kRejected:
      return "a person rejected this place";
    case Infeasibility::kClearance:
      return absl::StrFormat("less than %.2f m of clearance to what is not known to be empty",
                             scanner.clearance);
    case Infeasibility::kUnreachable:
      return absl::StrFormat(
          "no passage %.2f m wide and %.2f m high from where the scanner has stood",
          config.scanner_width, config.scanner_height);
  }
  return "unknown reason";
}

std::string FeasibleViews::Explain(const sensor::ScannerModel& scanner,
                                   const PlanningConfig& config) const {
  if (!cells_.empty()) return absl::StrCat(cells_.size(), " viewcells are feasible");
  if (!floor_.found()) {
    return "no viewcell is feasible: the model shows no floor (upward measured surface under free "
           "space); set floor_z, or scan so that the floor is seen";
  }
  std::string message = "no viewcell is feasible; of the cells at an allowed height over the floor";
  size_t total = 0;
  const char* separator = ": ";
  for (int reason = static_cast<int>(Infeasibility::kAboveObject); reason < kInfeasibilities;
       ++reason) {
    const size_t count = counts_[static_cast<size_t>(reason)];
    total += count;
    if (count == 0) continue;
    absl::StrAppend(&message, separator, count, " - ",
                    InfeasibilityWords(static_cast<Infeasibility>(reason), scanner, config));
    separator = "; ";
  }
  if (total == 0) {
    return absl::StrFormat(
        "no viewcell is feasible: none lies wholly between %.2f m and %.2f m over the floor, which "
        "is at %.2f to %.2f m; widen the height range (it must hold a viewcell of %.2f m)",
        config.min_viewpoint_height, config.max_viewpoint_height, floor_.lowest(), floor_.highest(),
        cell_size_);
  }
  return message;
}

double ClearanceAt(const visibility::OpaqueGrid& grid, double voxel, const Eigen::Vector3d& p,
                   double limit) {
  const Eigen::Vector3d q = p / voxel;
  const model::VoxelIndex at = q.array().floor().cast<int>();
  const int reach = static_cast<int>(std::ceil(limit / voxel));
  double best = limit / voxel;
  best *= best;
  // Cubic shells outwards: shell r cannot hold anything nearer than r - 1 voxels.
  for (int r = 0; r <= reach; ++r) {
    if (r > 1 && static_cast<double>(r - 1) * (r - 1) >= best) break;
    for (int dz = -r; dz <= r; ++dz) {
      for (int dy = -r; dy <= r; ++dy) {
        const bool face = std::abs(dz) == r || std::abs(dy) == r;
        for (int dx = -r; dx <= r; dx += face || r == 0 ? 1 : 2 * r) {
          const model::VoxelIndex v = at + model::VoxelIndex(dx, dy, dz);
          if (grid.Empty(v)) continue;
          double squared = 0;
          for (int a = 0; a < 3; ++a) {
            const double gap = std::max({0.0, v[a] - q[a], q[a] - (v[a] + 1)});
            squared += gap * gap;
          }
          best = std::min(best, squared);
        }
      }
    }
  }
  return std::sqrt(best) * voxel;
}

}  // namespace vantage::planning

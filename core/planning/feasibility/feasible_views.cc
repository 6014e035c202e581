#include "core/planning/feasibility/feasible_views.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
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
  auto floor = FloorMap::Find(model, config.floor_z, cancelled);
  if (!floor.ok()) return absl::CancelledError("feasible views");
  return Find(model, *std::move(floor), grid, scanner, config, parallel, cancelled);
}

absl::StatusOr<FeasibleViews> FeasibleViews::Find(const model::PlanningView& model, FloorMap floor,
                                                  const visibility::OpaqueGrid& grid,
                                                  const sensor::ScannerModel& scanner,
                                                  const PlanningConfig& config,
                                                  parallel::Parallel& parallel,
                                                  const parallel::Cancellation& cancelled) {
  FeasibleViews views;
  views.Cover(model, config);
  if (views.size_.isZero()) return views;
  views.floor_ = std::move(floor);
  if (!views.Judge(model, grid, views.floor_, scanner, config, parallel, cancelled)) {
    return absl::CancelledError("feasible views");
  }
  views.ListFeasible(config.require_reachable);
  return views;
}

absl::StatusOr<FeasibleViews> FeasibleViews::FindExpected(
    const model::PlanningView& standing, const FloorMap& floor, const FloorMap& ways,
    const visibility::OpaqueGrid& grid, const FeasibleViews& known,
    const sensor::ScannerModel& scanner, const PlanningConfig& config, parallel::Parallel& parallel,
    const parallel::Cancellation& cancelled) {
  FeasibleViews views;
  views.Cover(standing, config);
  if (views.size_.isZero()) return views;
  views.floor_ = floor;
  const visibility::OpaqueGrid standing_grid(standing);
  if (!views.Judge(standing, standing_grid, ways, scanner, config, parallel, cancelled)) {
    return absl::CancelledError("feasible views");
  }
  const auto direct =
      ReachMap::Find(standing, standing_grid, floor, config, views.first_.head<2>(),
                     views.size_.head<2>(), views.voxels_per_cell_, parallel, cancelled);
  if (!direct.ok()) return absl::CancelledError("feasible views");
  views.RequireSeen(grid, known);
  views.RequireSound(*direct, known);
  views.ListFeasible(config.require_reachable);
  return views;
}

// The viewcells that the model's bounds are divided into.
void FeasibleViews::Cover(const model::PlanningView& model, const PlanningConfig& config) {
  voxel_ = model.voxel_size();
  voxels_per_cell_ =
      std::max(1, static_cast<int>(std::lround(config.viewcell_size / model.voxel_size())));
  const int n = voxels_per_cell_;
  cell_size_ = n * model.voxel_size();
  min_height_ = config.min_viewpoint_height;
  max_height_ = config.max_viewpoint_height;
  const model::VoxelBox& box = model.bounds();
  if (box.empty()) return;
  for (int a = 0; a < 3; ++a) {
    first_[a] = FloorDiv(box.min[a], n);
    size_[a] = FloorDiv(box.max[a] - 1, n) + 1 - first_[a];
  }
}

// Nothing is seen from a viewcell that is not known to be empty itself.
void FeasibleViews::RequireSeen(const visibility::OpaqueGrid& grid, const FeasibleViews& known) {
  const Eigen::Vector3i cell_voxels = Eigen::Vector3i::Constant(voxels_per_cell_);
  for (size_t r = 0; r < rows_.size(); ++r) {
    Row& row = rows_[r];
    for (size_t i = 0; i + 1 < row.begin.size(); ++i) {
      ForEachCell(row.first + static_cast<int>(i), first_.y() + static_cast<int>(r),
                  [&](const CellIndex& cell, const Place& place) {
                    Infeasibility& why = row.why[place.at];
                    if (known.IndexOf(cell) >= 0) why = Infeasibility::kNone;
                    if (why != Infeasibility::kNone || known.IndexOf(cell) >= 0) return;
                    const Eigen::Vector3i low = cell * voxels_per_cell_ - grid.box().min;
                    if (!grid.AllEmpty(low, low + cell_voxels)) why = Infeasibility::kClearance;
                  });
    }
  }
}

// Who goes over floor that was not seen trusts that there is some, and has to find a good place at
// the end: not one on which what hides the floor may stand, and none beside an edge that hides it.
void FeasibleViews::RequireSound(const ReachMap& direct, const FeasibleViews& known) {
  for (size_t r = 0; r < rows_.size(); ++r) {
    Row& row = rows_[r];
    for (size_t i = 0; i + 1 < row.begin.size(); ++i) {
      const int cx = row.first + static_cast<int>(i);
      for (const CellFloor& floor : CellFloors(cx, first_.y() + static_cast<int>(r))) {
        for (int k = 0; k < floor.cells; ++k) {
          Infeasibility& why = row.why[floor.cell + static_cast<size_t>(k)];
          if (why != Infeasibility::kNone) continue;
          const CellIndex cell(cx, first_.y() + static_cast<int>(r), floor.first_cell + k);
          const Eigen::Vector3d centre = (cell.cast<double>().array() + 0.5) * cell_size_;
          if (direct.Reached(centre) || known.IndexOf(cell) >= 0) continue;
          const bool sound = !floor.between && direct.Fits(centre) &&
                             (floor.expected || known.Why(cell) == Infeasibility::kUnreachable);
          if (!sound) why = Infeasibility::kUnreachable;
        }
      }
    }
  }
}

// Why each cell is not feasible, reachability apart. False when cancelled on the way.
bool FeasibleViews::Judge(const model::PlanningView& model, const visibility::OpaqueGrid& grid,
                          const FloorMap& ways, const sensor::ScannerModel& scanner,
                          const PlanningConfig& config, parallel::Parallel& parallel,
                          const parallel::Cancellation& cancelled) {
  rows_.assign(static_cast<size_t>(size_.y()), {});
  parallel.For(rows_.size(), [&](size_t row) {
    if (cancelled.Requested()) return;
    const int cy = first_.y() + static_cast<int>(row);
    Row& own = rows_[row];
    own.first = first_.x();
    size_t listed = 0;  // up to the last column with floor
    for (int cx = first_.x(); cx < first_.x() + size_.x(); ++cx) {
      const size_t before = own.floors.size();
      FindCellFloors(cx, cy, grid, own.floors);
      if (own.floors.empty()) {
        ++own.first;
        continue;
      }
      own.begin.push_back(static_cast<uint32_t>(before));
      if (own.floors.size() > before) listed = own.begin.size();
    }
    own.begin.resize(listed);
    own.begin.push_back(static_cast<uint32_t>(own.floors.size()));
    own.begin.shrink_to_fit();
    own.floors.shrink_to_fit();
    for (size_t i = 0; i < listed; ++i) JudgeColumn(own.first + static_cast<int>(i), cy, config);
    own.why.shrink_to_fit();
  });
  if (cancelled.Requested()) return false;
  if (!CarveClearance(grid, scanner.clearance, parallel, cancelled)) return false;
  ExemptStations(model, scanner.clearance);
  auto reach = ReachMap::Find(model, grid, ways, config, first_.head<2>(), size_.head<2>(),
                              voxels_per_cell_, parallel, cancelled);
  if (!reach.ok()) return false;
  reach_ = *std::move(reach);
  return true;
}

// A scanner can stand where one has stood: the little that its blind cone and rays without a return
// leave unknown does not rule the place out.
void FeasibleViews::ExemptStations(const model::PlanningView& model, double clearance) {
  for (const model::Station& station : model.stations()) {
    if (station.clearance < clearance - kSlack) continue;  // it had too little clearance
    const std::optional<Place> place = PlaceOf(CellOf(station.position));
    if (!place.has_value()) continue;
    Infeasibility& why = rows_[place->row].why[place->at];
    if (why == Infeasibility::kAboveObject || why == Infeasibility::kClearance) {
      why = Infeasibility::kNone;
    }
  }
}

std::vector<FeasibleViews::CellIndex> FeasibleViews::Unreachable() const {
  std::vector<CellIndex> cells;
  if (counts_[static_cast<size_t>(Infeasibility::kUnreachable)] == 0) return cells;
  for (size_t r = 0; r < rows_.size(); ++r) {
    const Row& row = rows_[r];
    for (size_t i = 0; i + 1 < row.begin.size(); ++i) {
      ForEachCell(row.first + static_cast<int>(i), first_.y() + static_cast<int>(r),
                  [&](const CellIndex& cell, const Place& place) {
                    if (row.why[place.at] == Infeasibility::kUnreachable) cells.push_back(cell);
                  });
    }
  }
  std::sort(cells.begin(), cells.end(), [](const CellIndex& a, const CellIndex& b) {
    return std::tuple(a.z(), a.y(), a.x()) < std::tuple(b.z(), b.y(), b.x());
  });
  return cells;
}

void FeasibleViews::ListFeasible(bool require_reachable) {
  const auto for_each_cell = [this](const auto& fn) {
    for (int cy = first_.y(); cy < first_.y() + size_.y(); ++cy) {
      const Row& row = rows_[static_cast<size_t>(cy - first_.y())];
      for (size_t i = 0; i + 1 < row.begin.size(); ++i) {
        ForEachCell(row.first + static_cast<int>(i), cy, fn);
      }
    }
  };
  std::vector<size_t> next(static_cast<size_t>(size_.z()) + 1, 0);  // by z: where cells begin
  for_each_cell([&](const CellIndex& cell, const Place& place) {
    Infeasibility& why = rows_[place.row].why[place.at];
    const Eigen::Vector3d centre = (cell.cast<double>().array() + 0.5) * cell_size_;
    if (why == Infeasibility::kNone && require_reachable && !reach_.Reached(centre)) {
      why = Infeasibility::kUnreachable;
    }
    ++counts_[static_cast<size_t>(why)];
    if (why == Infeasibility::kNone) ++next[static_cast<size_t>(cell.z() - first_.z()) + 1];
  });
  for (size_t z = 1; z < next.size(); ++z) next[z] += next[z - 1];
  cells_.resize(next.back());
  for (Row& row : rows_) row.index.assign(row.why.size(), -1);
  for_each_cell([&](const CellIndex& cell, const Place& place) {
    if (rows_[place.row].why[place.at] != Infeasibility::kNone) return;
    const size_t at = next[static_cast<size_t>(cell.z() - first_.z())]++;
    rows_[place.row].index[place.at] = static_cast<int32_t>(at);
    cells_[at] = cell;
  });
}

std::optional<FeasibleViews::Place> FeasibleViews::PlaceOf(const CellIndex& cell) const {
  if (!Inside(cell)) return std::nullopt;
  const CellFloor* floor = FloorOf(cell);
  if (floor == nullptr || cell.z() < floor->first_cell ||
      cell.z() >= floor->first_cell + floor->cells) {
    return std::nullopt;
  }
  return Place{static_cast<size_t>(cell.y() - first_.y()),
               floor->cell + static_cast<size_t>(cell.z() - floor->first_cell)};
}

int FeasibleViews::IndexOf(const CellIndex& cell) const {
  const std::optional<Place> place = PlaceOf(cell);
  return place.has_value() ? rows_[place->row].index[place->at] : -1;
}

Infeasibility FeasibleViews::Why(const CellIndex& cell) const {
  if (const std::optional<Place> place = PlaceOf(cell); place.has_value()) {
    return rows_[place->row].why[place->at];
  }
  const CellFloor* floor = Inside(cell) ? FloorOf(cell) : nullptr;
  return floor == nullptr ? Infeasibility::kNoFloor : JudgeHeight(cell.z(), *floor);
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
    CellFloor floor{first.height, first.height, std::numeric_limits<int>::max()};
    for (size_t i = 0; i < under.size(); ++i) {
      floor.low = std::min(floor.low, under[i]->height);
      floor.high = std::max(floor.high, under[i]->height);
      floor.measured &= under[i]->measured();
      floor.expected |= under[i]->source == FloorSource::kExpected;
      floor.between |=
          under[i]->source == FloorSource::kBetween || under[i]->source == FloorSource::kHidden;
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
  const int at = cx - row.first;
  if (at < 0 || at + 1 >= static_cast<int>(row.begin.size())) return {};
  const uint32_t* begin = &row.begin[static_cast<size_t>(at)];
  return std::span<const CellFloor>(row.floors).subspan(begin[0], begin[1] - begin[0]);
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

Infeasibility FeasibleViews::JudgeHeight(int cz, const CellFloor& floor) const {
  const double low = cz * cell_size_;
  if (low < static_cast<double>(floor.high) + min_height_ - kSlack) return Infeasibility::kTooLow;
  if (low + cell_size_ > static_cast<double>(floor.low) + max_height_ + kSlack) {
    return Infeasibility::kTooHigh;
  }
  return Infeasibility::kNone;
}

// All rules except clearance and reachability, for the cells of one column.
void FeasibleViews::JudgeColumn(int cx, int cy, const PlanningConfig& config) {
  Row& row = rows_[static_cast<size_t>(cy - first_.y())];
  for (const CellFloor& above : CellFloors(cx, cy)) {
    CellFloor& floor = row.floors[static_cast<size_t>(&above - row.floors.data())];
    floor.cell = static_cast<uint32_t>(row.why.size());
    // Those at an allowed height follow one another.
    const auto cell_at = [&](double z) { return static_cast<int>(std::floor(z / cell_size_)); };
    const int begin =
        std::max(first_.z(), cell_at(static_cast<double>(floor.high) + min_height_) - 1);
    const int end =
        std::min(first_.z() + size_.z(), cell_at(static_cast<double>(floor.low) + max_height_) + 2);
    for (int cz = begin; cz < end; ++cz) {
      if (JudgeHeight(cz, floor) != Infeasibility::kNone || FloorOf({cx, cy, cz}) != &floor) {
        continue;
      }
      if (floor.cells++ == 0) floor.first_cell = cz;
      row.why.push_back(JudgeCell({cx, cy, cz}, floor, config));
    }
  }
}

// Of a cell at an allowed height.
Infeasibility FeasibleViews::JudgeCell(const CellIndex& index, const CellFloor& floor,
                                       const PlanningConfig& config) const {
  const Eigen::Vector3d corner(index.x() * cell_size_, index.y() * cell_size_,
                               index.z() * cell_size_);
  const Region cell(corner, corner + Eigen::Vector3d::Constant(cell_size_));
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
  // Only what is near cells that are still undecided matters: by z, the columns they are in.
  struct Extent {
    Eigen::Vector2i first = Eigen::Vector2i::Constant(std::numeric_limits<int>::max());
    Eigen::Vector2i last = Eigen::Vector2i::Constant(std::numeric_limits<int>::min());
  };
  std::vector<Extent> undecided(static_cast<size_t>(size_.z()));
  for (const Row& row : rows_) {
    const int cy = first_.y() + static_cast<int>(&row - rows_.data());
    for (size_t i = 0; i + 1 < row.begin.size(); ++i) {
      ForEachCell(row.first + static_cast<int>(i), cy,
                  [&](const CellIndex& cell, const Place& place) {
                    if (row.why[place.at] != Infeasibility::kNone) return;
                    Extent& extent = undecided[static_cast<size_t>(cell.z() - first_.z())];
                    extent.first = extent.first.cwiseMin(cell.head<2>());
                    extent.last = extent.last.cwiseMax(cell.head<2>());
                  });
    }
  }
  const model::VoxelBox& box = grid.box();
  const auto levels = static_cast<size_t>(most) + 1;

  parallel.For(undecided.size(), [&](size_t slot) {
    const Extent& extent = undecided[slot];
    if (extent.first.x() > extent.last.x() || cancelled.Requested()) return;
    const int cz = first_.z() + static_cast<int>(slot);
    // The rows of voxels of these columns and as far around as counts. What is beyond is taken for
    // opaque, which does not reach the columns.
    const int first_y = extent.first.y() * n - reach;
    const int end_y = extent.last.y() * n + n + reach;
    const int first_page = (extent.first.x() * n - reach) >> 6;
    const int first_x = first_page * model::BrickPage::kVoxels;
    const auto words =
        static_cast<size_t>(((extent.last.x() * n + n + reach) >> 6) + 1 - first_page);
    const auto rows = static_cast<size_t>(end_y - first_y);
    const size_t block = rows * words;  // one layer grown by one amount
    std::vector<uint64_t> grown(block * levels);
    std::vector<uint64_t> lacking(block, 0);
    for (int layer_z = cz * n - reach; layer_z < cz * n + n + reach; ++layer_z) {
      if (cancelled.Requested()) return;
      const bool outside = layer_z < box.min.z() || layer_z >= box.max.z();
      if (!outside) {
        grid.Rows(layer_z, first_y, end_y, first_page, words, {grown.data(), block});
        for (size_t row = 0; row < rows; ++row) {
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
    for (int cy = extent.first.y(); cy <= extent.last.y(); ++cy) {
      Row& row = rows_[static_cast<size_t>(cy - first_.y())];
      for (int cx = extent.first.x(); cx <= extent.last.x(); ++cx) {
        for (const CellFloor& floor : CellFloors(cx, cy)) {
          if (cz < floor.first_cell || cz >= floor.first_cell + floor.cells) continue;
          Infeasibility& why = row.why[floor.cell + static_cast<size_t>(cz - floor.first_cell)];
          if (why != Infeasibility::kNone) continue;
          for (int y = cy * n; y < cy * n + n; ++y) {
            const auto at = static_cast<size_t>(y - first_y);
            if (AnyBit(lacking.data() + at * words, cx * n - first_x, n)) {
              why = Infeasibility::kClearance;
            }
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

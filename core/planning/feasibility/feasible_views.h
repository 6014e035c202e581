// Step A: where a scanner can stand (algorithm.md section 7A).
#ifndef VANTAGE_CORE_PLANNING_FEASIBILITY_FEASIBLE_VIEWS_H_
#define VANTAGE_CORE_PLANNING_FEASIBILITY_FEASIBLE_VIEWS_H_

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/parallel/parallel.h"
#include "core/planning/feasibility/floor_map.h"
#include "core/planning/feasibility/reach_map.h"
#include "core/planning/plan/planning_config.h"
#include "core/sensor/scanner_model.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::planning {

// Why a viewcell is not feasible: the first of these that applies, in this order.
enum class Infeasibility : uint8_t {
  kNone = 0,
  kNoFloor,        // no floor is known below it
  kTooLow,         // part of it is lower over the floor than allowed
  kTooHigh,        // part of it is higher over the floor than allowed
  kAboveObject,    // something that is not known to be empty lies between it and the floor
  kOutsideRegion,  // not wholly inside the region of interest
  kKeepOut,        // touches a keep-out box
  kRejected,       // within the radius of a rejected place
  kClearance,      // something that is not known to be empty is nearer than the clearance
  kUnreachable,    // the scanner cannot be carried there from where it has stood
};
inline constexpr int kInfeasibilities = 10;

// A floor under all of a column of viewcells.
struct CellFloor {
  float low = 0;  // m, z
  float high = 0;
  int top = 0;            // the first layer of voxels over it that is not known to be empty
  bool measured = true;   // all of it
  bool expected = false;  // any of it
  bool between = false;   // any of it lies between measured floor
  // The cells that stand on it at an allowed height: z of the lowest, their number, and where the
  // first of them is in its row's.
  int first_cell = 0;
  int cells = 0;
  uint32_t cell = 0;
};

// The smallest viewcells, all of one size. A cell stands on the highest floor below it. A cell is
// feasible when all of it is. The cell of a station whose clearance was at least the scanner's is
// exempt from the rules on clearance and on objects below.
class FeasibleViews {
 public:
  // Cell coordinates: cell c covers [c, c + 1) * cell_size on each axis of the model frame.
  using CellIndex = Eigen::Vector3i;

  // `grid` is the model's. The configuration is valid. CANCELLED when that was requested on the
  // way.
  static absl::StatusOr<FeasibleViews> Find(const model::PlanningView& model,
                                            const visibility::OpaqueGrid& grid,
                                            const sensor::ScannerModel& scanner,
                                            const PlanningConfig& config,
                                            parallel::Parallel& parallel,
                                            const parallel::Cancellation& cancelled = {});
  // The same over the floor of the model, which is found already.
  static absl::StatusOr<FeasibleViews> Find(const model::PlanningView& model, FloorMap floor,
                                            const visibility::OpaqueGrid& grid,
                                            const sensor::ScannerModel& scanner,
                                            const PlanningConfig& config,
                                            parallel::Parallel& parallel,
                                            const parallel::Cancellation& cancelled = {});

  // Where views may stand if unknown space is no obstacle, besides all of `known`, which the model
  // allows. `standing`: the model with unknown space taken for empty; heights and clearance are
  // judged in it over `floor`, ways over `ways`; where one leads over more than `floor`, it leads
  // to places that lack nothing else by what is known, and into rooms that are expected. `grid`: of
  // the model with what is expected; a viewcell has to be empty in it. Else as Find().
  static absl::StatusOr<FeasibleViews> FindExpected(
      const model::PlanningView& standing, const FloorMap& floor, const FloorMap& ways,
      const visibility::OpaqueGrid& grid, const FeasibleViews& known,
      const sensor::ScannerModel& scanner, const PlanningConfig& config,
      parallel::Parallel& parallel, const parallel::Cancellation& cancelled = {});

  double cell_size() const { return cell_size_; }
  const std::vector<CellIndex>& cells() const { return cells_; }  // by z, y, x
  Eigen::Vector3d Centre(size_t i) const {
    return (cells_[i].cast<double>().array() + 0.5) * cell_size_;
  }
  CellIndex CellOf(const Eigen::Vector3d& p) const {
    return (p / cell_size_).array().floor().cast<int>();
  }
  // Position in cells(), or -1.
  int IndexOf(const CellIndex& cell) const;
  Infeasibility Why(const CellIndex& cell) const;

  // Cells that lack nothing but a way there, by z, y, x.
  std::vector<CellIndex> Unreachable() const;

  const FloorMap& floor() const { return floor_; }
  const ReachMap& reach() const { return reach_; }
  // Height over the floor below, m; NaN where there is none.
  double HeightOverFloor(const Eigen::Vector3d& p) const;
  // The storey of the floor below, 0 the lowest; nothing where there is no floor.
  std::optional<int> Storey(const Eigen::Vector3d& p) const;
  // False when any of the floor below the cell of a place was not measured: it lies between
  // measured floor, or was given, or there is none.
  bool FloorMeasured(const Eigen::Vector3d& p) const;

  // Number of cells by reason, among those whose height over the floor is allowed.
  const std::array<size_t, kInfeasibilities>& counts() const { return counts_; }

 private:
  bool Inside(const CellIndex& c) const {
    return ((c - first_).array() >= 0).all() && ((c - first_).array() < size_.array()).all();
  }
  // The floors under a row of columns, and the cells over them: all others have no floor, or are
  // too low or too high, which floors and heights tell.
  struct Row {
    int first = 0;                // the first column that is listed
    std::vector<uint32_t> begin;  // of each column its first floor; one more at the end
    std::vector<CellFloor> floors;
    std::vector<Infeasibility> why;  // of cells at an allowed height
    std::vector<int32_t> index;      // of these, into cells_, -1
  };
  // A cell at an allowed height: its row, and its place there.
  struct Place {
    size_t row;
    size_t at;
  };

  std::span<const CellFloor> CellFloors(int cx, int cy) const;
  // Nothing where a cell has no floor or is too low or too high.
  std::optional<Place> PlaceOf(const CellIndex& cell) const;
  // Calls fn(cell, Place) for the cells at an allowed height in a column.
  template <typename Fn>
  void ForEachCell(int cx, int cy, Fn&& fn) const {
    const auto row = static_cast<size_t>(cy - first_.y());
    for (const CellFloor& floor : CellFloors(cx, cy)) {
      for (int i = 0; i < floor.cells; ++i) {
        fn(CellIndex(cx, cy, floor.first_cell + i),
           Place{row, floor.cell + static_cast<size_t>(i)});
      }
    }
  }
  // Appends the floors under the whole of a column, from the lowest up.
  void FindCellFloors(int cx, int cy, const visibility::OpaqueGrid& grid,
                      std::vector<CellFloor>& floors) const;
  // The floor that a cell stands on; null when there is none under all of it.
  const CellFloor* FloorOf(const CellIndex& cell) const;
  // kTooLow, kTooHigh, or kNone.
  Infeasibility JudgeHeight(int cz, const CellFloor& floor) const;
  void JudgeColumn(int cx, int cy, const PlanningConfig& config);
  Infeasibility JudgeCell(const CellIndex& cell, const CellFloor& floor,
                          const PlanningConfig& config) const;
  // What Below() of columns of voxels finds under a place; null outside.
  const Floor* FloorUnder(const Eigen::Vector3d& p) const;
  void Cover(const model::PlanningView& model, const PlanningConfig& config);
  void RequireSeen(const visibility::OpaqueGrid& grid, const FeasibleViews& known);
  // `direct`: what can be reached over this map's own floor.
  void RequireSound(const ReachMap& direct, const FeasibleViews& known);
  // The floor is known. `ways`: the floor that may be walked over.
  bool Judge(const model::PlanningView& model, const visibility::OpaqueGrid& grid,
             const FloorMap& ways, const sensor::ScannerModel& scanner,
             const PlanningConfig& config, parallel::Parallel& parallel,
             const parallel::Cancellation& cancelled);
  bool CarveClearance(const visibility::OpaqueGrid& grid, double clearance,
                      parallel::Parallel& parallel, const parallel::Cancellation& cancelled);
  void ExemptStations(const model::PlanningView& model, double clearance);
  void ListFeasible(bool require_reachable);

  double voxel_ = 0;         // m
  int voxels_per_cell_ = 1;  // along an edge
  double cell_size_ = 0;     // m
  CellIndex first_ = CellIndex::Zero();
  CellIndex size_ = CellIndex::Zero();
  double min_height_ = 0;  // m, of a cell over its floor
  double max_height_ = 0;
  std::vector<CellIndex> cells_;
  std::array<size_t, kInfeasibilities> counts_{};
  FloorMap floor_;
  std::vector<Row> rows_;  // by y
  ReachMap reach_;
};

// In words for a person: why a single cell is refused.
std::string InfeasibilityWords(Infeasibility why, const sensor::ScannerModel& scanner,
                               const PlanningConfig& config);

// Distance from `p` to the nearest voxel that is not empty, m, at most `limit`.
double ClearanceAt(const visibility::OpaqueGrid& grid, double voxel, const Eigen::Vector3d& p,
                   double limit);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_FEASIBILITY_FEASIBLE_VIEWS_H_

// What views have in sight, found once for those that lie close together.
#ifndef VANTAGE_CORE_PLANNING_NEIGHBOURHOODS_H_
#define VANTAGE_CORE_PLANNING_NEIGHBOURHOODS_H_

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/brute_force.h"
#include "core/planning/constraints.h"
#include "core/planning/feasible_views.h"
#include "core/planning/in_sight.h"
#include "core/planning/opaque_grid.h"

namespace vantage {

// References are kept.
class Neighbourhoods {
 public:
  // `cells` and `grid` as InSight wants them.
  Neighbourhoods(const BruteForceScorer& scorer, const FeasibleViews& views,
                 const CellArrays& cells, const OpaqueGrid& grid);

  // To be told before `which` are scored on `drawn` cells each. Where that and what was scored
  // before come to more than it takes, what is in sight is found out. With a budget that doesn't
  // expire that does not depend on the number of threads.
  void Prepare(std::span<const uint32_t> which, size_t drawn, const Budget& budget,
               Parallel& parallel);

  // All cells but those that are hidden from the view; null: not found out.
  const std::vector<PacketRange>* InSightOf(uint32_t view) const;

 private:
  using Key = std::array<int, 3>;
  struct Neighbourhood {
    uint64_t scored = 0;  // pairs of view and cell
    std::optional<std::vector<PacketRange>> in_sight;
  };
  Key KeyOf(uint32_t view) const;
  Eigen::AlignedBox3d BoxOf(const Key& key) const;

  const BruteForceScorer& scorer_;
  const FeasibleViews& views_;
  const uint64_t worth_looking_;  // pairs
  const int side_;                // viewcells
  const InSight in_sight_;
  absl::flat_hash_map<Key, Neighbourhood> neighbourhoods_;
};

}  // namespace vantage

#endif  // VANTAGE_CORE_PLANNING_NEIGHBOURHOODS_H_

// Wide places of a plan and the narrow ones between them: the watershed of the distance to the
// nearest wall (Meyer 1994; of rooms: Bormann et al. 2016).
#ifndef VANTAGE_CORE_PLANNING_OPENINGS_BASINS_H_
#define VANTAGE_CORE_PLANNING_OPENINGS_BASINS_H_

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/parallel/cancellation.h"

namespace vantage::planning {

// By how much both sides of a narrow place are wider than it, at least. The floor before a doorway
// is, even in a corridor no wider than the doorway: the jambs recede.
inline constexpr double kWidening = 1.25;

// A narrow place between two basins.
struct NarrowPlace {
  uint32_t cell = 0;  // its widest
  int basin = 0;      // the lower number of the two
  int other = 0;
};

struct Basins {
  std::vector<int> of;               // by cell; -1 where it is not free
  int count = 0;                     // numbered by their widest cells, from the widest down
  std::vector<NarrowPlace> narrows;  // the widest first
};

// `squared`: of the distance to the nearest wall, by cell. Cells hang together by their faces and
// corners. Nothing when cancelled on the way.
std::optional<Basins> FindBasins(const Eigen::Vector2i& size, const std::vector<uint8_t>& free,
                                 const std::vector<int32_t>& squared,
                                 const parallel::Cancellation& cancelled = {});

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_OPENINGS_BASINS_H_

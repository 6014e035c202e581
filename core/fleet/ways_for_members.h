// What lies behind ways that are too narrow for the scanners of a fleet (algorithm.md section 11,
// 'Narrow ways').
#ifndef VANTAGE_CORE_FLEET_WAYS_FOR_MEMBERS_H_
#define VANTAGE_CORE_FLEET_WAYS_FOR_MEMBERS_H_

#include <cstdint>
#include <span>
#include <vector>

#include "core/fleet/joint_choice.h"
#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/plan/narrow_way.h"
#include "core/planning/scoring/constraints.h"

namespace vantage::fleet {

// planning::FindNarrowWays() for scanners of all classes, the largest gain first: each way once, as
// the scanner would find it that gains most behind it, and only places to which some member's reach
// extends. `left`: the cells that claims leave. `best` (m2) and `done` (rays) as there.
std::vector<planning::NarrowWay> WaysForMembers(std::span<const ScannerClass> classes,
                                                std::span<const ClassedMember> members,
                                                const planning::CellArrays& left, double best,
                                                uint64_t done, const parallel::Budget& budget,
                                                parallel::Parallel& parallel);

}  // namespace vantage::fleet

#endif  // VANTAGE_CORE_FLEET_WAYS_FOR_MEMBERS_H_

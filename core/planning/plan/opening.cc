#include "core/planning/plan/opening.h"

#include <set>

namespace vantage::planning {
namespace {

// Less false surface than somebody could get through is a shred, m^2: half a metre wide and a metre
// high. Space that ends in less is known.
constexpr double kLeastFrontier = 0.5;

// True of what surely divides rooms, and not parts of one.
bool IsDoor(const Opening& opening) {
  return opening.doorway() && opening.lintel && opening.head <= kHighestDoor;
}

}  // namespace

bool Openings::LeadsToUnknown(const Opening& opening) const {
  const Space& space = Behind(opening);
  return !space.entered && space.frontier_area >= kLeastFrontier;
}

int Openings::RoomsNotEntered() const {
  std::set<int> rooms;
  bool glimpsed = false;
  for (const Opening& opening : openings) {
    if (!IsDoor(opening) || !LeadsToUnknown(opening)) continue;
    if (opening.glimpsed) {
      glimpsed = true;
    } else {
      rooms.insert(opening.behind);
    }
  }
  return rooms.empty() && glimpsed ? 1 : static_cast<int>(rooms.size());
}

}  // namespace vantage::planning

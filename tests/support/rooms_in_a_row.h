// Rooms in a row, given as formulas, behind doorways that may be too narrow for a scanner.
#ifndef VANTAGE_TESTS_SUPPORT_ROOMS_IN_A_ROW_H_
#define VANTAGE_TESTS_SUPPORT_ROOMS_IN_A_ROW_H_

#include "tests/support/closed_form_view.h"

namespace vantage::test_support {

// m: how long each room is along x, and how thick the walls between them.
inline constexpr double kRoomInARow = 3.0;
inline constexpr double kWallInARow = 0.2;

// Three rooms of 3 x 3 m with a corner at the origin, behind each other along x; the doorways
// between them are so wide (m) and lie at y = 1.5. A station in the first, whose surface is at
// density; the others are known and lack it.
ClosedFormScene RoomsInARow(double first_door, double second_door);

}  // namespace vantage::test_support

#endif  // VANTAGE_TESTS_SUPPORT_ROOMS_IN_A_ROW_H_

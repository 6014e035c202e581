// Readers that go wrong in every way that is known, and programs that are executed for tests of
// what surrounds them. Only this test has them.
#ifndef VANTAGE_TESTS_CORE_CONFINEMENT_HIDDEN_READERS_H_
#define VANTAGE_TESTS_CORE_CONFINEMENT_HIDDEN_READERS_H_

#include <string>

namespace vantage::confinement {

// One reader does whatever its question says: "echo", "crash", "socket", ...
inline constexpr char kHiddenReader[] = "hidden";

// The first argument of this program, executed as somebody who starts a reader.
// Starts one that computes without end, prints its process, and waits to be killed.
inline constexpr char kHold[] = "--hold";
// "--without CALL": takes a system call away from itself, asks one, and prints the answer or the
// error.
inline constexpr char kWithout[] = "--without";

}  // namespace vantage::confinement

#endif  // VANTAGE_TESTS_CORE_CONFINEMENT_HIDDEN_READERS_H_

// What a confined reader may take of the machine.
#ifndef VANTAGE_CORE_CONFINEMENT_ALLOWANCE_H_
#define VANTAGE_CORE_CONFINEMENT_ALLOWANCE_H_

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

namespace vantage::confinement {

struct Allowance {
  uint64_t memory_bytes = 0;   // address space beside that of the program as it starts
  double seconds = 0;          // of a processor, from its start on; and twice as many by the clock
  double stall_seconds = 60;   // by the clock, without a word and without use of a processor
  std::string memory_option;   // what raises them, for errors: an option of the command line
  std::string seconds_option;  // or a key of the configuration
  // Asked at least ten times a second, on the thread that waits: true ends the reader (CANCELLED).
  std::function<bool()> given_up;  // may be null
};

// What somebody allows in place of what follows from the file.
struct AllowanceSettings {
  std::optional<double> memory_mb;  // 1e6 bytes
  std::optional<double> seconds;
  // Of what follows from the file no more than this, where the machine has more.
  std::optional<uint64_t> most_memory_bytes;
  std::function<bool()> given_up;  // as Allowance::given_up
  std::string memory_option = "--reader-memory";
  std::string seconds_option = "--reader-seconds";
};

// For a file of `file_bytes`, whose reader needs at most `memory_bytes`: that, but no more than the
// machine has, and a minute and two seconds for each megabyte: the slowest reader, of loose points,
// took a third of a second.
Allowance AllowanceOf(uint64_t file_bytes, uint64_t memory_bytes,
                      const AllowanceSettings& settings);

}  // namespace vantage::confinement

#endif  // VANTAGE_CORE_CONFINEMENT_ALLOWANCE_H_

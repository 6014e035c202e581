#include "core/confinement/allowance.h"

#include <unistd.h>

#include <algorithm>

namespace vantage::confinement {
namespace {

constexpr double kLeastSeconds = 60;
constexpr double kSecondsOfByte = 2e-6;

uint64_t MachineBytes() {
  const long pages = sysconf(_SC_PHYS_PAGES);
  const long page = sysconf(_SC_PAGESIZE);
  if (pages <= 0 || page <= 0) return ~uint64_t{0};
  return static_cast<uint64_t>(pages) * static_cast<uint64_t>(page);
}

}  // namespace

Allowance AllowanceOf(uint64_t file_bytes, uint64_t memory_bytes,
                      const AllowanceSettings& settings) {
  Allowance allowance;
  allowance.memory_bytes = settings.memory_mb
                               ? static_cast<uint64_t>(*settings.memory_mb * 1e6)
                               : std::min({memory_bytes, MachineBytes(),
                                           settings.most_memory_bytes.value_or(~uint64_t{0})});
  allowance.seconds =
      settings.seconds.value_or(kLeastSeconds + kSecondsOfByte * static_cast<double>(file_bytes));
  allowance.stall_seconds = std::min(allowance.stall_seconds, 2 * allowance.seconds);
  allowance.memory_option = settings.memory_option;
  allowance.seconds_option = settings.seconds_option;
  allowance.given_up = settings.given_up;
  return allowance;
}

}  // namespace vantage::confinement

#include "tests/support/resident_memory.h"

#include <malloc.h>

#include <algorithm>
#include <fstream>
#include <string>

#include "tests/support/runs.h"

namespace vantage::test_support {
namespace {

// A line of /proc/self/status in MB (1e6 bytes); it counts in units of 1,024 bytes.
double StatusMegabytes(const std::string& name) {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    double value = 0;
    if (word == name + ":" && status >> value) return value * 1024 / 1e6;
  }
  return 0;
}

}  // namespace

double ResidentMegabytes() {
  malloc_trim(0);
  return StatusMegabytes("VmRSS");
}

bool ResetPeak() {
#ifdef VANTAGE_SANITIZED
  return false;
#endif
  malloc_trim(0);
  std::ofstream reset("/proc/self/clear_refs");
  return static_cast<bool>(reset << "5" << std::flush);
}

double PeakMegabytes() { return StatusMegabytes("VmHWM"); }

double TransientMegabytes(const std::function<void()>& call) {
  if (!ResetPeak()) return 0;
  call();
  const double peak = PeakMegabytes();
  return std::max(0.0, peak - ResidentMegabytes());
}

}  // namespace vantage::test_support

#include "tests/bench/resident_memory.h"

#include <malloc.h>

#include <algorithm>
#include <fstream>
#include <string>

namespace vantage::bench {
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

double TransientMegabytes(const std::function<void()>& call) {
  malloc_trim(0);
  std::ofstream reset("/proc/self/clear_refs");
  if (!(reset << "5" << std::flush)) return 0;  // sets the peak to what is in memory now
  call();
  const double peak = StatusMegabytes("VmHWM");
  return std::max(0.0, peak - ResidentMegabytes());
}

}  // namespace vantage::bench

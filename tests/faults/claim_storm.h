// Many clients claim, renew, release, plan and push at random on one job over a link that breaks,
// while others read its log and check it.
#ifndef VANTAGE_TESTS_FAULTS_CLAIM_STORM_H_
#define VANTAGE_TESTS_FAULTS_CLAIM_STORM_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/faults/claim_log.h"

namespace vantage::faults {

struct ClaimStorm {
  std::string server;   // host:port
  double seconds = 60;  // until the clients stop; the claims that they leave then expire
  int clients = 8;
  double pause = 0.4;  // s between two things that a client does, on average
  uint64_t seed = 1;
  int breaks = 0;  // of the link, spread over the time
};

struct ClaimStormResult {
  ClaimLogCounts counts;
  size_t calls = 0;
  size_t refused = 0;  // claims that another scanner held
  size_t pushed = 0;   // scans
  size_t planned = 0;
  size_t unknown = 0;               // calls whose answer was lost for good
  int breaks = 0;                   // of the link, that happened
  int watches = 0;                  // streams of the listener that comes and goes
  std::vector<std::string> broken;  // in words; empty: nothing
};

ClaimStormResult RunClaimStorm(const ClaimStorm& storm);

}  // namespace vantage::faults

#endif  // VANTAGE_TESTS_FAULTS_CLAIM_STORM_H_

// How fast something long goes, and when it will be done.
#ifndef VANTAGE_CLIENT_CLI_PACE_H_
#define VANTAGE_CLIENT_CLI_PACE_H_

#include <chrono>
#include <deque>
#include <string>

namespace vantage::cli {

// Of bytes that are read or sent. The pace is that of the last seconds, so that a link that became
// slow shows at once. What is done twice, from the beginning, is begun anew.
class Pace {
 public:
  using Clock = std::chrono::steady_clock;

  // '210.0 MB of 495.0 MB', and once there is something to go by ', 110.0 MB/s, 3 s left'.
  // A total of 0 is not known.
  std::string Of(double done, double total, Clock::time_point now = Clock::now());

 private:
  struct Reached {
    Clock::time_point when;
    double done = 0;
  };
  std::deque<Reached> reached_;
};

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_PACE_H_

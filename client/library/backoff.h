// How long to wait before trying again.
#ifndef VANTAGE_CLIENT_LIBRARY_BACKOFF_H_
#define VANTAGE_CLIENT_LIBRARY_BACKOFF_H_

#include <algorithm>
#include <optional>
#include <random>

namespace vantage::client {

// Doubles from 0.2 s to 10 s, spread by a quarter either way so that many clients do not come back
// at the same moment.
class Backoff {
 public:
  explicit Backoff(uint64_t seed) : random_(seed) {}

  // Seconds to wait now; at least what the server asked for.
  double Next(std::optional<double> asked = std::nullopt) {
    std::uniform_real_distribution<double> spread(0.75, 1.25);
    const double wait = std::max(current_ * spread(random_), asked.value_or(0));
    current_ = std::min(2 * current_, 10.0);
    return wait;
  }
  // Notes a success: the next wait is the shortest again.
  void Reset() { current_ = 0.2; }

 private:
  double current_ = 0.2;
  std::mt19937_64 random_;
};

}  // namespace vantage::client

#endif  // VANTAGE_CLIENT_LIBRARY_BACKOFF_H_

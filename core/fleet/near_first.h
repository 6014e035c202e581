// Which views are judged before others where the best are refused (algorithm.md section 11, 'Joint
// planning').
#ifndef VANTAGE_CORE_FLEET_NEAR_FIRST_H_
#define VANTAGE_CORE_FLEET_NEAR_FIRST_H_

#include <cstddef>
#include <limits>
#include <vector>

namespace vantage::fleet {

// What gains most often lies too far from all stations for a scan to be aligned. Where a dozen
// views were refused and none registers, those are judged that lie half as far from the nearest
// station as most of the refused ones; half of that after another dozen, and so on, until one
// registers. It is taken unless one of a dozen up to twice as far is better. Where none registers
// near a station either, the rest is judged, the best first.
class NearFirst {
 public:
  // `least`: no nearer than this, m.
  explicit NearFirst(double least) : least_(least) {}

  // Forgets all refusals: another round begins.
  void Restart() { *this = NearFirst(least_); }

  // Views nearer than this to a station are judged, m.
  double within() const { return within_; }
  bool all() const { return within_ == kAll; }

  // A view so far from the nearest station (m) does not register.
  void Refused(double away);
  // A view registers. True when it is to be taken; false when others are judged before: within()
  // has changed.
  bool Take();
  // Whether other views are to be judged now: within() has changed. `none_left`: all of those
  // within it were judged.
  bool Change(bool none_left);

 private:
  static constexpr double kAll = std::numeric_limits<double>::infinity();

  double Median();

  double least_;
  double within_ = kAll;
  std::vector<double> refused_;  // m, from a station
  size_t dozen_ = 0;             // of those, since within_ changed
  bool found_ = false;           // one that registers, nearer than half of within_
  bool over_ = false;            // something was taken, or nothing is to be had nearer
};

}  // namespace vantage::fleet

#endif  // VANTAGE_CORE_FLEET_NEAR_FIRST_H_

// Finds the cell of a range image that an angle falls into.
#ifndef VANTAGE_CORE_MODEL_SCAN_ANGULAR_AXIS_H_
#define VANTAGE_CORE_MODEL_SCAN_ANGULAR_AXIS_H_

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace vantage::model {

// One axis of a range image: strictly rising angles, evenly spaced or not, closed (the last is
// followed by the first, 2 pi on) or open.
class AngularAxis {
 public:
  struct Position {
    int lower = 0;        // the last entry at or before the angle
    int upper = 0;        // the entry after it (wraps where the axis is closed)
    float fraction = 0;   // of the way from lower to upper, [0, 1]
    bool inside = false;  // within half a step of the axis; else the rest means nothing
    int nearest() const { return fraction < 0.5f ? lower : upper; }
  };

  AngularAxis() = default;
  AngularAxis(std::vector<double> angles, bool closed);

  int size() const { return static_cast<int>(angles_.size()); }
  bool closed() const { return closed_; }
  const std::vector<double>& angles() const { return angles_; }
  double first() const { return angles_.front(); }
  double last() const { return angles_.back(); }
  // Largest distance between neighbouring entries, rad.
  double widest_step() const { return widest_step_; }
  // Mean distance between them, rad.
  double mean_step() const { return mean_step_; }

  Position Locate(double angle) const { return even_ ? LocateEven(angle) : LocateAny(angle); }

  // The entries that angles in [low, high] can read, neighbours for interpolation included, as one
  // or two inclusive ranges of indices (two where a closed axis wraps). None when wholly outside.
  struct Span {
    int count = 0;
    int first[2] = {0, 0};
    int last[2] = {0, 0};
    bool cut = false;  // part of [low, high] lies outside the axis
  };
  Span Cover(double low, double high) const;

 private:
  Position LocateEven(double angle) const;
  Position LocateAny(double angle) const;
  double Wrapped(double angle) const;  // into [first, first + 2 pi)
  int LowerIndex(double angle) const;  // for first <= angle

  std::vector<double> angles_;
  bool closed_ = false;
  bool even_ = false;         // all steps equal: most scanners', and ten times faster to look up
  double steps_per_rad_ = 0;  // of an even axis
  double widest_step_ = 0;
  double mean_step_ = 0;
  double lower_limit_ = 0;  // of an open axis: half a step outside its ends
  double upper_limit_ = 0;
  double buckets_per_rad_ = 0;
  std::vector<int32_t> bucket_;  // the lower index at the start of each bucket
};

inline AngularAxis::Position AngularAxis::LocateEven(double angle) const {
  Position at;
  const int entries = size();
  double steps = (angle - first()) * steps_per_rad_;
  if (closed_) {
    if (steps < 0) steps += entries;
    if (steps >= entries) steps -= entries;
    if (!(steps >= 0 && steps < entries)) return LocateAny(angle);  // turns away, or rounded up
    at.inside = true;
    at.lower = static_cast<int>(steps);
    at.upper = at.lower + 1 == entries ? 0 : at.lower + 1;
  } else {
    at.inside = steps >= -0.5 && steps <= entries - 0.5;
    if (!at.inside) return at;
    steps = std::clamp<double>(steps, 0, entries - 1);
    at.lower = static_cast<int>(steps);
    at.upper = std::min(at.lower + 1, entries - 1);
  }
  at.fraction = static_cast<float>(steps - at.lower);
  return at;
}

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_SCAN_ANGULAR_AXIS_H_

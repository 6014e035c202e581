// Finds the cell of a range image that an angle falls into.
#ifndef VANTAGE_CORE_MODEL_ANGULAR_AXIS_H_
#define VANTAGE_CORE_MODEL_ANGULAR_AXIS_H_

#include <cstdint>
#include <vector>

namespace vantage {

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
  double first() const { return angles_.front(); }
  double last() const { return angles_.back(); }
  // Largest distance between neighbouring entries, rad.
  double widest_step() const { return widest_step_; }

  Position Locate(double angle) const;

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
  double Wrapped(double angle) const;  // into [first, first + 2 pi)
  int LowerIndex(double angle) const;  // for first <= angle

  std::vector<double> angles_;
  bool closed_ = false;
  double widest_step_ = 0;
  double lower_limit_ = 0;  // of an open axis: half a step outside its ends
  double upper_limit_ = 0;
  double buckets_per_rad_ = 0;
  std::vector<int32_t> bucket_;  // the lower index at the start of each bucket
};

}  // namespace vantage

#endif  // VANTAGE_CORE_MODEL_ANGULAR_AXIS_H_

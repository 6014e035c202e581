#include "core/planning/plan/required_region.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "absl/strings/str_format.h"

namespace vantage::planning {
namespace {

using Eigen::Vector2d;

// m^2. Outlines whose corners are rounded to 0.1 mm overlap by less along ten metres of a wall.
constexpr double kTouching = 1e-3;
// m; heights that are rounded to 0.1 mm.
constexpr double kSameHeight = 1e-4;

double Cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// The sides of an outline: from corner i to the one behind it.
std::pair<const Vector2d&, const Vector2d&> Side(const std::vector<Vector2d>& outline, size_t i) {
  return {outline[i], outline[(i + 1) % outline.size()]};
}

double AreaOf(const std::vector<Vector2d>& outline) {
  double twice = 0;
  for (size_t i = 0; i < outline.size(); ++i) {
    const auto [from, to] = Side(outline, i);
    twice += Cross(from - outline[0], to - outline[0]);
  }
  return std::abs(twice) / 2;
}

// True where two sides have a point in common.
bool Meet(const Vector2d& a, const Vector2d& b, const Vector2d& c, const Vector2d& d) {
  const auto side = [](const Vector2d& p, const Vector2d& q, const Vector2d& r) {
    const double cross = Cross(q - p, r - p);
    return cross > 0 ? 1 : cross < 0 ? -1 : 0;
  };
  const auto within = [](const Vector2d& p, const Vector2d& q, const Vector2d& r) {
    return (r.array() >= p.array().min(q.array())).all() &&
           (r.array() <= p.array().max(q.array())).all();
  };
  const int c_side = side(a, b, c);
  const int d_side = side(a, b, d);
  const int a_side = side(c, d, a);
  const int b_side = side(c, d, b);
  if (c_side * d_side < 0 && a_side * b_side < 0) return true;
  return (c_side == 0 && within(a, b, c)) || (d_side == 0 && within(a, b, d)) ||
         (a_side == 0 && within(c, d, a)) || (b_side == 0 && within(c, d, b));
}

// x where a side crosses a height y that lies between its ends.
double CrossingAt(const Vector2d& from, const Vector2d& to, double y) {
  return from.x() + (to.x() - from.x()) * ((y - from.y()) / (to.y() - from.y()));
}

// Where an outline crosses a line of one y, ascending: it is inside from the first crossing to the
// second, and so on.
std::vector<double> Crossings(const std::vector<Vector2d>& outline, double y) {
  std::vector<double> crossings;
  for (size_t i = 0; i < outline.size(); ++i) {
    const auto [from, to] = Side(outline, i);
    if ((from.y() <= y) != (to.y() <= y)) crossings.push_back(CrossingAt(from, to, y));
  }
  std::sort(crossings.begin(), crossings.end());
  return crossings;
}

// Length that two sets of intervals, as Crossings() has them, have in common.
double CommonLength(const std::vector<double>& a, const std::vector<double>& b) {
  double length = 0;
  for (size_t i = 0; i + 1 < a.size(); i += 2) {
    for (size_t j = 0; j + 1 < b.size(); j += 2) {
      length += std::max(0.0, std::min(a[i + 1], b[j + 1]) - std::max(a[i], b[j]));
    }
  }
  return length;
}

}  // namespace

bool RequiredRegion::Contains(const Eigen::Vector3d& p) const {
  if (!(p.z() >= min_z && p.z() < max_z)) return false;
  // Half-open at each crossing, so that regions that share a side share no point.
  bool inside = false;
  for (size_t i = 0; i < outline.size(); ++i) {
    const auto [from, to] = Side(outline, i);
    if ((from.y() <= p.y()) == (to.y() <= p.y())) continue;
    // Both regions at a side compute with it in the same sense, to the bit.
    const bool up = from.y() < to.y();
    if (p.x() < CrossingAt(up ? from : to, up ? to : from, p.y())) inside = !inside;
  }
  return inside;
}

std::string OutlineFault(const std::vector<Vector2d>& outline) {
  if (outline.size() < 3) {
    return absl::StrFormat("has %d corners, must have three at least", outline.size());
  }
  for (size_t i = 0; i < outline.size(); ++i) {
    if (!outline[i].allFinite()) return absl::StrFormat("has a corner %d that is not finite", i);
  }
  for (size_t i = 0; i < outline.size(); ++i) {
    const auto [a, b] = Side(outline, i);
    if (a == b) return absl::StrFormat("has corner %d twice", i);
    for (size_t j = i + 1; j < outline.size(); ++j) {
      const auto [c, d] = Side(outline, j);
      const bool next = j == i + 1;
      const bool before = i == 0 && j + 1 == outline.size();
      if (next || before) {
        // Sides that follow each other share a corner, and must not turn back.
        const Vector2d& shared = next ? b : a;
        const Vector2d to_first = (next ? a : b) - shared;
        const Vector2d to_second = (next ? d : c) - shared;
        if (Cross(to_first, to_second) == 0 && to_first.dot(to_second) > 0) {
          return absl::StrFormat("turns back at corner %d", next ? j : i);
        }
      } else if (Meet(a, b, c, d)) {
        return absl::StrFormat("crosses itself: sides %d and %d meet", i, j);
      }
    }
  }
  const double area = AreaOf(outline);
  if (!(area > kTouching)) {
    return absl::StrFormat("has an area of %g m2, must have more than %g", area, kTouching);
  }
  return "";
}

double CommonArea(const std::vector<Vector2d>& a, const std::vector<Vector2d>& b) {
  // Between two heights at which a corner lies or sides of both cross, the common length changes
  // linearly: its middle counts for all of it.
  std::vector<double> heights;
  for (const auto* outline : {&a, &b}) {
    for (const Vector2d& corner : *outline) heights.push_back(corner.y());
  }
  for (size_t i = 0; i < a.size(); ++i) {
    const auto [p, q] = Side(a, i);
    for (size_t j = 0; j < b.size(); ++j) {
      const auto [r, s] = Side(b, j);
      const double turn = Cross(q - p, s - r);
      if (turn == 0) continue;
      const double along = Cross(r - p, s - r) / turn;
      if (along > 0 && along < 1) heights.push_back(p.y() + along * (q.y() - p.y()));
    }
  }
  std::sort(heights.begin(), heights.end());
  double area = 0;
  for (size_t k = 0; k + 1 < heights.size(); ++k) {
    const double middle = (heights[k] + heights[k + 1]) / 2;
    area +=
        (heights[k + 1] - heights[k]) * CommonLength(Crossings(a, middle), Crossings(b, middle));
  }
  return area;
}

bool Overlap(const RequiredRegion& a, const RequiredRegion& b) {
  const double high = std::min(a.max_z, b.max_z);
  const double low = std::max(a.min_z, b.min_z);
  return high - low > kSameHeight && CommonArea(a.outline, b.outline) > kTouching;
}

}  // namespace vantage::planning

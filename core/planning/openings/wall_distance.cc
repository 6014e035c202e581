#include "core/planning/openings/wall_distance.h"

#include <algorithm>
#include <cstddef>

namespace vantage::planning {
namespace {

// The lower envelope of the parabolas (x - i)^2 + line[i], at whole numbers; kNoWall stands for no
// parabola.
class LowerEnvelope {
 public:
  explicit LowerEnvelope(size_t longest) : at_(longest), from_(longest) {}

  void Take(std::vector<int32_t>& line) {
    size_t count = 0;
    for (size_t i = 0; i < line.size(); ++i) {
      if (line[i] == kNoWall) continue;
      while (count > 0 && Crossing(line, at_[count - 1], i) <= from_[count - 1]) --count;
      from_[count] = count == 0 ? 0 : Crossing(line, at_[count - 1], i);
      at_[count++] = i;
    }
    if (count == 0) return;
    const std::vector<int32_t> height = line;
    size_t k = 0;
    for (size_t x = 0; x < line.size(); ++x) {
      while (k + 1 < count && from_[k + 1] <= static_cast<int64_t>(x)) ++k;
      const int64_t away = static_cast<int64_t>(x) - static_cast<int64_t>(at_[k]);
      line[x] = static_cast<int32_t>(away * away) + height[at_[k]];
    }
  }

 private:
  // The first whole number from which on the parabola of j > i is not above that of i.
  static int64_t Crossing(const std::vector<int32_t>& line, size_t i, size_t j) {
    const auto a = static_cast<int64_t>(i);
    const auto b = static_cast<int64_t>(j);
    const int64_t over = line[j] + b * b - line[i] - a * a;
    const int64_t twice = 2 * (b - a);
    return over >= 0 ? (over + twice - 1) / twice : -(-over / twice);
  }
  std::vector<size_t> at_;
  std::vector<int64_t> from_;
};

}  // namespace

std::vector<int32_t> SquaredWallDistance(const Eigen::Vector2i& size,
                                         const std::vector<uint8_t>& solid) {
  std::vector<int32_t> squared(solid.size(), kNoWall);
  const auto columns = static_cast<size_t>(size.x());
  const auto rows = static_cast<size_t>(size.y());
  LowerEnvelope envelope(std::max(columns, rows));
  std::vector<int32_t> line;
  for (size_t y = 0; y < rows; ++y) {
    line.assign(columns, kNoWall);
    for (size_t x = 0; x < columns; ++x) {
      if (solid[y * columns + x] != 0) line[x] = 0;
    }
    envelope.Take(line);
    std::copy(line.begin(), line.end(), squared.begin() + static_cast<ptrdiff_t>(y * columns));
  }
  for (size_t x = 0; x < columns; ++x) {
    line.resize(rows);
    for (size_t y = 0; y < rows; ++y) line[y] = squared[y * columns + x];
    envelope.Take(line);
    for (size_t y = 0; y < rows; ++y) squared[y * columns + x] = line[y];
  }
  return squared;
}

}  // namespace vantage::planning

#include "core/planning/openings/basins.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include "core/planning/openings/groups.h"

namespace vantage::planning {
namespace {

// Cells of one border are this near to each other, in cells: the border is a line of steps.
constexpr int kBorderStep = 2;
constexpr size_t kCellsBetweenLooks = 4096;

struct BorderCell {
  uint32_t cell;
  int basin;
  int other;
};

// Both sides of a narrow place have to be wider than it; else it is no end of either.
bool Widens(int32_t widest, int32_t narrow) {
  return static_cast<double>(widest) >= kWidening * kWidening * narrow;
}

template <typename Fn>
void ForNeighbours(const Eigen::Vector2i& size, uint32_t cell, Fn&& fn) {
  const int x = static_cast<int>(cell) % size.x();
  const int y = static_cast<int>(cell) / size.x();
  for (int ny = std::max(0, y - 1); ny <= std::min(size.y() - 1, y + 1); ++ny) {
    for (int nx = std::max(0, x - 1); nx <= std::min(size.x() - 1, x + 1); ++nx) {
      if (nx != x || ny != y) fn(static_cast<uint32_t>(nx + size.x() * ny));
    }
  }
}

// Of cells that lie beside each other the first, which is the widest.
std::vector<NarrowPlace> FirstOfEachBorder(const Eigen::Vector2i& size,
                                           const std::vector<BorderCell>& border) {
  std::vector<NarrowPlace> narrows;
  std::map<std::pair<int, int>, std::vector<size_t>> by_pair;
  for (size_t i = 0; i < border.size(); ++i) {
    by_pair[std::minmax(border[i].basin, border[i].other)].push_back(i);
  }
  std::vector<std::pair<size_t, NarrowPlace>> found;
  for (const auto& [pair, of_pair] : by_pair) {
    const std::vector<size_t>& cells = of_pair;
    Groups groups(cells.size());
    const auto at = [&](size_t k) {
      const auto cell = static_cast<int>(border[cells[k]].cell);
      return Eigen::Vector2i(cell % size.x(), cell / size.x());
    };
    for (size_t k = 0; k < cells.size(); ++k) {
      for (size_t l = 0; l < k; ++l) {
        if ((at(k) - at(l)).cwiseAbs().maxCoeff() <= kBorderStep) groups.Join(k, l);
      }
    }
    for (size_t k = 0; k < cells.size(); ++k) {
      if (groups.Of(k) == k)
        found.push_back({cells[k], {border[cells[k]].cell, pair.first, pair.second}});
    }
  }
  std::sort(found.begin(), found.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  narrows.reserve(found.size());
  for (const auto& [order, narrow] : found) narrows.push_back(narrow);
  return narrows;
}

}  // namespace

std::optional<Basins> FindBasins(const Eigen::Vector2i& size, const std::vector<uint8_t>& free,
                                 const std::vector<int32_t>& squared,
                                 const parallel::Cancellation& cancelled) {
  std::vector<uint32_t> order;
  for (uint32_t cell = 0; cell < free.size(); ++cell) {
    if (free[cell] != 0) order.push_back(cell);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](uint32_t a, uint32_t b) { return squared[a] > squared[b]; });
  Basins basins;
  basins.of.assign(free.size(), -1);
  Groups groups(0);
  std::vector<int32_t> widest;  // by basin
  std::vector<BorderCell> border;
  size_t until_poll = 0;
  for (const uint32_t cell : order) {
    if (until_poll-- == 0) {
      if (cancelled.Requested()) return std::nullopt;
      until_poll = kCellsBetweenLooks;
    }
    // Basins are numbered as they come, so the lower number is the wider one.
    // A cell goes with the neighbour that is farthest from walls.
    int own = -1;
    int32_t farthest = -1;
    std::vector<int> others;
    ForNeighbours(size, cell, [&](uint32_t to) {
      if (basins.of[to] < 0) return;
      others.push_back(static_cast<int>(groups.Of(static_cast<size_t>(basins.of[to]))));
      if (squared[to] <= farthest) return;
      farthest = squared[to];
      own = others.back();
    });
    std::sort(others.begin(), others.end());
    others.erase(std::unique(others.begin(), others.end()), others.end());
    if (others.empty()) {
      own = static_cast<int>(groups.Add());
      widest.push_back(squared[cell]);
    } else {
      for (size_t i = 1; i < others.size(); ++i) {
        if (Widens(widest[static_cast<size_t>(others[i])], squared[cell])) {
          border.push_back({cell, others.front(), others[i]});
        } else {
          groups.Join(static_cast<size_t>(others.front()), static_cast<size_t>(others[i]));
        }
      }
    }
    basins.of[cell] = own;
  }
  // Those that are left are numbered anew.
  std::vector<int> number(widest.size(), -1);
  for (size_t i = 0; i < widest.size(); ++i) {
    if (groups.Of(i) == i) number[i] = basins.count++;
  }
  const auto final_of = [&](int basin) { return number[groups.Of(static_cast<size_t>(basin))]; };
  for (int& basin : basins.of) {
    if (basin >= 0) basin = final_of(basin);
  }
  std::vector<BorderCell> kept;
  for (const BorderCell& cell : border) {
    const int a = final_of(cell.basin);
    const int b = final_of(cell.other);
    if (a != b) kept.push_back({cell.cell, a, b});
  }
  basins.narrows = FirstOfEachBorder(size, kept);

  return basins;
}

}  // namespace vantage::planning

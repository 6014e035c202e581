#include "core/site_prior/floor_plan.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/status/status.h"
#include "absl/strings/str_format.h"

namespace vantage::site_prior {
namespace {

constexpr double kLeastRoom = 1.0;  // m2 of floor that make a plan one of rooms
constexpr double kNarrowest = 0.4;  // m, of what is no wall: thicker ones are drawn filled

struct Rectangle {
  int x0, y0, x1, y1;  // cells, half open
};

// Covers all marked cells with rectangles, each as wide and then as high as it goes, by y, x.
std::vector<Rectangle> Cover(std::vector<uint8_t> marked, int width, int height) {
  const auto at = [&](int x, int y) -> uint8_t& {
    return marked[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
  };
  std::vector<Rectangle> found;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (at(x, y) == 0) continue;
      Rectangle r{x, y, x, y + 1};
      while (r.x1 < width && at(r.x1, y) != 0) ++r.x1;
      const auto whole = [&](int row) {
        for (int i = r.x0; i < r.x1; ++i) {
          if (at(i, row) == 0) return false;
        }
        return true;
      };
      while (r.y1 < height && whole(r.y1)) ++r.y1;
      for (int j = r.y0; j < r.y1; ++j) {
        for (int i = r.x0; i < r.x1; ++i) at(i, j) = 0;
      }
      found.push_back(r);
    }
  }
  return found;
}

// Chamfer distances (3 for a side, 4 for a corner) to the nearest cell that is marked.
std::vector<int> Distances(const std::vector<uint8_t>& marked, int width, int height) {
  constexpr int kFar = std::numeric_limits<int>::max() / 2;
  std::vector<int> away(marked.size());
  for (size_t i = 0; i < marked.size(); ++i) away[i] = marked[i] != 0 ? 0 : kFar;
  const auto relax = [&](int x, int y, int dx, int dy) {
    const int u = x + dx;
    const int v = y + dy;
    if (u < 0 || v < 0 || u >= width || v >= height) return;
    int& own = away[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
    const int there =
        away[static_cast<size_t>(v) * static_cast<size_t>(width) + static_cast<size_t>(u)];
    own = std::min(own, there + (dx != 0 && dy != 0 ? 4 : 3));
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      relax(x, y, -1, 0);
      relax(x, y, -1, -1);
      relax(x, y, 0, -1);
      relax(x, y, 1, -1);
    }
  }
  for (int y = height - 1; y >= 0; --y) {
    for (int x = width - 1; x >= 0; --x) {
      relax(x, y, 1, 0);
      relax(x, y, 1, 1);
      relax(x, y, 0, 1);
      relax(x, y, -1, 1);
    }
  }
  return away;
}

// The plan with room around it, so that what is outside hangs together.
PlanRaster Framed(const PlanRaster& plan, int margin) {
  PlanRaster framed;
  framed.width = plan.width + 2 * margin;
  framed.height = plan.height + 2 * margin;
  framed.cell = plan.cell;
  framed.origin = plan.origin - Eigen::Vector2d::Constant(margin * plan.cell);
  framed.wall.assign(static_cast<size_t>(framed.width) * static_cast<size_t>(framed.height), 0);
  for (int y = 0; y < plan.height; ++y) {
    for (int x = 0; x < plan.width; ++x) framed.At(x + margin, y + margin) = plan.At(x, y);
  }
  return framed;
}

// What the walls enclose, gaps as wide as doors closed. `plan` is framed.
std::vector<uint8_t> Inside(const PlanRaster& plan) {
  const int half = std::max(1, static_cast<int>(std::ceil(kWidestOuterGap / 2 / plan.cell * 3)));
  const std::vector<int> from_wall = Distances(plan.wall, plan.width, plan.height);
  std::vector<uint8_t> outside(plan.wall.size(), 0);
  std::vector<size_t> queue = {0};
  outside[0] = 1;
  const auto width = static_cast<size_t>(plan.width);
  while (!queue.empty()) {
    const size_t at = queue.back();
    queue.pop_back();
    const auto x = static_cast<int>(at % width);
    const auto y = static_cast<int>(at / width);
    const auto visit = [&](int u, int v) {
      if (u < 0 || v < 0 || u >= plan.width || v >= plan.height) return;
      const size_t to = static_cast<size_t>(v) * width + static_cast<size_t>(u);
      if (outside[to] != 0 || from_wall[to] <= half) return;
      outside[to] = 1;
      queue.push_back(to);
    };
    visit(x - 1, y);
    visit(x + 1, y);
    visit(x, y - 1);
    visit(x, y + 1);
  }
  // It goes on to the walls again, but not through the gaps.
  const std::vector<int> from_outside = Distances(outside, plan.width, plan.height);
  std::vector<uint8_t> inside(plan.wall.size(), 0);
  for (size_t i = 0; i < inside.size(); ++i) {
    inside[i] = plan.wall[i] == 0 && from_outside[i] > half + 3;
  }
  return inside;
}

// What is narrower than kNarrowest everywhere lies between the two lines that a wall is drawn as:
// it becomes wall.
void FillWalls(PlanRaster& plan, std::vector<uint8_t>& inside) {
  const int half = std::max(1, static_cast<int>(std::lround(kNarrowest / 2 / plan.cell * 3)));
  const std::vector<int> from_wall = Distances(plan.wall, plan.width, plan.height);
  std::vector<uint8_t> wide(inside.size());
  for (size_t i = 0; i < wide.size(); ++i) wide[i] = inside[i] != 0 && from_wall[i] > half;
  const std::vector<int> from_wide = Distances(wide, plan.width, plan.height);
  for (size_t i = 0; i < inside.size(); ++i) {
    if (inside[i] == 0 || from_wide[i] <= half + 3) continue;
    inside[i] = 0;
    plan.wall[i] = 1;
  }
}

class Boxes {
 public:
  Boxes(const PlanRaster& plan, double low, double high) : plan_(plan), low_(low), high_(high) {}

  void AddWall(const Rectangle& r) {
    AddSide({r.x0, r.y0}, {r.x1, r.y0});
    AddSide({r.x1, r.y0}, {r.x1, r.y1});
    AddSide({r.x1, r.y1}, {r.x0, r.y1});
    AddSide({r.x0, r.y1}, {r.x0, r.y0});
  }
  void AddFloor(const Rectangle& r) {
    for (const double z : {low_, high_}) {
      AddQuad(Point(r.x0, r.y0, z), Point(r.x1, r.y0, z), Point(r.x1, r.y1, z),
              Point(r.x0, r.y1, z));
    }
  }
  PriorMesh Take() { return std::move(mesh_); }

 private:
  Eigen::Vector3f Point(int x, int y, double z) const {
    return Eigen::Vector3d(plan_.origin.x() + x * plan_.cell, plan_.origin.y() + y * plan_.cell, z)
        .cast<float>();
  }
  void AddSide(const Eigen::Vector2i& a, const Eigen::Vector2i& b) {
    AddQuad(Point(a.x(), a.y(), low_), Point(b.x(), b.y(), low_), Point(b.x(), b.y(), high_),
            Point(a.x(), a.y(), high_));
  }
  void AddQuad(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c,
               const Eigen::Vector3f& d) {
    const auto first = static_cast<uint32_t>(mesh_.vertices.size());
    mesh_.vertices.insert(mesh_.vertices.end(), {a, b, c, d});
    mesh_.triangles.push_back({first, first + 1, first + 2});
    mesh_.triangles.push_back({first, first + 2, first + 3});
  }

  const PlanRaster& plan_;
  double low_;   // m
  double high_;  // m
  PriorMesh mesh_;
};

}  // namespace

absl::StatusOr<PriorMesh> ExtrudePlan(const PlanRaster& plan, double floor, double wall_height) {
  if (std::none_of(plan.wall.begin(), plan.wall.end(), [](uint8_t w) { return w != 0; })) {
    return absl::InvalidArgumentError(
        "the plan is empty: it has no wall; walls are lines of a DXF, and dark in a picture");
  }
  const int margin = static_cast<int>(std::ceil(kWidestOuterGap / plan.cell)) + 2;
  PlanRaster framed = Framed(plan, margin);
  std::vector<uint8_t> inside = Inside(framed);
  FillWalls(framed, inside);
  const auto cells = static_cast<double>(std::count(inside.begin(), inside.end(), 1));
  if (cells * plan.cell * plan.cell < kLeastRoom) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "the plan is open: its walls enclose no room; close gaps of the outer walls that are wider "
        "than %.1f m, or check the scale: it is %.1f m wide",
        kWidestOuterGap, std::max(plan.width, plan.height) * plan.cell));
  }
  Boxes boxes(framed, floor, floor + wall_height);
  for (const Rectangle& r : Cover(framed.wall, framed.width, framed.height)) boxes.AddWall(r);
  for (const Rectangle& r : Cover(inside, framed.width, framed.height)) boxes.AddFloor(r);
  return boxes.Take();
}

}  // namespace vantage::site_prior

#include "core/site_prior/wall_lines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

namespace vantage::site_prior {
namespace {

// m at the site:
constexpr double kCut = 1.3;       // over the floor: over tables and under lintels
constexpr double kLevelBin = 0.1;  // heights of level surface are told apart by
constexpr double kSlab = 0.6;      // a ceiling and the floor on it are no farther apart
constexpr double kOneFloor = 1.0;  // over a floor: desks and platforms, and no other floor
constexpr double kSameCorner = 0.002;
constexpr double kLeastLine = 0.1;
constexpr double kFacesUp = 0.9;      // |cosine| of level surface
constexpr double kPartOfFloor = 0.3;  // of the largest level's area, that a floor has
constexpr size_t kMostFloors = 16;
// A mesh that has more of them over a floor is noise, or a site of which a picture shows nothing.
constexpr size_t kMostPieces = 50'000;
constexpr size_t kLongestLine = 1000;  // pieces in a row: simplifying takes their square
// How far corners may be off, m at the site: the least that leaves no more than are kept.
constexpr std::array<double, 3> kTolerances = {0.02, 0.05, 0.1};

using Point = Eigen::Vector2f;
using Piece = std::array<Point, 2>;
using Line = std::vector<Point>;

// Heights of the floors of storeys, m in the mesh's frame, from the lowest.
std::vector<float> FloorsOf(const PriorMesh& mesh, double scale) {
  const double bin = kLevelBin / scale;
  std::map<int, double> areas;  // by height; what lies there, times two
  float lowest = std::numeric_limits<float>::infinity();
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3f& a = mesh.vertices[t[0]];
    const Eigen::Vector3f normal = (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);
    const float middle = (a.z() + mesh.vertices[t[1]].z() + mesh.vertices[t[2]].z()) / 3;
    lowest = std::min(lowest, std::min({a.z(), mesh.vertices[t[1]].z(), mesh.vertices[t[2]].z()}));
    if (std::abs(normal.z()) < kFacesUp * static_cast<double>(normal.norm())) continue;
    areas[static_cast<int>(std::floor(static_cast<double>(middle) / bin))] +=
        static_cast<double>(normal.norm());
  }
  double largest = 0;
  for (const auto& [height, area] : areas) largest = std::max(largest, area);
  std::erase_if(areas, [&](const auto& level) { return level.second < kPartOfFloor * largest; });
  std::vector<float> floors;
  double first = -std::numeric_limits<double>::infinity();
  for (const auto& [height, area] : areas) {
    const double z = (height + 0.5) * bin;
    if (z - first < kSlab / scale) {
      floors.back() = static_cast<float>(z);  // of a slab the upper side
      continue;
    }
    if (z - first < kOneFloor / scale) continue;  // desks and platforms
    if (floors.size() == kMostFloors) break;
    floors.push_back(static_cast<float>(z));
    first = z;
  }
  if (floors.empty() && std::isfinite(lowest)) floors.push_back(lowest);
  return floors;
}

// Where a level plane cuts the mesh.
std::vector<Piece> CutAt(const PriorMesh& mesh, float height) {
  std::vector<Piece> pieces;
  for (const auto& t : mesh.triangles) {
    Piece piece;
    size_t found = 0;
    for (size_t side = 0; side < 3; ++side) {
      // In the same order whichever triangle it is of, so that both end at the same point.
      const uint32_t low = std::min(t[side], t[(side + 1) % 3]);
      const uint32_t high = std::max(t[side], t[(side + 1) % 3]);
      const Eigen::Vector3f& a = mesh.vertices[low];
      const Eigen::Vector3f& b = mesh.vertices[high];
      if ((a.z() < height) == (b.z() < height) || found == 2) continue;
      const float s = (height - a.z()) / (b.z() - a.z());
      piece[found++] = a.head<2>() + s * (b - a).head<2>();
    }
    if (found < 2) continue;
    pieces.push_back(piece);
    if (pieces.size() == kMostPieces) break;
  }
  return pieces;
}

// Pieces that meet end to end as long lines: a dashed line begins anew with each piece.
std::vector<Line> Joined(const std::vector<Piece>& pieces, double near) {
  struct End {
    std::pair<int64_t, int64_t> at;
    uint32_t piece = 0;
  };
  const auto key = [&](const Point& p) {
    return std::pair<int64_t, int64_t>(std::llround(static_cast<double>(p.x()) / near),
                                       std::llround(static_cast<double>(p.y()) / near));
  };
  std::vector<End> ends;
  ends.reserve(2 * pieces.size());
  for (uint32_t i = 0; i < pieces.size(); ++i) {
    for (const Point& end : pieces[i]) ends.push_back({key(end), i});
  }
  std::sort(ends.begin(), ends.end(), [](const End& a, const End& b) {
    return a.at != b.at ? a.at < b.at : a.piece < b.piece;
  });
  std::vector<uint8_t> taken(pieces.size(), 0);
  std::vector<uint32_t> passed(ends.size(), 0);  // by the first end at a place: those taken there
  const auto walk = [&](Point at, Line& line) {
    for (size_t step = 0; step < kLongestLine; ++step) {
      const auto here = key(at);
      const auto first = std::lower_bound(ends.begin(), ends.end(), here,
                                          [](const End& e, const auto& k) { return e.at < k; });
      if (first == ends.end()) return;
      uint32_t& past = passed[static_cast<size_t>(first - ends.begin())];
      auto end = first + past;
      for (; end != ends.end() && end->at == here && taken[end->piece] != 0; ++end) ++past;
      if (end == ends.end() || end->at != here) return;
      taken[end->piece] = 1;
      const Piece& piece = pieces[end->piece];
      at = key(piece[0]) == here ? piece[1] : piece[0];
      line.push_back(at);
    }
  };
  std::vector<Line> lines;
  for (uint32_t i = 0; i < pieces.size(); ++i) {
    if (taken[i] != 0) continue;
    taken[i] = 1;
    Line line = {pieces[i][0]};
    walk(pieces[i][0], line);
    std::reverse(line.begin(), line.end());
    line.push_back(pieces[i][1]);
    walk(pieces[i][1], line);
    lines.push_back(std::move(line));
  }
  return lines;
}

double DistanceTo(const Point& p, const Point& a, const Point& b) {
  const Point along = b - a;
  const float length = along.squaredNorm();
  const float s = length == 0 ? 0 : std::clamp((p - a).dot(along) / length, 0.0F, 1.0F);
  return static_cast<double>((p - a - s * along).norm());
}

// Without the corners that lie within `tolerance` of the line through those that stay (Douglas and
// Peucker 1973).
Line Simplified(const Line& line, double tolerance) {
  std::vector<uint8_t> keep(line.size(), 0);
  keep.front() = keep.back() = 1;
  std::vector<std::pair<size_t, size_t>> open = {{0, line.size() - 1}};
  while (!open.empty()) {
    const auto [from, to] = open.back();
    open.pop_back();
    double worst = tolerance;
    size_t at = 0;
    for (size_t i = from + 1; i < to; ++i) {
      const double off = DistanceTo(line[i], line[from], line[to]);
      if (off > worst) {
        worst = off;
        at = i;
      }
    }
    if (at == 0) continue;
    keep[at] = 1;
    open.push_back({from, at});
    open.push_back({at, to});
  }
  Line left;
  for (size_t i = 0; i < line.size(); ++i) {
    if (keep[i] != 0) left.push_back(line[i]);
  }
  return left;
}

double LengthOf(const Line& line) {
  double length = 0;
  for (size_t i = 1; i < line.size(); ++i) {
    length += static_cast<double>((line[i] - line[i - 1]).norm());
  }
  return length;
}

size_t CornersOf(const std::vector<WallLine>& lines) {
  size_t corners = 0;
  for (const WallLine& line : lines) corners += line.corners.size();
  return corners;
}

}  // namespace

std::vector<WallLine> WallLinesOf(const PriorMesh& mesh, double scale) {
  std::vector<WallLine> whole;
  for (const float floor : FloorsOf(mesh, scale)) {
    const auto height = static_cast<float>(static_cast<double>(floor) + kCut / scale);
    for (Line& line : Joined(CutAt(mesh, height), kSameCorner / scale)) {
      line = Simplified(line, kTolerances.front() / scale);
      if (LengthOf(line) >= kLeastLine / scale) whole.push_back({std::move(line), floor});
    }
    // What one storey leaves no room for, the next would not get either.
    if (CornersOf(whole) > 2 * kMostPieces) break;
  }
  for (const double tolerance : kTolerances) {
    if (CornersOf(whole) <= kMostWallCorners) return whole;
    for (WallLine& line : whole) line.corners = Simplified(line.corners, tolerance / scale);
  }
  std::stable_sort(whole.begin(), whole.end(), [](const WallLine& a, const WallLine& b) {
    return LengthOf(a.corners) > LengthOf(b.corners);
  });
  std::vector<WallLine> kept;
  size_t corners = 0;
  for (WallLine& line : whole) {
    if (corners + line.corners.size() > kMostWallCorners) continue;
    corners += line.corners.size();
    kept.push_back(std::move(line));
  }
  return kept;
}

}  // namespace vantage::site_prior

#include "core/planning/expectation/room_limits.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

namespace vantage::planning {
namespace {

// Walls are looked for over what stands before them: few cupboards are higher. m over the floor.
constexpr double kOverFurniture = 1.9;
constexpr double kWallsSeenTo = 3.0;
constexpr double kLeastWall = 0.1;  // m2 of a plane: two hands' breadth, half a metre high
// The same of a wall that was seen from its other side: a quarter of a metre, as high as is looked
// at. A wider pillar, too, is taken for a wall: the room is then expected smaller than it is until
// it is entered, which costs less than views of two rooms at once.
constexpr double kLeastBack = 0.3;
constexpr double kThinWall = 0.05;      // m, at least, between the two sides
constexpr double kFaces = 0.9;          // cosine: 25 degrees, since normals at corners are askew
constexpr double kBehindTheWall = 0.3;  // m from a doorway's middle that are its jambs
// Two doorways are in the same wall when they face alike (cosine, 18 degrees) and stand in line, m:
// a wall's thickness, and a corridor that widens by as much.
constexpr double kSameWay = 0.95;
constexpr double kInLine = 0.4;
constexpr double kLeastAside = 0.2;     // m beside a jamb that belong to the room in any case
constexpr double kBehindTheLeaf = 1.0;  // m from there in which a door's leaf may stand open

// Surface that faces against one direction, by its distance in that direction.
class FacingSurface {
 public:
  FacingSurface(double most, double voxel)
      : voxel_(voxel), bins_(static_cast<size_t>(std::ceil(most / voxel)) + 1) {}

  void Add(double distance, double area) {
    if (distance < 0) return;
    const auto bin = static_cast<size_t>(distance / voxel_);
    if (bin >= bins_.size()) return;
    bins_[bin].area += area;
    bins_[bin].moment += area * distance;
  }
  // Of the nearest plane of so much area, m2.
  std::optional<double> Nearest(double area) const {
    for (size_t i = 1; i < bins_.size(); ++i) {
      const double here = bins_[i].area + bins_[i - 1].area;
      if (here >= area) return (bins_[i].moment + bins_[i - 1].moment) / here;
    }
    return std::nullopt;
  }
  // Of the farthest plane; a plane lies in two layers of voxels at most.
  std::optional<double> Farthest() const {
    for (size_t i = bins_.size() - 1; i > 0; --i) {
      const double area = bins_[i].area + bins_[i - 1].area;
      if (area >= kLeastWall) return (bins_[i].moment + bins_[i - 1].moment) / area;
    }
    return std::nullopt;
  }

 private:
  struct Bin {
    double area = 0;    // m2
    double moment = 0;  // m3: area times distance
  };
  double voxel_;  // m
  std::vector<Bin> bins_;
};

// A piece of a wall's surface in the doorway's frame.
struct WallPiece {
  double in = 0;       // m
  double aside = 0;    // m, positive to the left
  double against = 0;  // the normal along the way in, and to the left
  double leftward = 0;
  double area = 0;  // m2
};

std::vector<WallPiece> WallsBehind(const model::PlanningView& model, const Opening& opening,
                                   const RoomLimits& most) {
  const double voxel = model.voxel_size();
  const Eigen::Vector2d middle = opening.centre.head<2>();
  const Eigen::Vector2d in = opening.direction.head<2>();
  const Eigen::Vector2d left(-in.y(), in.x());
  Eigen::Array2d low = Eigen::Array2d::Constant(1e9);
  Eigen::Array2d high = -low;
  for (const double depth : {0.0, most.depth}) {
    for (const double aside : {-most.right, most.left}) {
      const Eigen::Array2d corner = middle + depth * in + aside * left;
      low = low.min(corner);
      high = high.max(corner);
    }
  }
  const model::VoxelIndex first = model.At({low.x(), low.y(), opening.centre.z() + kOverFurniture});
  const model::VoxelIndex last = model.At({high.x(), high.y(), opening.centre.z() + kWallsSeenTo});
  std::vector<WallPiece> pieces;
  for (int z = first.z(); z <= last.z(); ++z) {
    for (int y = first.y(); y <= last.y(); ++y) {
      for (int x = first.x(); x <= last.x(); ++x) {
        const model::VoxelIndex v(x, y, z);
        if (model.State(v) != model::VoxelState::kTrueSurface) continue;
        const std::optional<model::SurfaceVoxel> surface = model.Surface(v);
        if (!surface.has_value()) continue;
        const Eigen::Vector2d off = surface->centroid.head<2>().cast<double>() - middle;
        const Eigen::Vector2d normal = surface->normal.head<2>().cast<double>();
        const WallPiece piece{off.dot(in), off.dot(left), normal.dot(in), normal.dot(left),
                              voxel * voxel};
        if (piece.in > kBehindTheWall) pieces.push_back(piece);
      }
    }
  }
  return pieces;
}

// `limit`, less where a wall was seen from the other side, that of the next room.
double EndBefore(const FacingSurface& back, double limit) {
  const std::optional<double> nearest = back.Nearest(kLeastBack);
  return nearest.has_value() ? std::min(limit, *nearest - kThinWall) : limit;
}

}  // namespace

RoomLimits LimitsBehind(const model::PlanningView& model, const Opening& opening,
                        const RoomLimits& most) {
  const std::vector<WallPiece> pieces = WallsBehind(model, opening, most);
  const double voxel = model.voxel_size();
  FacingSurface end(most.depth, voxel);
  FacingSurface behind_end(most.depth, voxel);
  for (const WallPiece& piece : pieces) {
    if (piece.aside > most.left || piece.aside < -most.right) continue;
    if (piece.against < -kFaces) end.Add(piece.in, piece.area);
    if (piece.against > kFaces && piece.in > kBehindTheLeaf) {
      behind_end.Add(piece.in, piece.area);
    }
  }
  RoomLimits limits = most;
  limits.depth = EndBefore(behind_end, std::min(most.depth, end.Farthest().value_or(most.depth)));
  FacingSurface left(most.left, voxel);
  FacingSurface right(most.right, voxel);
  FacingSurface behind_left(most.left, voxel);
  FacingSurface behind_right(most.right, voxel);
  for (const WallPiece& piece : pieces) {
    if (piece.in < kBehindTheLeaf || piece.in > limits.depth) continue;
    if (piece.leftward < -kFaces) left.Add(piece.aside, piece.area);
    if (piece.leftward > kFaces) right.Add(-piece.aside, piece.area);
    if (piece.leftward > kFaces) behind_left.Add(piece.aside, piece.area);
    if (piece.leftward < -kFaces) behind_right.Add(-piece.aside, piece.area);
  }
  limits.left = EndBefore(behind_left, std::min(most.left, left.Farthest().value_or(most.left)));
  limits.right =
      EndBefore(behind_right, std::min(most.right, right.Farthest().value_or(most.right)));
  return limits;
}

RoomLimits EndedBetweenDoorways(const Openings& openings, size_t opening,
                                const RoomLimits& limits) {
  const Opening& own = openings.openings[opening];
  const Eigen::Vector2d in = own.direction.head<2>();
  const Eigen::Vector2d left(-in.y(), in.x());
  const double least = 0.5 * own.width + kLeastAside;
  RoomLimits ended = limits;
  for (const Opening& other : openings.openings) {
    if (&other == &own || !other.doorway() || other.storey != own.storey) continue;
    if (other.behind == own.behind) continue;
    if (std::abs(other.direction.head<2>().dot(in)) < kSameWay) continue;
    const Eigen::Vector2d off = (other.centre - own.centre).head<2>();
    if (std::abs(off.dot(in)) > kInLine) continue;
    const double aside = off.dot(left);
    // The same hole in the wall, told once more: from the other side, or with other space behind it
    // where a leaf or what stands in the way divides the room.
    if (std::abs(aside) < 0.5 * (own.width + other.width)) continue;
    double& side = aside > 0 ? ended.left : ended.right;
    side = std::min(side, std::max(least, 0.5 * std::abs(aside)));
  }
  return ended;
}

}  // namespace vantage::planning

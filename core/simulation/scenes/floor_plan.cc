#include "core/simulation/scenes/floor_plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/sensor/scanner_model.h"

namespace vantage::simulation {
namespace {

constexpr double kCell = 0.05;        // m
constexpr double kDoorZone = 0.55;    // m kept free before and behind a doorway
constexpr double kWindowZone = 0.35;  // m before a window where nothing higher than the sill stands
constexpr double kLeafThickness = 0.04;
constexpr double kSlab = 0.25;  // m, floor and ceiling reach beyond the walls
constexpr int kTries = 30;

Eigen::Isometry3d Placed(const Eigen::Vector2d& back_middle, double yaw) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translate(Eigen::Vector3d(back_middle.x(), back_middle.y(), 0));
  T.rotate(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  return T;
}

double YawOf(const Eigen::Isometry3d& T) { return std::atan2(T(1, 0), T(0, 0)); }

Eigen::Vector2d AlongOf(const Wall& wall) { return (wall.to - wall.from).normalized(); }

// The door leaf of an opening as it stands open: hinge, direction, width.
struct Leaf {
  Eigen::Vector2d hinge;
  double yaw;
  double width;
  Footprint footprint() const {
    const Eigen::Vector2d along(std::cos(yaw), std::sin(yaw));
    return {hinge + 0.5 * width * along, {0.5 * width, 0.5 * kLeafThickness}, yaw};
  }
};

Leaf LeafOf(const Wall& wall, const Opening& opening) {
  const Eigen::Vector2d along = AlongOf(wall);
  const Eigen::Vector2d left(-along.y(), along.x());
  const double side = opening.leaf_to_left ? 1 : -1;
  const double jamb = opening.leaf_at_end ? 0.5 * opening.width : -0.5 * opening.width;
  const double closed = std::atan2(along.y(), along.x()) + (opening.leaf_at_end ? sensor::kPi : 0);
  const double turn = opening.leaf_at_end ? -side : side;
  // The hinge sits on the face of the wall, half a leaf clear of it and of the passage.
  const Eigen::Vector2d hinge = wall.from + (opening.middle + jamb) * along +
                                side * (0.5 * wall.thickness + 0.5 * kLeafThickness) * left -
                                (opening.leaf_at_end ? -1 : 1) * 0.5 * kLeafThickness * along;
  return {hinge, closed + turn * opening.leaf_angle, opening.width - 0.04};
}

// A level surface at height `z`, m, but for the hole.
void AddSurface(const Eigen::AlignedBox2d& extent, const Eigen::AlignedBox2d& hole, double z,
                MeshBuilder& builder) {
  const auto part = [&](double x0, double y0, double x1, double y1) {
    builder.Quad({Eigen::Vector3d(x0, y0, z), Eigen::Vector3d(x1, y0, z),
                  Eigen::Vector3d(x1, y1, z), Eigen::Vector3d(x0, y1, z)});
  };
  const Eigen::Vector2d& low = extent.min();
  const Eigen::Vector2d& high = extent.max();
  if (hole.isEmpty()) {
    part(low.x(), low.y(), high.x(), high.y());
    return;
  }
  part(low.x(), low.y(), hole.min().x(), high.y());
  part(hole.max().x(), low.y(), high.x(), high.y());
  part(hole.min().x(), low.y(), hole.max().x(), hole.min().y());
  part(hole.min().x(), hole.max().y(), hole.max().x(), high.y());
}

}  // namespace

double Footprint::DistanceTo(const Eigen::Vector2d& point) const {
  const Eigen::Vector2d local = Eigen::Rotation2Dd(-yaw) * (point - middle);
  return (local.cwiseAbs() - half_size).cwiseMax(0.0).norm();
}

bool Footprint::Overlaps(const Footprint& other) const {
  for (const double axis_yaw :
       {yaw, yaw + sensor::kPi / 2, other.yaw, other.yaw + sensor::kPi / 2}) {
    const Eigen::Vector2d axis(std::cos(axis_yaw), std::sin(axis_yaw));
    const auto reach = [&](const Footprint& f) {
      const Eigen::Vector2d local = Eigen::Rotation2Dd(-f.yaw) * axis;
      return local.cwiseAbs().dot(f.half_size);
    };
    if (std::abs(axis.dot(other.middle - middle)) >= reach(*this) + reach(other)) return false;
  }
  return true;
}

FloorPlan::FloorPlan(const Eigen::AlignedBox2d& extent, double height, double passage)
    : extent_(extent),
      height_(height),
      passage_(passage),
      columns_(static_cast<int>(std::ceil(extent.sizes().x() / kCell))),
      rows_(static_cast<int>(std::ceil(extent.sizes().y() / kCell))),
      blocked_(static_cast<size_t>(columns_) * static_cast<size_t>(rows_), 0) {}

Eigen::Vector2d FloorPlan::CellMiddle(int column, int row) const {
  return extent_.min() + kCell * Eigen::Vector2d(column + 0.5, row + 0.5);
}

template <typename Visit>
void FloorPlan::ForCellsNear(const Footprint& footprint, double distance,
                             const Visit& visit) const {
  const double reach = footprint.half_size.norm() + distance;
  const Eigen::Vector2d low = (footprint.middle.array() - reach).matrix() - extent_.min();
  const Eigen::Vector2d high = (footprint.middle.array() + reach).matrix() - extent_.min();
  const int c1 = std::min(columns_ - 1, static_cast<int>(high.x() / kCell));
  const int r1 = std::min(rows_ - 1, static_cast<int>(high.y() / kCell));
  for (int row = std::max(0, static_cast<int>(low.y() / kCell)); row <= r1; ++row) {
    for (int column = std::max(0, static_cast<int>(low.x() / kCell)); column <= c1; ++column) {
      if (footprint.DistanceTo(CellMiddle(column, row)) < distance) {
        visit(static_cast<size_t>(row) * static_cast<size_t>(columns_) +
              static_cast<size_t>(column));
      }
    }
  }
}

void FloorPlan::Block(const Footprint& footprint) {
  ForCellsNear(footprint, passage_, [&](size_t cell) { blocked_[cell] = 1; });
}

void FloorPlan::AddWall(const Wall& wall) {
  walls_.push_back(wall);
  const size_t solids_before = solids_.size();
  const Eigen::Vector2d along = AlongOf(wall);
  const double yaw = std::atan2(along.y(), along.x());
  const double length = (wall.to - wall.from).norm();
  const auto piece = [&](double begin, double end, double half_thickness) {
    return Footprint{
        wall.from + 0.5 * (begin + end) * along, {0.5 * (end - begin), half_thickness}, yaw};
  };
  std::vector<Opening> openings = wall.openings;
  std::sort(openings.begin(), openings.end(),
            [](const Opening& a, const Opening& b) { return a.middle < b.middle; });
  double begin = 0;
  for (const Opening& opening : openings) {
    const double left = opening.middle - 0.5 * opening.width;
    const double right = opening.middle + 0.5 * opening.width;
    if (opening.window) {
      sills_.push_back({piece(left, right, 0.5 * wall.thickness + kWindowZone), opening.sill});
      continue;
    }
    solids_.push_back(piece(begin, left, 0.5 * wall.thickness));
    begin = right;
    kept_free_.push_back(piece(left, right, 0.5 * wall.thickness + kDoorZone));
    must_connect_.push_back(wall.from + opening.middle * along);
    if (opening.leaf_angle > 0) solids_.push_back(LeafOf(wall, opening).footprint());
  }
  solids_.push_back(piece(begin, length, 0.5 * wall.thickness));
  for (size_t i = solids_before; i < solids_.size(); ++i) Block(solids_[i]);
}

std::vector<SceneDoorway> FloorPlan::Doorways() const {
  std::vector<SceneDoorway> doorways;
  for (const Wall& wall : walls_) {
    for (const Opening& opening : wall.openings) {
      if (opening.window) continue;
      doorways.push_back(
          {wall.from + opening.middle * AlongOf(wall), AlongOf(wall), opening.width, opening.head});
    }
  }
  return doorways;
}

void FloorPlan::Build(MeshBuilder& builder) const {
  builder.SetFrame(Eigen::Isometry3d::Identity());
  const Eigen::Vector2d low = extent_.min().array() - kSlab;
  const Eigen::Vector2d high = extent_.max().array() + kSlab;
  AddSurface({low, high}, floor_hole_, 0, builder);
  AddSurface({low, high}, ceiling_hole_, height_, builder);
  for (const Wall& wall : walls_) {
    const Eigen::Vector2d along = AlongOf(wall);
    builder.SetFrame(Placed(wall.from, std::atan2(along.y(), along.x())));
    const double half = 0.5 * wall.thickness;
    const double length = (wall.to - wall.from).norm();
    const auto block = [&](double begin, double end, double bottom, double top) {
      if (end - begin > 1e-6 && top - bottom > 1e-6) {
        builder.Box({begin, -half, bottom}, {end, half, top});
      }
    };
    std::vector<Opening> openings = wall.openings;
    std::sort(openings.begin(), openings.end(),
              [](const Opening& a, const Opening& b) { return a.middle < b.middle; });
    double begin = 0;
    for (const Opening& opening : openings) {
      const double left = opening.middle - 0.5 * opening.width;
      const double right = opening.middle + 0.5 * opening.width;
      block(begin, left, 0, height_);
      block(left, right, 0, opening.sill);
      block(left, right, opening.head, height_);
      if (opening.window) {
        // Pane in the middle of the wall, a frame around it and a bar across.
        builder.Quad(
            {Eigen::Vector3d(left, 0, opening.sill), Eigen::Vector3d(right, 0, opening.sill),
             Eigen::Vector3d(right, 0, opening.head), Eigen::Vector3d(left, 0, opening.head)},
            Material::kGlass);
        constexpr double kFrame = 0.05;
        builder.Box({left, -0.03, opening.sill}, {left + kFrame, 0.03, opening.head});
        builder.Box({right - kFrame, -0.03, opening.sill}, {right, 0.03, opening.head});
        builder.Box({left, -0.03, opening.sill}, {right, 0.03, opening.sill + kFrame});
        builder.Box({left, -0.03, opening.head - kFrame}, {right, 0.03, opening.head});
        if (opening.width > 1.3) {
          builder.Box({opening.middle - 0.5 * kFrame, -0.03, opening.sill},
                      {opening.middle + 0.5 * kFrame, 0.03, opening.head});
        }
      }
      begin = right;
    }
    block(begin, length, 0, height_);
    for (const Opening& opening : wall.openings) {
      if (opening.window || opening.leaf_angle <= 0) continue;
      const Leaf leaf = LeafOf(wall, opening);
      builder.SetFrame(Placed(leaf.hinge, leaf.yaw));
      builder.Box({0, -0.5 * kLeafThickness, 0.01},
                  {leaf.width, 0.5 * kLeafThickness, opening.head - 0.02});
      builder.Box({leaf.width - 0.08, -0.07, 1.03}, {leaf.width - 0.06, 0.07, 1.05});
      builder.Box({leaf.width - 0.18, 0.06, 1.03}, {leaf.width - 0.06, 0.08, 1.05});
      builder.Box({leaf.width - 0.18, -0.08, 1.03}, {leaf.width - 0.06, -0.06, 1.05});
    }
  }
  builder.SetFrame(Eigen::Isometry3d::Identity());
}

Footprint FloorPlan::FootprintOf(const Item& item, const Eigen::Isometry3d& T_scene_item) const {
  const Eigen::Vector3d middle = T_scene_item * Eigen::Vector3d(0, 0.5 * item.depth, 0);
  return {middle.head<2>(), {0.5 * item.width, 0.5 * item.depth}, YawOf(T_scene_item)};
}

bool FloorPlan::Fits(const Room& room, const Footprint& footprint, double height) const {
  for (const double sx : {-1.0, 1.0}) {
    for (const double sy : {-1.0, 1.0}) {
      const Eigen::Vector2d corner =
          footprint.middle +
          Eigen::Rotation2Dd(footprint.yaw) *
              Eigen::Vector2d(sx * footprint.half_size.x(), sy * footprint.half_size.y());
      if (!room.inside.contains(corner)) return false;
    }
  }
  const auto overlaps = [&](const Footprint& other) { return footprint.Overlaps(other); };
  if (std::any_of(standing_.begin(), standing_.end(), overlaps)) return false;
  if (std::any_of(solids_.begin(), solids_.end(), overlaps)) return false;
  if (std::any_of(kept_free_.begin(), kept_free_.end(), overlaps)) return false;
  return std::none_of(sills_.begin(), sills_.end(), [&](const Sill& sill) {
    return height > sill.height && footprint.Overlaps(sill.zone);
  });
}

bool FloorPlan::LeavesReachable(const Room& room, const Footprint& footprint) const {
  // The room and the depth of its walls, so that its doorways are inside.
  constexpr double kWallDepth = 0.35;
  const auto cell_of = [&](double metres) { return static_cast<int>(std::floor(metres / kCell)); };
  const Eigen::Vector2d low = room.inside.min() - extent_.min();
  const Eigen::Vector2d high = room.inside.max() - extent_.min();
  const int c0 = std::max(0, cell_of(low.x() - kWallDepth));
  const int r0 = std::max(0, cell_of(low.y() - kWallDepth));
  const int columns = std::min(columns_, cell_of(high.x() + kWallDepth)) - c0;
  const int rows = std::min(rows_, cell_of(high.y() + kWallDepth)) - r0;
  const double reach = footprint.half_size.norm() + passage_;
  enum State : uint8_t { kFree, kBlocked, kReached };
  std::vector<uint8_t> state(static_cast<size_t>(columns) * static_cast<size_t>(rows));
  const auto at = [&](int column, int row) -> uint8_t& {
    return state[static_cast<size_t>(row) * static_cast<size_t>(columns) +
                 static_cast<size_t>(column)];
  };
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const size_t cell = static_cast<size_t>(r0 + row) * static_cast<size_t>(columns_) +
                          static_cast<size_t>(c0 + column);
      const Eigen::Vector2d middle = CellMiddle(c0 + column, r0 + row);
      const bool close = (middle - footprint.middle).squaredNorm() < reach * reach;
      const bool blocked =
          blocked_[cell] != 0 || (close && footprint.DistanceTo(middle) < passage_);
      at(column, row) = blocked ? kBlocked : kFree;
    }
  }
  std::vector<std::pair<int, int>> front;
  const auto visit_cell = [&](int column, int row) {
    if (column < 0 || row < 0 || column >= columns || row >= rows) return;
    if (at(column, row) != kFree) return;
    at(column, row) = kReached;
    front.emplace_back(column, row);
  };
  // A place counts as reached when a cell within 15 cm of it is.
  const auto near = [&](const Eigen::Vector2d& place, const auto& visit) {
    const int column = cell_of(place.x() - extent_.min().x()) - c0;
    const int row = cell_of(place.y() - extent_.min().y()) - r0;
    for (int dc = -3; dc <= 3; ++dc) {
      for (int dr = -3; dr <= 3; ++dr) {
        if (column + dc >= 0 && row + dr >= 0 && column + dc < columns && row + dr < rows) {
          visit(column + dc, row + dr);
        }
      }
    }
  };
  std::vector<Eigen::Vector2d> places;
  for (const Eigen::Vector2d& doorway : must_connect_) {
    if (room.inside.exteriorDistance(doorway) < kWallDepth) places.push_back(doorway);
  }
  if (places.empty()) {
    for (int row = 0; row < rows && front.empty(); ++row) {
      for (int column = 0; column < columns && front.empty(); ++column) visit_cell(column, row);
    }
  } else {
    near(places.front(), visit_cell);
  }
  while (!front.empty()) {
    const auto [column, row] = front.back();
    front.pop_back();
    visit_cell(column - 1, row);
    visit_cell(column + 1, row);
    visit_cell(column, row - 1);
    visit_cell(column, row + 1);
  }
  for (const Eigen::Vector2d& place : places) {
    bool found = false;
    near(place, [&](int column, int row) { found = found || at(column, row) == kReached; });
    if (!found) return false;
  }
  const auto reached = static_cast<double>(std::count(state.begin(), state.end(), kReached));
  const auto cut_off = static_cast<double>(std::count(state.begin(), state.end(), kFree));
  return reached * kCell * kCell >= 0.08 * room.inside.volume() && cut_off <= 0.1 * reached;
}

bool FloorPlan::TryTake(const Room& room, const Item& item, const Eigen::Isometry3d& T_scene_item) {
  const Footprint footprint = FootprintOf(item, T_scene_item);
  if (!Fits(room, footprint, item.height) || !LeavesReachable(room, footprint)) return false;
  standing_.push_back(footprint);
  Block(footprint);
  return true;
}

std::optional<Eigen::Isometry3d> FloorPlan::PlaceAtWall(const Room& room, const Item& item,
                                                        RandomSequence& random) {
  for (int attempt = 0; attempt < kTries; ++attempt) {
    const auto side =
        static_cast<int>(random.Below(4));  // 0: y low, 1: x high, 2: y high, 3: x low
    const Eigen::Vector2d size = room.inside.sizes();
    const double length = side % 2 == 0 ? size.x() : size.y();
    if (item.width > length - 0.04) continue;
    double offset = random.Between(0.5 * item.width + 0.02, length - 0.5 * item.width - 0.02);
    // Furniture likes corners.
    if (random.Chance(0.5)) offset = 0.5 * item.width + random.Between(0.02, 0.08);
    // Nobody sets furniture down exactly parallel to the wall.
    const double askew = random.Between(-0.03, 0.03);
    const double gap =
        0.02 + 0.5 * item.width * std::abs(std::sin(askew)) + random.Between(0, 0.02);
    const Eigen::Vector2d low = room.inside.min();
    const Eigen::Vector2d high = room.inside.max();
    const std::array<Eigen::Vector2d, 4> backs = {
        Eigen::Vector2d(low.x() + offset, low.y() + gap),
        Eigen::Vector2d(high.x() - gap, low.y() + offset),
        Eigen::Vector2d(high.x() - offset, high.y() - gap),
        Eigen::Vector2d(low.x() + gap, high.y() - offset)};
    const Eigen::Isometry3d T =
        Placed(backs[static_cast<size_t>(side)], side * sensor::kPi / 2 + askew);
    if (TryTake(room, item, T)) return T;
  }
  return std::nullopt;
}

std::optional<Eigen::Isometry3d> FloorPlan::PlaceFreely(const Room& room, const Item& item,
                                                        std::optional<double> yaw,
                                                        RandomSequence& random) {
  for (int attempt = 0; attempt < kTries; ++attempt) {
    const double x = random.Between(room.inside.min().x(), room.inside.max().x());
    const double y = random.Between(room.inside.min().y(), room.inside.max().y());
    const double turned = random.Between(-sensor::kPi, sensor::kPi);
    const Eigen::Isometry3d T = Placed({x, y}, yaw.value_or(turned));
    if (TryTake(room, item, T)) return T;
  }
  return std::nullopt;
}

bool FloorPlan::PlaceThere(const Room& room, const Item& item,
                           const Eigen::Isometry3d& T_scene_item) {
  return TryTake(room, item, T_scene_item);
}

std::optional<FloorPlan::Spot> FloorPlan::FreestSpot(const Room& room) const {
  // Farther than this from the room nothing matters.
  constexpr double kFar = 3;
  std::vector<Footprint> around;
  for (const std::vector<Footprint>* all : {&solids_, &standing_}) {
    for (const Footprint& f : *all) {
      if (room.inside.exteriorDistance(f.middle) < f.half_size.norm() + kFar) around.push_back(f);
    }
  }
  std::optional<Spot> best;
  const Eigen::Vector2d low = room.inside.min();
  const Eigen::Vector2d high = room.inside.max();
  for (double y = low.y() + 0.1; y < high.y(); y += 0.1) {
    for (double x = low.x() + 0.1; x < high.x(); x += 0.1) {
      const Eigen::Vector2d at(x, y);
      double clearance = kFar;
      for (const Footprint& f : around) {
        if (best.has_value() && clearance <= best->clearance) break;  // it is no better
        if ((f.middle - at).norm() - f.half_size.norm() >= clearance) continue;
        clearance = std::min(clearance, f.DistanceTo(at));
      }
      if (!best.has_value() || clearance > best->clearance) best = Spot{at, clearance};
    }
  }
  return best;
}

}  // namespace vantage::simulation

#include "core/simulation/scenes/mirror_scenes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "absl/strings/str_cat.h"
#include "core/simulation/random_sequence.h"
#include "core/simulation/scenes/furniture.h"
#include "core/simulation/scenes/mesh_builder.h"

namespace vantage::simulation {
namespace {

using Eigen::AlignedBox2d;
using Eigen::AlignedBox3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kOpeningZone = 0.9;   // m kept free before and behind an opening
constexpr double kClearOfStart = 0.5;  // m around a start
constexpr double kBetweenPieces = 0.05;
constexpr size_t kStarts = 5;

AlignedBox2d Grown(AlignedBox2d box, double by) {
  box.min().array() -= by;
  box.max().array() += by;
  return box;
}

// One side of a room: its inner face runs from `from` along `along`, the room is to the `inward`.
struct Side {
  Vector2d from;
  Vector2d along;   // unit
  Vector2d inward;  // unit
  double length = 0;
};

std::array<Side, 4> SidesOf(const AlignedBox2d& room) {
  const Vector2d size = room.sizes();
  return {{{room.min(), Vector2d::UnitX(), Vector2d::UnitY(), size.x()},
           {room.max(), -Vector2d::UnitX(), -Vector2d::UnitY(), size.x()},
           {room.min(), Vector2d::UnitY(), Vector2d::UnitX(), size.y()},
           {room.max(), -Vector2d::UnitY(), -Vector2d::UnitX(), size.y()}}};
}

class MirrorSceneMaker {
 public:
  explicit MirrorSceneMaker(uint64_t seed) : random_(seed), builder_(made_.scene.mesh) {
    made_.scene.name = absl::StrCat("mirror scene ", seed);
  }

  MirrorScene Make() {
    LayOut();
    const bool twins = random_.Chance(0.4);
    for (size_t i = 0; i < rooms_.size(); ++i) {
      if (twins && i == 1) continue;
      const uint64_t details = random_.Bits();
      Furnish(i, details, std::nullopt);
      if (twins && i == 0) Furnish(1, details, wall_middle_);
    }
    const size_t mirrors = 1 + random_.Below(4);
    for (size_t i = 0; i < mirrors; ++i) HangMirror();
    PlaceStarts();
    return std::move(made_);
  }

 private:
  double Between(double low, double high) { return random_.Between(low, high); }

  // Walls of boxes with openings cut out.
  void LayOut() {
    const size_t count = 2 + random_.Below(2);
    const double depth = Between(3.0, 4.6);
    height_ = Between(2.4, 2.8);
    const double wall = Between(0.08, 0.2);
    double x = 0;
    // The first two are equally wide, so that they can be mirror images.
    const double width = Between(2.8, 4.6);
    for (size_t i = 0; i < count; ++i) {
      const double w = i < 2 ? width : Between(2.8, 4.6);
      rooms_.push_back({Vector2d(x, 0), Vector2d(x + w, depth)});
      x += w + wall;
    }
    const double end = x - wall;
    wall_middle_ = width + 0.5 * wall;
    const bool corridor = random_.Chance(0.5);
    const double corridor_width = Between(1.4, 1.8);
    if (corridor) rooms_.push_back({Vector2d(0, -wall - corridor_width), Vector2d(end, -wall)});
    const double low_y = corridor ? -wall - corridor_width : 0;
    for (const auto& [bottom, top] : {std::pair{-0.2, 0.0}, {height_, height_ + 0.2}}) {
      builder_.Box({-0.2, low_y - 0.2, bottom}, {end + 0.2, depth + 0.2, top},
                   bottom < 0 && random_.Chance(0.15) ? Material::kPolished : Material::kMatte);
    }
    builder_.Box({-0.2, low_y - 0.2, 0}, {0, depth + 0.2, height_});
    builder_.Box({end, low_y - 0.2, 0}, {end + 0.2, depth + 0.2, height_});
    builder_.Box({0, low_y - 0.2, 0}, {end, low_y, height_});
    builder_.Box({0, depth, 0}, {end, depth + 0.2, height_});
    for (size_t i = 0; i + 1 < count; ++i) {
      const double x0 = rooms_[i].max().x();
      const bool joined = !corridor || random_.Chance(0.6);
      DivideWith({Vector2d(x0, 0), Vector2d(x0 + wall, depth)}, 1, joined);
    }
    if (corridor) {
      double from = 0;
      for (size_t i = 0; i < count; ++i) {
        const double to = i + 1 < count ? rooms_[i].max().x() + wall : end;
        DivideWith({Vector2d(from, -wall), Vector2d(to, 0)}, 0, true);
        from = to;
      }
    }
    // Windows: panes before closed walls, as in the pane room.
    for (size_t i = 0; i < count; ++i) {
      if (!random_.Chance(0.5)) continue;
      const double middle = rooms_[i].center().x() + Between(-0.4, 0.4);
      const double half = Between(0.4, 0.8);
      builder_.Quad({{{middle - half, depth - 0.02, 0.9},
                      {middle + half, depth - 0.02, 0.9},
                      {middle + half, depth - 0.02, 2.1},
                      {middle - half, depth - 0.02, 2.1}}},
                    Material::kGlass);
      taken_.push_back({Vector2d(middle - half, depth - 0.3), Vector2d(middle + half, depth)});
    }
  }

  // A wall along an axis, with a doorway when it joins its rooms, and perhaps a hatch.
  void DivideWith(const AlignedBox2d& wall, int axis, bool joined) {
    const double length = wall.sizes()[axis];
    struct Cut {
      double from, to, sill, head;
    };
    std::vector<Cut> cuts;
    if (joined) {
      const double width = Between(0.75, 1.0);
      const double from = Between(0.25, length - width - 0.25);
      cuts.push_back({from, from + width, 0, Between(1.95, 2.1)});
    }
    const bool hatch = random_.Chance(0.35);
    const double hatch_width = Between(0.5, 1.2);
    const double at = Between(0.2, std::max(0.21, length - hatch_width - 0.2));
    if (hatch && std::all_of(cuts.begin(), cuts.end(), [&](const Cut& cut) {
          return at > cut.to + 0.2 || at + hatch_width < cut.from - 0.2;
        })) {
      cuts.push_back({at, at + hatch_width, Between(0.8, 1.1), 2.0});
    }
    std::sort(cuts.begin(), cuts.end(), [](const Cut& a, const Cut& b) { return a.from < b.from; });
    const auto block = [&](double from, double to, double bottom, double top) {
      if (to - from < 1e-6 || top - bottom < 1e-6) return;
      Vector3d low(wall.min().x(), wall.min().y(), bottom);
      Vector3d high(wall.max().x(), wall.max().y(), top);
      low[axis] = wall.min()[axis] + from;
      high[axis] = wall.min()[axis] + to;
      builder_.Box(low, high);
    };
    double done = 0;
    for (const Cut& cut : cuts) {
      block(done, cut.from, 0, height_);
      block(cut.from, cut.to, 0, cut.sill);
      block(cut.from, cut.to, cut.head, height_);
      done = cut.to;
      Vector3d low(wall.min().x(), wall.min().y(), cut.sill);
      Vector3d high(wall.max().x(), wall.max().y(), cut.head);
      low[axis] = wall.min()[axis] + cut.from;
      high[axis] = wall.min()[axis] + cut.to;
      made_.openings.emplace_back(low, high);
      AlignedBox2d zone(Vector2d(low.head<2>()), Vector2d(high.head<2>()));
      zone.min()[1 - axis] -= kOpeningZone;
      zone.max()[1 - axis] += kOpeningZone;
      taken_.push_back(zone);
    }
    block(done, length, 0, height_);
  }

  bool Free(const AlignedBox2d& box, double gap) const {
    return std::none_of(taken_.begin(), taken_.end(), [&](const AlignedBox2d& other) {
      return Grown(box, gap).intersects(other);
    });
  }

  // Where an item of a size stands with its back at `at` of a side.
  static AlignedBox2d FootprintOf(const Side& side, double at, double width, double depth) {
    AlignedBox2d box;
    box.extend(Vector2d(side.from + (at - 0.5 * width) * side.along));
    box.extend(Vector2d(side.from + (at + 0.5 * width) * side.along + depth * side.inward));
    return box;
  }
  static Eigen::Isometry3d FrameAt(const Side& side, double at) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    const Vector2d back = side.from + at * side.along;
    T.translation() = Vector3d(back.x(), back.y(), 0);
    T.linear().col(0) = Vector3d(side.along.x(), side.along.y(), 0);
    T.linear().col(1) = Vector3d(side.inward.x(), side.inward.y(), 0);
    return T;
  }

  // Four to seven pieces along the walls, and one in the middle. With `mirrored` (m, x), as the
  // room on the other side of that plane was furnished with the same details; what has no place
  // there is left out.
  void Furnish(size_t room, uint64_t details, std::optional<double> mirrored) {
    using Add = void (*)(const Item&, RandomSequence&, MeshBuilder&);
    constexpr std::array<Add, 8> kPieces = {AddShelf, AddWardrobe, AddSideboard, AddSofa,
                                            AddPlant, AddDesk,     AddTable,     AddFloorLamp};
    RandomSequence random(details);
    const AlignedBox2d inside = mirrored ? rooms_[room - 1] : rooms_[room];
    const std::array<Side, 4> sides = SidesOf(inside);
    const size_t pieces = 4 + random.Below(4);
    for (size_t i = 0; i < pieces; ++i) {
      const Side& side = sides[random.Below(sides.size())];
      const Add add = kPieces[random.Below(kPieces.size())];
      const bool slender = add == AddPlant || add == AddFloorLamp;
      const double width = slender ? 0.45 : random.Between(0.8, 1.6);
      const double depth = slender ? 0.45 : random.Between(0.35, 0.7);
      const double height = random.Between(0.75, 2.0);
      const double at =
          random.Between(0.5 * width, std::max(0.51 * width, side.length - 0.5 * width));
      const uint64_t look = random.Bits();
      AlignedBox2d footprint = FootprintOf(side, at, width, depth);
      Eigen::Isometry3d T = FrameAt(side, at);
      if (mirrored) {
        const AlignedBox2d there(
            Vector2d(2 * *mirrored - footprint.max().x(), footprint.min().y()),
            Vector2d(2 * *mirrored - footprint.min().x(), footprint.max().y()));
        footprint = there;
        T.translation().x() = 2 * *mirrored - T.translation().x();
        T.linear().row(0) = -T.linear().row(0);
      }
      if (!Free(footprint, kBetweenPieces)) continue;
      taken_.push_back(footprint);
      builder_.SetFrame(T);
      RandomSequence looks(look);
      const double low = add == AddDesk || add == AddTable || add == AddSideboard || add == AddSofa
                             ? 0.75
                             : height;
      add({width, depth, low}, looks, builder_);
    }
    builder_.SetFrame(Eigen::Isometry3d::Identity());
  }

  void HangMirror() {
    for (int attempt = 0; attempt < 20; ++attempt) {
      const AlignedBox2d& room = rooms_[random_.Below(rooms_.size())];
      const Side side = SidesOf(room)[random_.Below(4)];
      const double width = Between(0.35, std::min(1.6, side.length - 0.3));
      const double at = Between(0.5 * width + 0.1, side.length - 0.5 * width - 0.1);
      const bool wardrobe = random_.Chance(0.25);
      const double bottom = random_.Chance(0.4) ? Between(0.05, 0.3) : Between(0.7, 1.2);
      const double top = std::min(2.1, bottom + Between(0.4, 1.9));
      const double before = wardrobe ? 0.6 : 0;
      const double proud = wardrobe ? 0.01 : Between(0.01, 0.06);
      const double askew = wardrobe ? 0 : Between(-1, 1) * std::numbers::pi / 180;
      const double lean = wardrobe ? 0 : Between(0, 1) * std::numbers::pi / 180;
      const bool hidden = !wardrobe && random_.Chance(0.5);
      const double cover_width = Between(0.4, 1.0) * width;
      const double cover_at = at + Between(-0.4, 0.4) * width;
      const double cover_depth = Between(0.3, 0.5);
      const double cover_height = bottom + Between(0.1, 0.5) * (top - bottom);
      const double frame = Between(0.005, 0.04);
      // A mirror needs its wall, and what stands before it its place.
      const AlignedBox2d place = FootprintOf(side, at, width, before + 0.05);
      if (!Free(place, 0.02)) continue;
      const AlignedBox2d cover = FootprintOf(side, cover_at, cover_width, cover_depth);
      if (hidden && (!Free(cover, 0.02) || !InARoom(cover))) continue;
      taken_.push_back(place);
      builder_.SetFrame(FrameAt(side, at));
      if (wardrobe) {
        builder_.Box({-0.5 * width - 0.02, 0, 0}, {0.5 * width + 0.02, before, top + 0.03});
      }
      const Eigen::Isometry3d T =
          FrameAt(side, at) * Eigen::Translation3d(0, before + proud, 0.5 * (bottom + top)) *
          Eigen::AngleAxisd(askew, Vector3d::UnitZ()) * Eigen::AngleAxisd(lean, Vector3d::UnitX());
      builder_.SetFrame(T);
      const double x = 0.5 * width;
      const double z = 0.5 * (top - bottom);
      builder_.Quad({{{-x, 0, -z}, {x, 0, -z}, {x, 0, z}, {-x, 0, z}}}, Material::kMirror);
      if (!wardrobe) {
        builder_.Box({-x - frame, -std::min(0.02, proud), -z - frame},
                     {x + frame, -0.005, z + frame});
      }
      if (hidden) {
        builder_.SetFrame(FrameAt(side, cover_at));
        if (random_.Chance(0.5)) {
          builder_.Box({-0.5 * cover_width, 0.08, 0},
                       {0.5 * cover_width, cover_depth, cover_height});
        } else {
          AddPlant({cover_width, cover_depth, cover_height + 0.3}, random_, builder_);
        }
        taken_.push_back(cover);
      }
      builder_.SetFrame(Eigen::Isometry3d::Identity());
      return;
    }
  }

  bool InARoom(const AlignedBox2d& box) const {
    return std::any_of(rooms_.begin(), rooms_.end(),
                       [&](const AlignedBox2d& room) { return room.contains(box); });
  }

  // In rooms in turn, from a room on that is drawn.
  void PlaceStarts() {
    std::vector<AlignedBox2d> solid;
    for (size_t turn = random_.Below(rooms_.size()), tries = 0;
         made_.scene.starts.size() < kStarts && tries < 400; ++tries) {
      const AlignedBox2d inside = Grown(rooms_[turn % rooms_.size()], -kClearOfStart);
      const double x = Between(inside.min().x(), inside.max().x());
      const double y = Between(inside.min().y(), inside.max().y());
      const double z = Between(1.2, 1.8);
      const AlignedBox2d stands(Vector2d(x - 0.3, y - 0.3), Vector2d(x + 0.3, y + 0.3));
      // What is kept free before openings is no obstacle, but seldom drawn.
      if (!Free(stands, 0.05)) continue;
      made_.scene.starts.emplace_back(x, y, z);
      ++turn;
    }
  }

  RandomSequence random_;
  MirrorScene made_;
  MeshBuilder builder_;
  std::vector<AlignedBox2d> rooms_;
  std::vector<AlignedBox2d> taken_;  // furniture, and what stays free before openings
  double height_ = 0;
  double wall_middle_ = 0;  // m, x: of the wall between the first two rooms
};

}  // namespace

MirrorScene RandomMirrorScene(uint64_t seed) { return MirrorSceneMaker(seed).Make(); }

}  // namespace vantage::simulation

#include "core/simulation/scenes/furniture.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vantage::simulation {
namespace {

// Four legs under the corners of a rectangle.
void AddLegs(double width, double back, double front, double height, double thickness,
             MeshBuilder& builder) {
  for (const double x : {-0.5 * width + thickness, 0.5 * width - thickness}) {
    for (const double y : {back + thickness, front - thickness}) {
      builder.Box({x - 0.5 * thickness, y - 0.5 * thickness, 0},
                  {x + 0.5 * thickness, y + 0.5 * thickness, height});
    }
  }
}

// Doors or drawers: thin plates on the front of a box with gaps between them.
void AddFronts(double left, double right, double y, double bottom, double top, int count,
               MeshBuilder& builder) {
  const double step = (right - left) / count;
  for (int i = 0; i < count; ++i) {
    const double x = left + i * step;
    builder.Box({x + 0.005, y, bottom + 0.005}, {x + step - 0.005, y + 0.02, top - 0.005});
    builder.Box({x + step - 0.06, y + 0.02, 0.5 * (bottom + top) - 0.06},
                {x + step - 0.045, y + 0.04, 0.5 * (bottom + top) + 0.06});
  }
}

void AddMirror(double width, double bottom, double top, double y, MeshBuilder& builder) {
  const double x = 0.5 * width;
  builder.Quad({Eigen::Vector3d(-x, y, bottom), Eigen::Vector3d(x, y, bottom),
                Eigen::Vector3d(x, y, top), Eigen::Vector3d(-x, y, top)},
               Material::kMirror);
  // Its back and frame.
  builder.Box({-x - 0.03, y - 0.03, bottom - 0.03}, {x + 0.03, y - 0.005, top + 0.03});
}

}  // namespace

void AddObjects(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double z, int count,
                RandomSequence& random, MeshBuilder& builder) {
  for (int i = 0; i < count; ++i) {
    const double size = random.Between(0.06, 0.16);
    const double inset = 0.75 * size;
    if (high.x() - low.x() < 2 * inset || high.y() - low.y() < 2 * inset) continue;
    // One draw a statement: the order of arguments is the compiler's.
    const double x = random.Between(low.x() + inset, high.x() - inset);
    const double y = random.Between(low.y() + inset, high.y() - inset);
    const Eigen::Vector3d at(x, y, z);
    const double height = random.Between(0.03, 0.28);
    if (random.Chance(0.4)) {
      builder.Cylinder(at, 0.45 * size, random.Between(0.3, 0.5) * size, height, 10);
    } else {
      const double depth = random.Between(0.6, 1.0) * size;
      const double yaw = random.Between(0, std::numbers::pi);
      builder.TurnedBox(at, {size, depth, height}, yaw,
                        random.Chance(0.1) ? Material::kDark : Material::kMatte);
    }
  }
}

void AddTable(const Item& item, RandomSequence& random, MeshBuilder& builder) {
  const double x = 0.5 * item.width;
  builder.Box({-x, 0, item.height - 0.04}, {x, item.depth, item.height});
  AddLegs(item.width, 0, item.depth, item.height - 0.04, 0.06, builder);
  builder.Box({-x + 0.08, 0.06, item.height - 0.12}, {x - 0.08, 0.08, item.height - 0.04});
  builder.Box({-x + 0.08, item.depth - 0.08, item.height - 0.12},
              {x - 0.08, item.depth - 0.06, item.height - 0.04});
  AddObjects({-x, 0}, {x, item.depth}, item.height, 3 + static_cast<int>(random.Below(4)), random,
             builder);
}

void AddChair(const Item& item, RandomSequence& random, MeshBuilder& builder) {
  const double x = 0.5 * item.width;
  constexpr double kSeat = 0.46;
  builder.Box({-x, 0, kSeat - 0.04}, {x, item.depth, kSeat});
  AddLegs(item.width, 0, item.depth, kSeat - 0.04, 0.035, builder);
  builder.Box({-x, 0, kSeat}, {-x + 0.035, 0.035, item.height});
  builder.Box({x - 0.035, 0, kSeat}, {x, 0.035, item.height});
  const double lowest = random.Between(0.55, 0.7);
  builder.Box({-x + 0.035, 0.005, lowest}, {x - 0.035, 0.03, item.height});
}

void AddSofa(const Item& item, RandomSequence& random, MeshBuilder& builder) {
  const double x = 0.5 * item.width;
  builder.Box({-x, 0.1, 0.08}, {x, item.depth, 0.28});
  builder.Box({-x, 0, 0.08}, {x, 0.22, item.height});
  builder.Box({-x, 0.22, 0.28}, {-x + 0.18, item.depth, 0.6});
  builder.Box({x - 0.18, 0.22, 0.28}, {x, item.depth, 0.6});
  const int seats = item.width > 1.9 ? 3 : 2;
  const double seat = (item.width - 0.36) / seats;
  for (int i = 0; i < seats; ++i) {
    const double left = -x + 0.18 + i * seat;
    builder.Box({left + 0.01, 0.24, 0.28}, {left + seat - 0.01, item.depth - 0.02, 0.43});
    if (random.Chance(0.6)) {
      builder.TurnedBox({left + 0.5 * seat, 0.36, 0.43}, {0.42, 0.14, 0.36},
                        random.Between(-0.4, 0.4));
    }
  }
  AddLegs(item.width, 0.1, item.depth, 0.08, 0.05, builder);
}

void AddBed(const Item& item, RandomSequence& random, MeshBuilder& builder) {
  const double x = 0.5 * item.width;
  builder.Box({-x, 0, 0.1}, {x, 0.06, item.height});
  builder.Box({-x, 0.06, 0.18}, {x, item.depth, 0.32});
  builder.Box({-x + 0.03, 0.08, 0.32}, {x - 0.03, item.depth - 0.03, 0.5});
  AddLegs(item.width, 0, item.depth, 0.18, 0.06, builder);
  const int pillows = item.width > 1.2 ? 2 : 1;
  for (int i = 0; i < pillows; ++i) {
    const double middle = pillows == 1 ? 0 : (i == 0 ? -0.25 : 0.25) * item.width;
    builder.TurnedBox({middle, 0.4, 0.5}, {0.6, 0.4, 0.13}, random.Between(-0.2, 0.2));
  }
  // A blanket, folded somewhere over the foot.
  const double from = random.Between(0.5, 0.7) * item.depth;
  builder.Box({-x + 0.01, from, 0.5}, {x - 0.01, item.depth - 0.1, 0.56});
}

void AddShelf(const Item& item, RandomSequence& random, MeshBuilder& builder) {
  const double x = 0.5 * item.width;
  constexpr double kBoard = 0.02;
  builder.Box({-x, 0, 0}, {-x + kBoard, item.depth, item.height});
  builder.Box({x - kBoard, 0, 0}, {x, item.depth, item.height});
  builder.Box({-x + kBoard, 0, 0}, {x - kBoard, 0.01, item.height});
  const int boards = std::max(2, static_cast<int>(item.height / 0.36));
  for (int i = 0; i <= boards; ++i) {
    const double z = 0.05 + i * (item.height - 0.05 - kBoard) / boards;
    builder.Box({-x + kBoard, 0.01, z}, {x - kBoard, item.depth, z + kBoard});
    if (i == boards) break;
    const double room = (item.height - 0.05 - kBoard) / boards - kBoard;
    // Books from the left, as far as they go; then perhaps some object.
    double at = -x + kBoard + 0.01;
    const double until = -x + random.Between(0.3, 0.95) * item.width;
    while (at < until) {
      const double thickness = random.Between(0.02, 0.06);
      if (at + thickness > x - kBoard) break;
      const double height = std::min(room - 0.02, random.Between(0.18, 0.3));
      const double depth = std::min(item.depth - 0.03, random.Between(0.14, 0.24));
      builder.Box({at, 0.012, z + kBoard},
                  {at + thickness - 0.002, 0.012 + depth, z + kBoard + height});
      at += thickness;
    }
    if (x - kBoard - at > 0.3) {
      const double size = random.Between(0.1, 0.18);
      builder.TurnedBox({0.5 * (at + x), 0.5 * item.depth, z + kBoard},
                        {size, std::min(size, 0.5 * item.depth), std::min(0.8 * room, 0.25)},
                        random.Between(-0.3, 0.3));
    }
  }
}

void AddWardrobe(const Item& item, RandomSequence& random, MeshBuilder& builder) {
  const double x = 0.5 * item.width;
  builder.Box({-x, 0, 0}, {x, item.depth - 0.025, item.height});
  AddFronts(-x, x, item.depth - 0.025, 0.06, item.height, std::max(2, int(item.width / 0.5)),
            builder);
  if (random.Chance(0.6)) {
    AddObjects({-x, 0}, {x, item.depth}, item.height, 2, random, builder);
  }
}

void AddKitchen(const Item& item, RandomSequence& random, MeshBuilder& builder) {
  const double x = 0.5 * item.width;
  constexpr double kTop = 0.9;
  constexpr double kFridge = 0.6;
  // Base cabinets with a plinth, worktop, a sink and a hob.
  builder.Box({-x, 0, 0.1}, {x - kFridge, item.depth - 0.05, kTop - 0.04});
  builder.Box({-x, 0.05, 0}, {x - kFridge, item.depth - 0.12, 0.1});
  const int doors = std::max(2, static_cast<int>((item.width - kFridge) / 0.55));
  AddFronts(-x, x - kFridge, item.depth - 0.05, 0.1, kTop - 0.04, doors, builder);
  builder.Box({-x, 0, kTop - 0.04}, {x - kFridge, item.depth - 0.01, kTop});
  const double sink = -x + random.Between(0.2, 0.35) * (item.width - kFridge);
  builder.Box({sink - 0.25, 0.1, kTop}, {sink + 0.25, 0.5, kTop + 0.01});
  builder.Cylinder({sink, 0.08, kTop}, 0.02, 0.015, 0.25, 8);
  builder.Box({sink - 0.01, 0.08, kTop + 0.23}, {sink + 0.01, 0.25, kTop + 0.25});
  const double hob = x - kFridge - 0.45;
  builder.Box({hob - 0.28, 0.06, kTop}, {hob + 0.28, 0.54, kTop + 0.008}, Material::kDark);
  if (random.Chance(0.7)) builder.Cylinder({hob - 0.12, 0.2, kTop + 0.008}, 0.1, 0.1, 0.14);
  AddObjects({-x, 0.05}, {x - kFridge - 0.8, 0.5}, kTop, 4, random, builder);
  // Fridge.
  builder.Box({x - kFridge + 0.01, 0.02, 0.03}, {x - 0.01, item.depth - 0.03, 1.8});
  AddFronts(x - kFridge + 0.01, x - 0.01, item.depth - 0.03, 0.7, 1.8, 1, builder);
  AddFronts(x - kFridge + 0.01, x - 0.01, item.depth - 0.03, 0.05, 0.7, 1, builder);
  // Wall cabinets and a hood over the hob.
  const double hood = hob - 0.3;
  builder.Box({-x, 0, 1.45}, {hood, 0.33, item.height});
  AddFronts(-x, hood, 0.33, 1.45, item.height, std::max(1, static_cast<int>((hood + x) / 0.5)),
            builder);
  builder.Box({hood + 0.02, 0, 1.55}, {hob + 0.28, 0.45, 1.63});
  builder.Box({hob - 0.12, 0, 1.63}, {hob + 0.12, 0.25, item.height});
}

void AddSideboard(const Item& item, RandomSequence& random, MeshBuilder& builder) {
  const double x = 0.5 * item.width;
  constexpr double kTop = 0.5;
  builder.Box({-x, 0, 0.06}, {x, item.depth - 0.03, kTop});
  AddFronts(-x, x, item.depth - 0.03, 0.06, kTop, 3, builder);
  AddLegs(item.width, 0, item.depth - 0.03, 0.06, 0.05, builder);
  const double half = std::min(x - 0.1, 0.62);
  const double turn = random.Between(-0.1, 0.1);
  builder.TurnedBox({0, 0.2, kTop}, {0.4, 0.2, 0.02}, turn);
  builder.TurnedBox({0, 0.2, kTop + 0.02}, {0.06, 0.04, 0.08}, turn);
  builder.TurnedBox({0, 0.2, kTop + 0.08}, {2 * half, 0.05, 1.1 * half}, turn, Material::kDark);
  AddObjects({half + 0.02, 0}, {x, item.depth - 0.05}, kTop, 1, random, builder);
}

void AddDesk(const Item& item, RandomSequence& random, MeshBuilder& builder) {
  const double x = 0.5 * item.width;
  builder.Box({-x, 0, item.height - 0.03}, {x, item.depth, item.height});
  builder.Box({-x + 0.02, 0.03, 0}, {-x + 0.05, item.depth - 0.05, item.height - 0.03});
  builder.Box({x - 0.42, 0.03, 0.04}, {x - 0.02, item.depth - 0.05, item.height - 0.03});
  AddFronts(x - 0.42, x - 0.02, item.depth - 0.05, 0.06, item.height - 0.05, 1, builder);
  builder.Box({-x + 0.05, 0.03, 0.3}, {x - 0.42, 0.05, item.height - 0.03});
  const double turn = random.Between(-0.3, 0.3);
  builder.TurnedBox({0, 0.22, item.height}, {0.24, 0.2, 0.015}, turn);
  builder.TurnedBox({0, 0.2, item.height + 0.015}, {0.05, 0.04, 0.12}, turn);
  builder.TurnedBox({0, 0.22, item.height + 0.1}, {0.56, 0.03, 0.34}, turn, Material::kDark);
  builder.TurnedBox({0, 0.5 * item.depth + 0.15, item.height}, {0.44, 0.14, 0.02},
                    random.Between(-0.1, 0.1));
  AddObjects({-x, 0.05}, {-0.3, item.depth}, item.height, 3, random, builder);
}

void AddBathtub(const Item& item, RandomSequence& random, MeshBuilder& builder) {
  const double x = 0.5 * item.width;
  const double rim = 0.07;
  builder.Box({-x, 0, 0}, {x, rim, item.height});
  builder.Box({-x, item.depth - rim, 0}, {x, item.depth, item.height});
  builder.Box({-x, rim, 0}, {-x + rim, item.depth - rim, item.height});
  builder.Box({x - rim, rim, 0}, {x, item.depth - rim, item.height});
  builder.Box({-x + rim, rim, 0}, {x - rim, item.depth - rim, 0.12});
  builder.Box({x - 0.2, 0.5 * item.depth - 0.02, item.height},
              {x - 0.02, 0.5 * item.depth + 0.02, item.height + random.Between(0.1, 0.2)});
}

void AddToilet(const Item& item, RandomSequence& random, MeshBuilder& builder) {
  const double x = 0.5 * item.width;
  builder.Box({-x, 0, 0.38}, {x, 0.17, item.height});
  builder.Cylinder({0, 0.4, 0}, 0.12, 0.19, 0.38);
  builder.Cylinder({0, 0.4, 0.38}, 0.2, 0.2, 0.04);
  builder.Box({-0.1, 0.02, 0}, {0.1, 0.35, 0.38});
  if (random.Chance(0.7)) builder.Cylinder({x - 0.03, 0.08, item.height}, 0.05, 0.05, 0.1, 10);
}

void AddWashstand(const Item& item, RandomSequence& random, MeshBuilder& builder) {
  const double x = 0.5 * item.width;
  builder.Box({-x + 0.03, 0, 0.3}, {x - 0.03, item.depth - 0.08, 0.72});
  AddFronts(-x + 0.03, x - 0.03, item.depth - 0.08, 0.3, 0.72, 2, builder);
  builder.Box({-x, 0, 0.72}, {x, item.depth, 0.8});
  builder.Box({-x, 0, 0.8}, {-x + 0.05, item.depth, 0.86});
  builder.Box({x - 0.05, 0, 0.8}, {x, item.depth, 0.86});
  builder.Box({-x + 0.05, item.depth - 0.05, 0.8}, {x - 0.05, item.depth, 0.86});
  builder.Cylinder({0, 0.08, 0.8}, 0.02, 0.02, 0.16, 8);
  AddMirror(item.width - 0.1, 1.1, random.Between(1.75, 1.95), 0.035, builder);
}

void AddDresser(const Item& item, RandomSequence& random, MeshBuilder& builder) {
  const double x = 0.5 * item.width;
  constexpr double kTop = 0.8;
  builder.Box({-x, 0, 0.05}, {x, item.depth - 0.03, kTop});
  for (int i = 0; i < 3; ++i) {
    AddFronts(-x, x, item.depth - 0.03, 0.05 + 0.25 * i, 0.3 + 0.25 * i, 1, builder);
  }
  AddMirror(item.width - 0.2, kTop + 0.15, item.height, 0.035, builder);
  AddObjects({-x, 0.1}, {x, item.depth}, kTop, 4, random, builder);
}

void AddPlant(const Item& item, RandomSequence& random, MeshBuilder& builder) {
  const Eigen::Vector3d middle(0, 0.5 * item.depth, 0);
  const double pot = 0.35 * item.width;
  builder.Cylinder(middle, 0.75 * pot, pot, 0.3);
  const Eigen::Isometry3d outer = builder.frame();
  const int leaves = 12 + static_cast<int>(random.Below(10));
  for (int i = 0; i < leaves; ++i) {
    // Leaves rise from the pot and bend outwards.
    const double rise = random.Between(0.35, 1.3);
    const double length = random.Between(0.3, item.height - 0.35);
    builder.SetFrame(
        outer * Eigen::Translation3d(middle + Eigen::Vector3d(0, 0, 0.3)) *
        Eigen::AngleAxisd(random.Between(0, 2 * std::numbers::pi), Eigen::Vector3d::UnitZ()) *
        Eigen::AngleAxisd(-rise, Eigen::Vector3d::UnitY()));
    const double reach = std::min(length, 0.5 * item.width / std::max(0.2, std::cos(rise)));
    const double half = random.Between(0.02, 0.05);
    builder.Quad({Eigen::Vector3d(0, -0.3 * half, 0), Eigen::Vector3d(0.6 * reach, -half, 0.02),
                  Eigen::Vector3d(reach, 0, 0), Eigen::Vector3d(0.6 * reach, half, 0.02)});
  }
  builder.SetFrame(outer);
}

void AddFloorLamp(const Item& item, RandomSequence& random, MeshBuilder& builder) {
  const Eigen::Vector3d middle(0, 0.5 * item.depth, 0);
  builder.Cylinder(middle, 0.14, 0.14, 0.03);
  builder.Cylinder(middle + Eigen::Vector3d(0, 0, 0.03), 0.012, 0.012, item.height - 0.3, 8);
  builder.Cylinder(middle + Eigen::Vector3d(0, 0, item.height - 0.3), 0.5 * item.width - 0.01,
                   random.Between(0.08, 0.14), 0.28);
}

void AddClutter(const Item& item, RandomSequence& random, MeshBuilder& builder) {
  const double x = 0.5 * item.width;
  // Boxes and bags on the floor, some stacked.
  double z = 0;
  double width = 0.85 * item.width;
  double depth = 0.85 * item.depth;
  for (int i = 0; i < 3 && z < item.height; ++i) {
    const double height = std::min(item.height - z, random.Between(0.12, 0.3));
    const double shift = random.Between(-0.04, 0.04);
    const double yaw = random.Between(-0.12, 0.12);
    builder.TurnedBox({shift, 0.5 * item.depth, z}, {width, depth, height}, yaw,
                      random.Chance(0.2) ? Material::kDark : Material::kMatte);
    z += height;
    width *= random.Between(0.6, 0.9);
    depth *= random.Between(0.6, 0.9);
    if (random.Chance(0.4)) break;
  }
  if (z < item.height) {
    AddObjects({-0.5 * x, 0.25 * item.depth}, {0.5 * x, 0.75 * item.depth}, z, 1, random, builder);
  }
}

void AddPillar(const Item& item, RandomSequence& random, MeshBuilder& builder) {
  const Eigen::Vector3d middle(0, 0.5 * item.depth, 0);
  if (random.Chance(0.5)) {
    builder.Cylinder(middle, 0.5 * item.width, 0.5 * item.width, item.height, 24);
  } else {
    builder.Box({-0.5 * item.width, 0, 0}, {0.5 * item.width, item.depth, item.height});
  }
}

void AddCeilingLamp(double ceiling, RandomSequence& random, MeshBuilder& builder) {
  const double drop = random.Between(0.1, 0.45);
  builder.Cylinder({0, 0, ceiling - 0.04}, 0.06, 0.06, 0.04, 12);
  builder.Cylinder({0, 0, ceiling - drop}, 0.008, 0.008, drop - 0.04, 6);
  builder.Cylinder({0, 0, ceiling - drop - 0.18}, random.Between(0.16, 0.26), 0.05, 0.18);
}

}  // namespace vantage::simulation

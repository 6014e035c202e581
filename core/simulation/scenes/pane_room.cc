#include "core/simulation/scenes/pane_room.h"

#include "core/simulation/scenes/furniture.h"
#include "core/simulation/scenes/mesh_builder.h"

namespace vantage::simulation {

Scene PaneRoom(const Panes& panes) {
  const auto unless_plain = [](bool special, Material material) {
    return special ? material : Material::kMatte;
  };
  Scene scene;
  scene.name = "pane room";
  MeshBuilder builder(scene.mesh);
  const Eigen::Vector3d size(5.2, 4.2, 2.6);
  const double x = size.x(), y = size.y(), z = size.z();
  builder.Quad({{{0, 0, 0}, {x, 0, 0}, {x, y, 0}, {0, y, 0}}},
               unless_plain(panes.polished_floor, Material::kPolished));
  builder.Quad({{{0, 0, z}, {x, 0, z}, {x, y, z}, {0, y, z}}});
  builder.Quad({{{0, 0, 0}, {x, 0, 0}, {x, 0, z}, {0, 0, z}}});
  builder.Quad({{{0, y, 0}, {x, y, 0}, {x, y, z}, {0, y, z}}});
  builder.Quad({{{0, 0, 0}, {0, y, 0}, {0, y, z}, {0, 0, z}}});
  builder.Quad({{{x, 0, 0}, {x, y, 0}, {x, y, z}, {x, 0, z}}});

  // Panes hang before closed walls: what is behind glass is never seen here, nor behind a mirror.
  const Material glass = unless_plain(panes.windows, Material::kGlass);
  const double in = 0.02;
  builder.Quad({{{x - in, 1.2, 0.9}, {x - in, 2.8, 0.9}, {x - in, 2.8, 2.2}, {x - in, 1.2, 2.2}}},
               glass);
  builder.Quad({{{1.0, y - in, 0.9}, {2.2, y - in, 0.9}, {2.2, y - in, 2.2}, {1.0, y - in, 2.2}}},
               glass);
  builder.Quad({{{2.4, 0.03, 0.05}, {3.7, 0.03, 0.05}, {3.7, 0.03, 2.0}, {2.4, 0.03, 2.0}}},
               unless_plain(panes.mirror, Material::kMirror));

  builder.Box({0.0, 0.4, 0}, {0.55, 1.6, 1.9}, unless_plain(panes.dark_cupboard, Material::kDark));
  builder.Box({3.4, 3.6, 0}, {4.6, 4.2, 0.75});
  builder.Box({4.7, 0.2, 0}, {5.1, 0.7, 1.1});
  RandomSequence random(20061);
  const auto placed = [](double at_x, double at_y, double yaw) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translate(Eigen::Vector3d(at_x, at_y, 0));
    T.rotate(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
    return T;
  };
  builder.SetFrame(placed(2.0, 2.75, 0.3));
  AddTable({1.1, 0.7, 0.74}, random, builder);
  builder.SetFrame(placed(1.9, 2.3, 0.2));
  AddChair({0.45, 0.45, 0.9}, random, builder);
  builder.SetFrame(placed(0.35, 3.8, 0.4));
  AddPlant({0.4, 0.4, 1.2}, random, builder);
  scene.starts.emplace_back(3.3, 2.1, 1.5);
  return scene;
}

}  // namespace vantage::simulation

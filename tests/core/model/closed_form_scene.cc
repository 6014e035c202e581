#include "tests/core/model/closed_form_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace vantage::model {

namespace {

Eigen::AlignedBox3d Box(double x0, double y0, double z0, double x1, double y1, double z1) {
  return {Eigen::Vector3d(x0, y0, z0), Eigen::Vector3d(x1, y1, z1)};
}

// Where a ray enters and leaves a box; nothing when it misses.
std::optional<std::pair<double, double>> Slabs(const Eigen::Vector3d& origin,
                                               const Eigen::Vector3d& direction,
                                               const Eigen::Vector3d& low,
                                               const Eigen::Vector3d& high) {
  double enter = -std::numeric_limits<double>::infinity();
  double leave = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    if (direction[i] == 0) {
      if (origin[i] < low[i] || origin[i] > high[i]) return std::nullopt;
      continue;
    }
    double a = (low[i] - origin[i]) / direction[i];
    double b = (high[i] - origin[i]) / direction[i];
    if (a > b) std::swap(a, b);
    enter = std::max(enter, a);
    leave = std::min(leave, b);
  }
  if (enter > leave) return std::nullopt;
  return std::make_pair(enter, leave);
}

double SignedDistance(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& p) {
  const Eigen::Array3d q = ((p - box.center()).cwiseAbs() - 0.5 * box.sizes()).array();
  return q.max(0.0).matrix().norm() + std::min(q.maxCoeff(), 0.0);
}

}  // namespace

double TurnedBox::Distance(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d local = R_world_box.conjugate() * (point - centre);
  return SignedDistance(Eigen::AlignedBox3d(-half, half), local);
}

bool ClosedFormScene::InAir(const Eigen::Vector3d& point) const {
  const bool inside =
      std::any_of(air.begin(), air.end(), [&](const auto& box) { return box.contains(point); });
  return inside && std::none_of(solids.begin(), solids.end(),
                                [&](const auto& s) { return s.Distance(point) < 0; });
}

double ClosedFormScene::DistanceToSurface(const Eigen::Vector3d& point, double limit) const {
  double air_depth = -std::numeric_limits<double>::infinity();  // how far inside the air
  for (const auto& box : air) air_depth = std::max(air_depth, -SignedDistance(box, point));
  double nearest = std::abs(air_depth);
  for (const TurnedBox& solid : solids) {
    nearest = std::min(nearest, std::abs(solid.Distance(point)));
  }
  return std::min(nearest, limit);
}

double ClosedFormScene::Cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                             double limit) const {
  double reached = 0;
  for (bool further = true; further && reached < limit;) {
    further = false;
    for (const auto& box : air) {
      const auto slab = Slabs(origin, direction, box.min(), box.max());
      if (!slab || slab->first > reached + 1e-9 || slab->second <= reached + 1e-9) continue;
      reached = slab->second;
      further = true;
    }
  }
  for (const TurnedBox& solid : solids) {
    const Eigen::Quaterniond R = solid.R_world_box.conjugate();
    const auto slab = Slabs(R * (origin - solid.centre), R * direction, -solid.half, solid.half);
    if (slab && slab->second > 0) reached = std::min(reached, std::max(0.0, slab->first));
  }
  return std::min(reached, limit);
}

ClosedFormScene EmptyRoom() {
  return {"empty room", {Box(-2.52, -2.02, 0.02, 2.53, 1.97, 2.61)}, {}, {{0.3, 0.1, 1.5}}};
}

ClosedFormScene BoxInRoom() {
  ClosedFormScene scene = EmptyRoom();
  scene.name = "box in a room";
  scene.solids.push_back({{1.4, 0.9, 0.45}, {0.4, 0.3, 0.45}});
  scene.stations.push_back({-1.5, -1.2, 1.4});
  return scene;
}

ClosedFormScene RoomWithWindow() {
  ClosedFormScene scene = EmptyRoom();
  scene.name = "window";
  scene.air.push_back(Box(2.4, -0.6, 0.9, 2.7, 0.7, 2.0));
  scene.air.push_back(Box(2.65, -100, -100, 100, 100, 100));
  return scene;
}

ClosedFormScene PillarRoom() {
  ClosedFormScene scene = EmptyRoom();
  scene.name = "pillar";
  scene.solids.push_back({{1.2, -0.4, 1.3},
                          {0.2, 0.2, 1.4},
                          Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()))});
  return scene;
}

ClosedFormScene ThinWallRoom() {
  ClosedFormScene scene = EmptyRoom();
  scene.name = "thin wall";
  scene.solids.push_back({{0.83, -1.0, 1.3}, {0.06, 1.1, 1.4}});
  scene.stations = {{-0.9, -0.7, 1.5}, {1.7, -0.9, 1.5}};
  return scene;
}

ClosedFormScene DoorwayRooms() {
  ClosedFormScene scene;
  scene.name = "room seen through a doorway";
  scene.air = {Box(-3.02, -2.01, 0.02, 0.01, 2.03, 2.52), Box(0.13, -2.01, 0.02, 3.03, 2.03, 2.52),
               Box(-0.1, -0.42, 0.02, 0.2, 0.48, 2.03)};
  scene.stations = {{-1.5, 0.3, 1.5}, {1.6, -0.4, 1.5}};
  return scene;
}

ClosedFormScene TiltedPlanes() {
  ClosedFormScene scene = EmptyRoom();
  scene.name = "tilted planes";
  const auto turn = [](double angle, double x, double y, double z) {
    return Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d(x, y, z).normalized()));
  };
  scene.solids.push_back({{1.6, 1.0, 0.7}, {0.5, 0.4, 0.05}, turn(0.6, 1, 0, 0)});
  scene.solids.push_back({{-1.5, 1.0, 1.0}, {0.6, 0.05, 0.6}, turn(0.8, 1, 0, 1)});
  return scene;
}

std::vector<ClosedFormScene> AllScenes() {
  return {EmptyRoom(),    BoxInRoom(),    RoomWithWindow(), PillarRoom(),
          ThinWallRoom(), DoorwayRooms(), TiltedPlanes()};
}

ClosedFormScene RandomScene(uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  ClosedFormScene scene = DoorwayRooms();
  scene.name = "random " + std::to_string(seed);
  for (int i = 0; i < 12; ++i) {
    // Braces: drawn from left to right, so that every compiler builds the same scene.
    const Eigen::Vector3d axis{uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
    scene.solids.push_back(
        {{uniform(-3, 3), uniform(-2, 2), uniform(0, 2.5)},
         {uniform(0.05, 0.4), uniform(0.05, 0.4), uniform(0.05, 0.4)},
         Eigen::Quaterniond(Eigen::AngleAxisd(uniform(0, 3), axis.normalized()))});
  }
  scene.stations.clear();
  while (scene.stations.size() < 3) {
    const Eigen::Vector3d place{uniform(-2.5, 2.5), uniform(-1.5, 1.5), uniform(1.2, 1.8)};
    if (scene.InAir(place) && scene.DistanceToSurface(place, 1) > 0.5)
      scene.stations.push_back(place);
  }
  return scene;
}

sensor::Scan ScanScene(const ClosedFormScene& scene, const Eigen::Isometry3d& T_world_scan,
                       const ScanOptions& options) {
  sensor::Scan scan;
  scan.scanner.azimuth_step = scan.scanner.elevation_step = options.step;
  scan.scanner.elevation_min = options.elevation_min;
  sensor::RangeImage& image = scan.image;
  const int columns = static_cast<int>(std::floor(2 * sensor::kPi / options.step));
  for (int c = 0; c < columns; ++c)
    image.azimuth.push_back(-sensor::kPi + (c + 0.5) * 2 * sensor::kPi / columns);
  for (double e = options.elevation_min; e <= sensor::kPi / 2 + 1e-9; e += options.step) {
    image.elevation.push_back(std::min(e, sensor::kPi / 2));
  }
  image.native_azimuth_step = 2 * sensor::kPi / columns;
  image.native_elevation_step = options.step;
  std::mt19937_64 random(options.seed);
  std::normal_distribution<double> noise(0, 1);
  for (int c = 0; c < image.columns(); ++c) {
    for (int r = 0; r < image.rows(); ++r) {
      const double range =
          scene.Cast(T_world_scan.translation(), T_world_scan.linear() * image.Direction(c, r), 30);
      if (range > scan.scanner.range_max) {
        image.range.push_back(sensor::RangeImage::kNoReturn);
      } else if (range < scan.scanner.range_min) {
        image.range.push_back(sensor::RangeImage::kNoInformation);
      } else {
        image.range.push_back(static_cast<float>(range + options.noise * noise(random)));
      }
    }
  }
  return scan;
}

Eigen::Isometry3d PoseAt(const Eigen::Vector3d& position, double yaw, double pitch, double roll) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translate(position);
  pose.rotate(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  pose.rotate(Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()));
  pose.rotate(Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()));
  return pose;
}

}  // namespace vantage::model

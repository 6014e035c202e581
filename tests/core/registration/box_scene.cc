#include "tests/core/registration/box_scene.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include "core/model/partial_model.h"
#include "core/parallel/parallel.h"

namespace vantage::registration {

BoxScene::Hit BoxScene::Cast(const Eigen::Vector3d& origin,
                             const Eigen::Vector3d& direction) const {
  Hit hit;
  const auto slabs = [&](const Eigen::AlignedBox3d& box, bool inside) {
    double enter = -1e9;
    double leave = 1e9;
    int enter_axis = 0;
    int leave_axis = 0;
    for (int k = 0; k < 3; ++k) {
      if (std::abs(direction[k]) < 1e-12) {
        if (origin[k] < box.min()[k] || origin[k] > box.max()[k]) return;
        continue;
      }
      double near = (box.min()[k] - origin[k]) / direction[k];
      double far = (box.max()[k] - origin[k]) / direction[k];
      if (near > far) std::swap(near, far);
      if (near > enter) enter = near, enter_axis = k;
      if (far < leave) leave = far, leave_axis = k;
    }
    if (enter > leave) return;
    const double range = inside ? leave : enter;
    const int axis = inside ? leave_axis : enter_axis;
    if (range <= 0 || (hit.range > 0 && range >= hit.range)) return;
    hit.range = range;
    hit.normal.setZero();
    hit.normal[axis] = direction[axis] > 0 ? -1 : 1;
  };
  slabs(room, true);
  for (const Eigen::AlignedBox3d& solid : solids) slabs(solid, false);
  return hit;
}

BoxScene BareRoom() {
  BoxScene scene;
  scene.room = Eigen::AlignedBox3d(Eigen::Vector3d(-3, -2.5, 0), Eigen::Vector3d(3, 2.5, 2.7));
  return scene;
}

BoxScene FurnishedRoom(unsigned seed) {
  BoxScene scene = BareRoom();
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto box = [&](double x, double y, double z, double dx, double dy, double dz) {
    scene.solids.emplace_back(Eigen::Vector3d(x, y, z), Eigen::Vector3d(x + dx, y + dy, z + dz));
  };
  box(-3, -2.5 + 2 * unit(random), 0, 0.5, 1.2, 2.1);     // cupboard
  box(-2 + 2 * unit(random), 2.1, 0, 1.6, 0.4, 0.9);      // sideboard
  box(1.8, -2.5, 0, 0.9, 1.0 + 0.5 * unit(random), 0.5);  // bed
  box(2.7, 0.3 + unit(random), 0.8, 0.3, 0.9, 0.04);      // shelf
  box(2.7, 0.3 + unit(random), 1.3, 0.3, 0.9, 0.04);      // shelf
  const double x = -0.4 + unit(random);
  box(x, 0.7, 0.70, 1.1, 0.7, 0.04);        // table top
  box(x + 0.05, 0.75, 0, 0.06, 0.06, 0.7);  // its legs
  box(x + 0.95, 0.75, 0, 0.06, 0.06, 0.7);
  box(x + 0.05, 1.25, 0, 0.06, 0.06, 0.7);
  box(x + 0.95, 1.25, 0, 0.06, 0.06, 0.7);
  box(-1.5 + unit(random), -2.5, 0, 0.3, 0.3, 2.7);  // column
  return scene;
}

BoxScene Corridor() {
  BoxScene scene;
  scene.room = Eigen::AlignedBox3d(Eigen::Vector3d(-60, -1, 0), Eigen::Vector3d(60, 1, 2.5));
  return scene;
}

sensor::Scan ScanScene(const BoxScene& scene, const Eigen::Isometry3d& T_world_scan,
                       const ScanSettings& settings, unsigned seed) {
  sensor::Scan scan;
  sensor::RangeImage& image = scan.image;
  for (double a = -sensor::kPi; a < sensor::kPi - 0.5 * settings.step; a += settings.step) {
    image.azimuth.push_back(a);
  }
  for (double e = settings.elevation_min; e < sensor::kPi / 2; e += settings.step) {
    image.elevation.push_back(e);
  }
  image.native_azimuth_step = image.native_elevation_step = settings.step;
  scan.scanner.azimuth_step = scan.scanner.elevation_step = settings.step;
  scan.scanner.elevation_min = settings.elevation_min;
  scan.scanner.range_noise = settings.noise;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, settings.noise);
  const auto blind = [&](double elevation) {
    return std::any_of(settings.blind.begin(), settings.blind.end(), [&](const auto& between) {
      return elevation >= between.first && elevation <= between.second;
    });
  };
  for (int c = 0; c < image.columns(); ++c) {
    for (int r = 0; r < image.rows(); ++r) {
      if (blind(image.elevation[static_cast<size_t>(r)])) {
        image.range.push_back(sensor::RangeImage::kNoInformation);
        continue;
      }
      const BoxScene::Hit hit =
          scene.Cast(T_world_scan.translation(), T_world_scan.linear() * image.Direction(c, r));
      const bool in_range = hit.range > 0.5 && hit.range < scan.scanner.range_max;
      image.range.push_back(in_range ? static_cast<float>(hit.range + noise(random))
                                     : sensor::RangeImage::kNoReturn);
    }
  }
  return scan;
}

ViewBuilder::Key ViewBuilder::At(const Eigen::Vector3d& p) const {
  const Eigen::Array3i v = (p / voxel_).array().floor().cast<int>();
  return {v.x(), v.y(), v.z()};
}

void ViewBuilder::AddSample(const Eigen::Vector3d& origin, const Eigen::Vector3d& point,
                            const Eigen::Vector3d& normal) {
  const Eigen::Vector3d ray = point - origin;
  const double length = ray.norm();
  for (double t = 0; t < length - voxel_; t += 0.7 * voxel_) {
    cells_.try_emplace(At(origin + ray * (t / length)));
  }
  Cell& cell = cells_[At(point)];
  cell.sum += point;
  cell.normal += normal;
  ++cell.samples;
}

std::shared_ptr<const model::PlanningView> ViewBuilder::Build() const {
  std::map<std::tuple<int, int, int>, std::map<int, const Cell*>> bricks;
  for (const auto& [key, cell] : cells_) {
    const model::VoxelIndex v(key.x, key.y, key.z);
    const model::VoxelIndex b = model::Brick::Of(v);
    bricks[{b.x(), b.y(), b.z()}][model::Brick::LocalOf(v)] = &cell;
  }
  std::vector<model::BrickAt> list;
  for (const auto& [at, cells] : bricks) {
    auto brick = std::make_shared<model::Brick>();
    for (const auto& [local, cell] : cells) {
      brick->state[local] =
          cell->samples > 0 ? model::VoxelState::kTrueSurface : model::VoxelState::kEmpty;
      if (cell->samples == 0) continue;
      brick->surface_mask[local / 64] |= uint64_t{1} << (local % 64);
      model::SurfaceVoxel voxel;
      voxel.centroid = (cell->sum / cell->samples).cast<float>();
      voxel.normal = cell->normal.normalized().cast<float>();
      voxel.area = static_cast<float>(voxel_ * voxel_ / voxel.normal.cwiseAbs().sum());
      voxel.samples = cell->samples;
      voxel.density = static_cast<float>(cell->samples) / voxel.area;
      brick->surface.push_back(voxel);
    }
    list.push_back({model::VoxelIndex(std::get<0>(at), std::get<1>(at), std::get<2>(at)), brick});
  }
  return std::make_shared<model::PlanningView>(voxel_, 1, std::move(list),
                                               std::vector<model::Station>{});
}

std::shared_ptr<const model::PlanningView> ModelOf(const BoxScene& scene,
                                                   const Eigen::Isometry3d& T_world_scan,
                                                   const ScanSettings& settings,
                                                   double normal_noise, unsigned seed) {
  const sensor::Scan scan = ScanScene(scene, T_world_scan, settings, seed);
  std::mt19937_64 random(seed + 1000);
  std::normal_distribution<double> gauss(0, 1);
  ViewBuilder builder(0.05);
  std::map<std::tuple<int, int, int>, Eigen::Vector3d> tilt;  // one error per voxel
  for (int c = 0; c < scan.image.columns(); ++c) {
    for (int r = 0; r < scan.image.rows(); ++r) {
      const float range = scan.image.at(c, r);
      if (!sensor::RangeImage::IsRange(range)) continue;
      const Eigen::Vector3d direction = T_world_scan.linear() * scan.image.Direction(c, r);
      const Eigen::Vector3d point = T_world_scan.translation() + range * direction;
      const Eigen::Array3i v = (point / 0.05).array().floor().cast<int>();
      auto [it, fresh] = tilt.try_emplace({v.x(), v.y(), v.z()});
      if (fresh) it->second = Eigen::Vector3d(gauss(random), gauss(random), gauss(random));
      Eigen::Vector3d normal = scene.Cast(T_world_scan.translation(), direction).normal;
      normal += normal_noise * (it->second - it->second.dot(normal) * normal);
      builder.AddSample(T_world_scan.translation(), point, normal.normalized());
    }
  }
  return builder.Build();
}

std::shared_ptr<const model::PlanningView> ModelFromScan(const BoxScene& scene,
                                                         const Eigen::Isometry3d& T_world_scan,
                                                         const ScanSettings& settings,
                                                         unsigned seed) {
  parallel::Serial serial;
  const auto partial = model::PartialModel::Create({}).value();
  partial->Insert("first", ScanScene(scene, T_world_scan, settings, seed), T_world_scan, serial)
      .value();
  return partial->Publish();
}

Eigen::Isometry3d PoseAt(const Eigen::Vector3d& position, double yaw, double pitch, double roll) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
                   Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()))
                      .toRotationMatrix();
  pose.translation() = position;
  return pose;
}

Eigen::Isometry3d Disturbed(const Eigen::Isometry3d& pose, double metres, double radians,
                            std::mt19937_64& random) {
  std::normal_distribution<double> gauss(0, 1);
  const auto direction = [&] {
    return Eigen::Vector3d(gauss(random), gauss(random), gauss(random)).normalized();
  };
  Eigen::Isometry3d disturbed = pose;
  disturbed.linear() = Eigen::AngleAxisd(radians, direction()).toRotationMatrix() * pose.linear();
  disturbed.translation() += metres * direction();
  return disturbed;
}

}  // namespace vantage::registration

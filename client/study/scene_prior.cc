#include "client/study/scene_prior.h"

#include <cmath>

#include "core/simulation/random_sequence.h"
#include "core/site_prior/mesh_samples.h"

namespace vantage::study {
namespace {

constexpr double kDrift = 1.015;       // of a tablet's mesh
constexpr double kPlanFrom = 1.85;     // m over the floor: under lintels, over most furniture
constexpr double kPlanTo = 1.95;
constexpr double kPlanPixel = 0.05;    // m
constexpr double kPlanHeight = 2.5;    // m
constexpr double kApart = 6;           // m
constexpr double kPointsOff = 0.45;    // m per axis, at most
constexpr uint64_t kPointsStream = 400;

site_prior::PriorMesh MeshOf(const simulated_job::Site& site) {
  return {site.mesh.vertices, site.mesh.triangles};
}

}  // namespace

site_prior::PlanRaster PlanOfScene(const simulated_job::Site& site) {
  const Eigen::AlignedBox3d box = site.mesh.Bounds();
  site_prior::PlanRaster plan;
  plan.cell = kPlanPixel;
  plan.origin = box.min().head<2>() - Eigen::Vector2d::Constant(2 * kPlanPixel);
  plan.width = static_cast<int>(box.sizes().x() / plan.cell) + 5;
  plan.height = static_cast<int>(box.sizes().y() / plan.cell) + 5;
  plan.wall.assign(static_cast<size_t>(plan.width) * static_cast<size_t>(plan.height), 0);
  site_prior::ForEachMeshSample(
      MeshOf(site), {}, kPlanPixel / 2, [&](const Eigen::Vector3d& p, const auto& normal) {
        const double over = p.z() - site.floor_height;
        if (over < kPlanFrom || over > kPlanTo || std::abs(normal.z()) > 0.3) return;
        const Eigen::Vector2i at =
            ((p.template head<2>() - plan.origin) / plan.cell).array().floor().template cast<int>();
        plan.At(at.x(), at.y()) = 1;
      });
  return plan;
}

absl::StatusOr<site_prior::PriorMesh> MakeScenePrior(const simulated_job::Site& site,
                                                     ScenePriorKind kind) {
  if (kind == ScenePriorKind::kPlan) {
    return site_prior::ExtrudePlan(PlanOfScene(site), site.floor_height, kPlanHeight);
  }
  site_prior::PriorMesh mesh = MeshOf(site);
  const Eigen::Vector3f middle = mesh.Bounds().center();
  for (Eigen::Vector3f& vertex : mesh.vertices) {
    if (kind == ScenePriorKind::kTrue) {
      vertex *= static_cast<float>(kDrift);
    } else {
      vertex.head<2>() = 2 * middle.head<2>() - vertex.head<2>();
    }
  }
  return mesh;
}

std::array<site_prior::PlacedPoint, 2> RoughPoints(const Eigen::Vector3d& start, double floor,
                                                   ScenePriorKind kind,
                                                   const Eigen::Isometry3d& T_world_scene,
                                                   uint64_t seed) {
  std::array<site_prior::PlacedPoint, 2> points;
  for (size_t i = 0; i < points.size(); ++i) {
    Eigen::Vector3d at(start.x() + (i == 0 ? -kApart / 2 : kApart / 2), start.y(), floor);
    points[i].site = T_world_scene * at;
    if (kind == ScenePriorKind::kTrue) at *= kDrift;
    for (int axis = 0; axis < 2; ++axis) {
      const uint64_t bits = simulation::RandomBits(seed, 2 * i + static_cast<uint64_t>(axis),
                                                   kPointsStream);
      const double even = static_cast<double>(bits >> 11) * 0x1.0p-53;
      at[axis] += kPointsOff * (2 * even - 1);
    }
    points[i].prior = at;
  }
  return points;
}

}  // namespace vantage::study

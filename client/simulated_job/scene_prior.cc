#include "client/simulated_job/scene_prior.h"

#include <png.h>

#include <cmath>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_format.h"
#include "client/library/geometry.h"
#include "core/bytes/compression.h"
#include "core/simulation/random_sequence.h"
#include "core/site_prior/mesh_samples.h"

namespace vantage::simulated_job {
namespace {

constexpr double kDrift = 1.015;    // of a tablet's mesh
constexpr double kPlanFrom = 1.85;  // m over the floor: under lintels, over most furniture
constexpr double kPlanTo = 1.95;
constexpr double kPlanPixel = 0.05;  // m
constexpr double kPlanHeight = 2.5;  // m
constexpr double kApart = 6;         // m
constexpr double kPointsOff = 0.45;  // m per axis, at most
constexpr uint64_t kPointsStream = 400;

std::string ObjOf(const site_prior::PriorMesh& mesh) {
  std::string obj;
  for (const Eigen::Vector3f& v : mesh.vertices) {
    absl::StrAppendFormat(&obj, "v %.4f %.4f %.4f\n", v.x(), v.y(), v.z());
  }
  for (const auto& t : mesh.triangles) {
    absl::StrAppendFormat(&obj, "f %d %d %d\n", t[0] + 1, t[1] + 1, t[2] + 1);
  }
  return obj;
}

// Walls black on white, north up.
absl::StatusOr<std::string> PngOf(const site_prior::PlanRaster& plan) {
  std::vector<uint8_t> grey(plan.wall.size());
  for (int y = 0; y < plan.height; ++y) {
    for (int x = 0; x < plan.width; ++x) {
      grey[static_cast<size_t>(plan.height - 1 - y) * static_cast<size_t>(plan.width) +
           static_cast<size_t>(x)] = plan.At(x, y) != 0 ? 0 : 255;
    }
  }
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(plan.width);
  image.height = static_cast<png_uint_32>(plan.height);
  image.format = PNG_FORMAT_GRAY;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string bytes(size, '\0');
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, grey.data(), 0, nullptr) == 0) {
    return absl::InternalError(image.message);
  }
  bytes.resize(size);
  return bytes;
}

site_prior::PriorMesh MeshOf(const Site& site) { return {site.mesh.vertices, site.mesh.triangles}; }

}  // namespace

site_prior::PlanRaster PlanOfScene(const Site& site) {
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

absl::StatusOr<site_prior::PriorMesh> MakeScenePrior(const Site& site, ScenePriorKind kind) {
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
      const uint64_t bits =
          simulation::RandomBits(seed, 2 * i + static_cast<uint64_t>(axis), kPointsStream);
      const double even = static_cast<double>(bits >> 11) * 0x1.0p-53;
      at[axis] += kPointsOff * (2 * even - 1);
    }
    points[i].prior = at;
  }
  return points;
}

absl::StatusOr<v1::SetSitePriorRequest> SitePriorRequestOf(const Site& site, ScenePriorKind kind,
                                                           const Eigen::Isometry3d& T_world_scene,
                                                           uint64_t seed) {
  const auto points = RoughPoints(site.start, site.floor_height, kind, T_world_scene, seed);
  v1::SetSitePriorRequest request;
  v1::SitePrior& prior = *request.mutable_site_prior();
  std::string file;
  site_prior::PlanRaster plan;
  if (kind == ScenePriorKind::kPlan) {
    plan = PlanOfScene(site);
    prior.set_display_name("plan.png");
    prior.set_unit_m(plan.cell);
    const auto png = PngOf(plan);
    if (!png.ok()) return png.status();
    file = *png;
  } else {
    const auto mesh = MakeScenePrior(site, kind);
    if (!mesh.ok()) return mesh.status();
    prior.set_display_name("mesh.obj");
    file = ObjOf(*mesh);
  }
  for (const site_prior::PlacedPoint& placed : points) {
    v1::SitePriorPoint& point = *prior.add_points();
    *point.mutable_site() = client::ToProto(placed.site);
    Eigen::Vector3d in_file = placed.prior;
    if (kind == ScenePriorKind::kPlan) {  // pixels from the upper left corner
      in_file = {(placed.prior.x() - plan.origin.x()) / plan.cell,
                 plan.height - (placed.prior.y() - plan.origin.y()) / plan.cell, 0};
    }
    *point.mutable_prior() = client::ToProto(in_file);
  }
  request.set_uncompressed_size_bytes(static_cast<int64_t>(file.size()));
  request.set_compression(v1::COMPRESSION_ZSTD);
  request.set_file(bytes::ZstdCompress(file, 12));
  return request;
}

}  // namespace vantage::simulated_job

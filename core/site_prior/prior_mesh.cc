#include "core/site_prior/prior_mesh.h"

#include <bit>
#include <cmath>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/site_prior/building_units.h"

namespace vantage::site_prior {
namespace {

constexpr double kNarrowestPrior = 1;  // m: nobody scans less than a room
constexpr double kFlatPrior = 0.5;     // m: nobody stands upright in less
constexpr double kLikelyWidth = 3;     // m
constexpr double kLikelyWidest = 300;  // m

// The cure where the width (m, as it was read) is none of a building.
std::string UnitFor(double width) {
  for (const BuildingUnit& unit : kBuildingUnits) {
    const double meant = width * unit.metres;
    if (meant >= kLikelyWidth && meant <= kLikelyWidest) {
      return absl::StrFormat("give the unit, %s, in which it is %.0f m", unit.name, meant);
    }
  }
  return "give the unit that its coordinates are in";
}

static_assert(std::endian::native == std::endian::little);

}  // namespace

Eigen::AlignedBox3f PriorMesh::Bounds() const {
  Eigen::AlignedBox3f box;
  for (const std::array<uint32_t, 3>& triangle : triangles) {
    for (const uint32_t corner : triangle) box.extend(vertices[corner]);
  }
  return box;
}

absl::Status CheckPrior(const PriorMesh& mesh) {
  if (mesh.triangles.empty()) {
    return absl::InvalidArgumentError(
        "the prior is empty: it has no triangle with an area; give a mesh, or a floor plan with "
        "walls");
  }
  if (mesh.triangles.size() > kMostPriorTriangles) {
    return absl::InvalidArgumentError(
        absl::StrFormat("the prior has %d triangles, more than %d: simplify it, centimetres do",
                        mesh.triangles.size(), kMostPriorTriangles));
  }
  for (const Eigen::Vector3f& vertex : mesh.vertices) {
    if (!vertex.allFinite()) {
      return absl::InvalidArgumentError("the prior has a coordinate that is not finite");
    }
  }
  for (const std::array<uint32_t, 3>& triangle : mesh.triangles) {
    for (const uint32_t corner : triangle) {
      if (corner < mesh.vertices.size()) continue;
      return absl::InvalidArgumentError("the prior has a triangle of a vertex that is not there");
    }
  }
  const Eigen::Vector3d size = mesh.Bounds().sizes().cast<double>();
  const double widest = size.maxCoeff();
  const double wide = std::max(size.x(), size.y());
  if (widest > kWidestPrior) {
    return absl::InvalidArgumentError(
        absl::StrFormat("the prior is %.0f m wide: %s", widest, UnitFor(widest)));
  }
  if (wide < kNarrowestPrior) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "the prior is %.3f m wide, less than a room: give the unit that its coordinates are in",
        wide));
  }
  if (size.z() < kFlatPrior) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "the prior is %.2f m high: nobody stands in it; where its y axis points up, say so",
        size.z()));
  }
  const Eigen::AlignedBox3f box = mesh.Bounds();
  const double farthest = static_cast<double>(
      std::max(box.min().lpNorm<Eigen::Infinity>(), box.max().lpNorm<Eigen::Infinity>()));
  if (farthest > kFarthestPrior) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "the prior lies %.0f km from its own origin, more than %.0f km: move it there",
        farthest / 1000, kFarthestPrior / 1000));
  }
  return absl::OkStatus();
}

absl::StatusOr<PriorMesh> MeshOfModel(const model::PlanningView& model, size_t most) {
  // At most: some of it is false surface.
  if (2 * model.SurfaceCount() > most) {
    size_t squares = 0;
    model.ForEachSurface(
        [&](const model::VoxelIndex&, model::VoxelState state, const model::SurfaceVoxel&) {
          squares += state == model::VoxelState::kTrueSurface ? 1 : 0;
        });
    if (2 * squares > most) {
      return absl::ResourceExhaustedError(absl::StrFormat(
          "its model has %d voxels of surface, more than %d: scan by a smaller job, "
          "or export its mesh and give the part that is to be scanned",
          squares, most / 2));
    }
  }
  PriorMesh mesh;
  const auto half = static_cast<float>(0.5 * model.voxel_size());
  model.ForEachSurface(
      [&](const model::VoxelIndex&, model::VoxelState state, const model::SurfaceVoxel& surface) {
        if (state != model::VoxelState::kTrueSurface) return;
        const Eigen::Vector3f u = half * surface.normal.unitOrthogonal();
        const Eigen::Vector3f v = surface.normal.cross(u);
        const auto first = static_cast<uint32_t>(mesh.vertices.size());
        for (const Eigen::Vector3f& corner : {Eigen::Vector3f(-u - v), Eigen::Vector3f(u - v),
                                              Eigen::Vector3f(u + v), Eigen::Vector3f(v - u)}) {
          mesh.vertices.push_back(surface.centroid + corner);
        }
        mesh.triangles.push_back({first, first + 1, first + 2});
        mesh.triangles.push_back({first, first + 2, first + 3});
      });
  return mesh;
}

std::string EncodePrior(const PriorMesh& mesh) {
  std::string bytes;
  const std::array<uint64_t, 2> counts = {mesh.vertices.size(), mesh.triangles.size()};
  bytes.append(reinterpret_cast<const char*>(counts.data()), sizeof(counts));
  bytes.append(reinterpret_cast<const char*>(mesh.vertices.data()),
               mesh.vertices.size() * sizeof(Eigen::Vector3f));
  bytes.append(reinterpret_cast<const char*>(mesh.triangles.data()),
               mesh.triangles.size() * sizeof(mesh.triangles[0]));
  return bytes;
}

absl::StatusOr<PriorMesh> DecodePrior(absl::string_view bytes) {
  std::array<uint64_t, 2> counts{};
  if (bytes.size() < sizeof(counts)) return absl::InvalidArgumentError("prior: it is cut off");
  std::memcpy(counts.data(), bytes.data(), sizeof(counts));
  const auto [vertices, triangles] = counts;
  const uint64_t left = bytes.size() - sizeof(counts);
  if (vertices > left / sizeof(Eigen::Vector3f) || triangles > kMostPriorTriangles ||
      left != vertices * sizeof(Eigen::Vector3f) + triangles * sizeof(std::array<uint32_t, 3>)) {
    return absl::InvalidArgumentError(absl::StrCat("prior: ", vertices, " vertices and ", triangles,
                                                   " triangles are not in ", bytes.size(),
                                                   " bytes"));
  }
  PriorMesh mesh;
  mesh.vertices.resize(vertices);
  mesh.triangles.resize(triangles);
  const char* from = bytes.data() + sizeof(counts);
  if (vertices > 0)
    std::memcpy(static_cast<void*>(mesh.vertices.data()), from, vertices * sizeof(Eigen::Vector3f));
  from += vertices * sizeof(Eigen::Vector3f);
  if (triangles > 0) {
    std::memcpy(mesh.triangles.data(), from, triangles * sizeof(mesh.triangles[0]));
  }
  if (absl::Status fine = CheckPrior(mesh); !fine.ok()) return fine;
  return mesh;
}

}  // namespace vantage::site_prior

#include "core/simulation/mesh_ply.h"

#include <array>
#include <cerrno>
#include <fstream>
#include <iterator>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/bytes/ply_mesh.h"

namespace vantage::simulation {

absl::StatusOr<TriangleMesh> ParseMeshPly(absl::string_view bytes) {
  absl::StatusOr<bytes::PlyMesh> read = bytes::ParsePlyMesh(bytes);
  if (!read.ok()) return read.status();
  TriangleMesh mesh;
  mesh.vertices.reserve(read->vertices.size());
  for (const std::array<float, 3>& vertex : read->vertices) {
    mesh.vertices.emplace_back(vertex[0], vertex[1], vertex[2]);
  }
  mesh.triangles = std::move(read->triangles);
  mesh.material.assign(mesh.triangles.size(), Material::kMatte);
  return mesh;
}

absl::StatusOr<TriangleMesh> ReadMeshPly(const std::string& path) {
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) return absl::ErrnoToStatus(errno == 0 ? EIO : errno, absl::StrCat(path, ": open"));
  const std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (file.bad()) return absl::DataLossError(absl::StrCat(path, ": reading failed"));
  absl::StatusOr<TriangleMesh> mesh = ParseMeshPly(bytes);
  if (mesh.ok()) return mesh;
  return absl::Status(mesh.status().code(), absl::StrCat(path, ": ", mesh.status().message()));
}

}  // namespace vantage::simulation

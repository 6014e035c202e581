#include "core/simulation/mesh_ply.h"

#include <array>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "core/bytes/ply_reader.h"

namespace vantage::simulation {
namespace {

absl::Status ReadVertices(bytes::PlyReader& reader, const bytes::PlyElement& element,
                          TriangleMesh& mesh) {
  if (element.count > std::numeric_limits<uint32_t>::max()) {
    return absl::InvalidArgumentError(
        absl::StrCat("PLY: ", element.count, " vertices do not fit into a mesh"));
  }
  const absl::StatusOr<std::array<size_t, 3>> found = element.FindPosition();
  if (!found.ok()) return found.status();
  const std::array<size_t, 3> at = *found;
  return reader.ReadElement([&](uint64_t index, const bytes::PlyReader::Instance& instance) {
    const Eigen::Vector3f vertex =
        Eigen::Vector3d(instance[at[0]][0], instance[at[1]][0], instance[at[2]][0]).cast<float>();
    if (!vertex.allFinite()) {
      return absl::InvalidArgumentError(
          absl::StrCat("PLY vertex ", index, ": NaN or infinite coordinate"));
    }
    mesh.vertices.push_back(vertex);
    return absl::OkStatus();
  });
}

absl::Status AddFace(const std::vector<double>& corners, uint64_t index, TriangleMesh& mesh) {
  const auto count = static_cast<double>(mesh.vertices.size());
  for (const double corner : corners) {
    if (!(corner >= 0 && corner < count) || corner != std::floor(corner)) {
      return absl::InvalidArgumentError(
          absl::StrCat("PLY face ", index, ": vertex ", corner, " of ", mesh.vertices.size()));
    }
  }
  for (size_t k = 2; k < corners.size(); ++k) {
    const std::array<uint32_t, 3> triangle = {static_cast<uint32_t>(corners[0]),
                                              static_cast<uint32_t>(corners[k - 1]),
                                              static_cast<uint32_t>(corners[k])};
    const Eigen::Vector3f& a = mesh.vertices[triangle[0]];
    const Eigen::Vector3f& b = mesh.vertices[triangle[1]];
    const Eigen::Vector3f& c = mesh.vertices[triangle[2]];
    if (!((b - a).cross(c - a).norm() > 0)) continue;
    mesh.triangles.push_back(triangle);
  }
  return absl::OkStatus();
}

absl::Status ReadFaces(bytes::PlyReader& reader, const bytes::PlyElement& element,
                       TriangleMesh& mesh) {
  std::optional<size_t> indices = element.FindList("vertex_indices");
  if (!indices.has_value()) indices = element.FindList("vertex_index");
  if (!indices.has_value()) {
    return absl::InvalidArgumentError("PLY element face: a list vertex_indices is needed");
  }
  return reader.ReadElement([&](uint64_t index, const bytes::PlyReader::Instance& instance) {
    return AddFace(instance[*indices], index, mesh);
  });
}

}  // namespace

absl::StatusOr<TriangleMesh> ParseMeshPly(absl::string_view bytes) {
  absl::StatusOr<bytes::PlyReader> reader = bytes::PlyReader::Open(bytes);
  if (!reader.ok()) return reader.status();
  if (reader->format() == bytes::PlyFormat::kBinaryBigEndian) {
    return absl::UnimplementedError(
        "PLY: binary_big_endian is not read; save as binary_little_endian");
  }
  TriangleMesh mesh;
  for (const bytes::PlyElement& element : reader->elements()) {
    const absl::Status read =
        element.name == "vertex" ? ReadVertices(*reader, element, mesh)
        : element.name == "face"
            ? ReadFaces(*reader, element, mesh)
            : reader->ReadElement(
                  [](uint64_t, const bytes::PlyReader::Instance&) { return absl::OkStatus(); });
    if (!read.ok()) return read;
  }
  if (mesh.triangles.empty()) {
    return absl::InvalidArgumentError("PLY: no triangle with an area; is it a point cloud?");
  }
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

#include "core/bytes/ply_mesh.h"

#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/bytes/ply_reader.h"

namespace vantage::bytes {
namespace {

absl::Status ReadVertices(PlyReader& reader, const PlyElement& element, PlyMesh& mesh) {
  if (element.count > std::numeric_limits<uint32_t>::max()) {
    return absl::InvalidArgumentError(
        absl::StrCat("PLY: ", element.count, " vertices do not fit into a mesh"));
  }
  const absl::StatusOr<std::array<size_t, 3>> found = element.FindPosition();
  if (!found.ok()) return found.status();
  const std::array<size_t, 3> at = *found;
  return reader.ReadElement([&](uint64_t index, const PlyReader::Instance& instance) {
    std::array<float, 3> vertex{};
    for (size_t axis = 0; axis < 3; ++axis) {
      vertex[axis] = static_cast<float>(instance[at[axis]][0]);
      if (!std::isfinite(vertex[axis])) {
        return absl::InvalidArgumentError(
            absl::StrCat("PLY vertex ", index, ": NaN or infinite coordinate"));
      }
    }
    mesh.vertices.push_back(vertex);
    return absl::OkStatus();
  });
}

bool HasArea(const std::array<float, 3>& a, const std::array<float, 3>& b,
             const std::array<float, 3>& c) {
  const std::array<float, 3> u = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
  const std::array<float, 3> v = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
  const float x = u[1] * v[2] - u[2] * v[1];
  const float y = u[2] * v[0] - u[0] * v[2];
  const float z = u[0] * v[1] - u[1] * v[0];
  return x * x + y * y + z * z > 0;
}

absl::Status AddFace(const std::vector<double>& corners, uint64_t index, PlyMesh& mesh) {
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
    if (!HasArea(mesh.vertices[triangle[0]], mesh.vertices[triangle[1]],
                 mesh.vertices[triangle[2]])) {
      continue;
    }
    mesh.triangles.push_back(triangle);
  }
  return absl::OkStatus();
}

absl::Status ReadFaces(PlyReader& reader, const PlyElement& element, PlyMesh& mesh) {
  std::optional<size_t> indices = element.FindList("vertex_indices");
  if (!indices.has_value()) indices = element.FindList("vertex_index");
  if (!indices.has_value()) {
    return absl::InvalidArgumentError("PLY element face: a list vertex_indices is needed");
  }
  return reader.ReadElement([&](uint64_t index, const PlyReader::Instance& instance) {
    return AddFace(instance[*indices], index, mesh);
  });
}

}  // namespace

absl::StatusOr<PlyMesh> ParsePlyMesh(absl::string_view bytes) {
  absl::StatusOr<PlyReader> reader = PlyReader::Open(bytes);
  if (!reader.ok()) return reader.status();
  if (reader->format() == PlyFormat::kBinaryBigEndian) {
    return absl::UnimplementedError(
        "PLY: binary_big_endian is not read; save as binary_little_endian");
  }
  PlyMesh mesh;
  for (const PlyElement& element : reader->elements()) {
    const absl::Status read = element.name == "vertex" ? ReadVertices(*reader, element, mesh)
                              : element.name == "face"
                                  ? ReadFaces(*reader, element, mesh)
                                  : reader->ReadElement([](uint64_t, const PlyReader::Instance&) {
                                      return absl::OkStatus();
                                    });
    if (!read.ok()) return read;
  }
  if (mesh.triangles.empty()) {
    return absl::InvalidArgumentError("PLY: no triangle with an area; is it a point cloud?");
  }
  return mesh;
}

}  // namespace vantage::bytes

#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "core/simulation/mesh_ply.h"

// Every accepted mesh is finite, and its triangles have vertices, areas and a material each.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const auto mesh = vantage::simulation::ParseMeshPly({reinterpret_cast<const char*>(data), size});
  if (!mesh.ok()) return 0;
  if (mesh->triangles.empty() || mesh->material.size() != mesh->triangles.size()) std::abort();
  for (const auto& vertex : mesh->vertices) {
    if (!vertex.allFinite()) std::abort();
  }
  for (const auto& triangle : mesh->triangles) {
    for (const uint32_t vertex : triangle) {
      if (vertex >= mesh->vertices.size()) std::abort();
    }
  }
  return 0;
}

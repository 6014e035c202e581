// A mesh of a stranger, parsed in a process of its own (core/confinement).
#ifndef VANTAGE_CORE_SIMULATION_CONFINED_MESH_H_
#define VANTAGE_CORE_SIMULATION_CONFINED_MESH_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "core/confinement/allowance.h"
#include "core/confinement/bulk.h"
#include "core/confinement/reader.h"
#include "core/simulation/triangle_mesh.h"

namespace vantage::simulation {

// The reader, for main() to hand to confinement::RunIfReader().
confinement::Reader MeshReader();

// As ReadMeshPly(), to the bit and, but for control characters, to the word. Of what goes wrong
// with the reader itself the errors are those of confinement::Child, with the file's name.
absl::StatusOr<TriangleMesh> ReadMeshConfined(const std::string& path,
                                              const confinement::AllowanceSettings& allowance);

// A mesh whose triangles are all matte, as the reader hands it over.
void SayMesh(const TriangleMesh& mesh, confinement::SayBytes say);
// INVALID_ARGUMENT naming what no reader says: no triangle, one of a vertex that is not there, a
// coordinate that is not finite, more than `max_bytes` hold. Errors of `hear` as they are.
absl::StatusOr<TriangleMesh> HearMesh(confinement::HearBytes hear, uint64_t max_bytes);

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_CONFINED_MESH_H_

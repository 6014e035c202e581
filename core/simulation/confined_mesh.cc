#include "core/simulation/confined_mesh.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <optional>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/confinement/child.h"
#include "core/confinement/descriptor.h"
#include "core/simulation/mesh_ply.h"

namespace vantage::simulation {
namespace {

constexpr char kMeshReaderName[] = "mesh";

// Times the file, which is read as a whole and has its faces in binary in about the bytes that they
// take here; and for what does not depend on it, or comes through a pipe, whose length nobody
// knows.
constexpr uint64_t kTimesTheMesh = 16;
constexpr uint64_t kMeshBytesInAnyCase = 512 << 20;

absl::StatusOr<std::string> AllOf(int file, uint64_t size) {
  std::string bytes;
  bytes.reserve(size);
  std::array<char, 1 << 16> piece{};
  while (true) {
    const ssize_t got = read(file, piece.data(), piece.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return absl::DataLossError("reading failed");
    if (got == 0) return bytes;
    bytes.append(piece.data(), static_cast<size_t>(got));
  }
}

void ReadMesh(confinement::Asker& asker) {
  if (!asker.Next()) return;
  const absl::StatusOr<std::string> bytes = AllOf(asker.file(), asker.file_bytes());
  if (!bytes.ok()) return asker.End(bytes.status());
  const absl::StatusOr<TriangleMesh> mesh = ParseMeshPly(*bytes);
  if (mesh.ok()) SayMesh(*mesh, [&](absl::string_view part) { asker.Say(part); });
  asker.End(mesh.status());
}

absl::Status NoMesh(absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("mesh: ", what));
}

}  // namespace

confinement::Reader MeshReader() { return {kMeshReaderName, ReadMesh}; }

void SayMesh(const TriangleMesh& mesh, confinement::SayBytes say) {
  confinement::SayValue(std::array<uint64_t, 2>{mesh.vertices.size(), mesh.triangles.size()}, say);
  confinement::SayVector(mesh.vertices, say);
  confinement::SayVector(mesh.triangles, say);
}

absl::StatusOr<TriangleMesh> HearMesh(confinement::HearBytes hear, uint64_t max_bytes) {
  std::array<uint64_t, 2> counts{};
  absl::Status heard = confinement::HearValue(hear, counts);
  if (!heard.ok()) return heard;
  const auto [vertices, triangles] = counts;
  const uint64_t most = max_bytes / sizeof(Eigen::Vector3f) / 2;  // a triangle takes as much
  if (vertices > most || triangles > most) return NoMesh("more of it than is allowed");
  if (triangles == 0) return NoMesh("no triangle");
  TriangleMesh mesh;
  heard = confinement::HearVector(hear, vertices, mesh.vertices);
  if (heard.ok()) heard = confinement::HearVector(hear, triangles, mesh.triangles);
  if (!heard.ok()) return heard;
  for (const Eigen::Vector3f& vertex : mesh.vertices) {
    if (!vertex.allFinite()) return NoMesh("a coordinate that is not finite");
  }
  for (const std::array<uint32_t, 3>& triangle : mesh.triangles) {
    for (const uint32_t corner : triangle) {
      if (corner >= vertices) return NoMesh("a triangle of a vertex that is not there");
    }
  }
  mesh.material.assign(mesh.triangles.size(), Material::kMatte);
  return mesh;
}

absl::StatusOr<TriangleMesh> ReadMeshConfined(const std::string& path,
                                              const confinement::AllowanceSettings& settings) {
  const confinement::Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat found {};
  if (file.get() < 0 || fstat(file.get(), &found) != 0) {
    return absl::ErrnoToStatus(errno, absl::StrCat(path, ": open"));
  }
  const uint64_t size = S_ISREG(found.st_mode) ? static_cast<uint64_t>(found.st_size) : 0;
  const confinement::Allowance allowance =
      confinement::AllowanceOf(size, kMeshBytesInAnyCase + kTimesTheMesh * size, settings);
  absl::StatusOr<TriangleMesh> mesh = absl::InternalError("nothing was read");
  absl::StatusOr<confinement::Child> reader =
      confinement::Child::Start(kMeshReaderName, file.get(), allowance);
  const absl::Status asked =
      !reader.ok() ? reader.status() : reader->Ask("", {}, [&](confinement::Answer& answer) {
        mesh =
            HearMesh([&](char* to, size_t bytes) { return answer.Read(to, bytes); }, answer.left());
        return mesh.status();
      });
  if (asked.ok()) return mesh;
  return absl::Status(asked.code(), absl::StrCat(path, ": ", asked.message()));
}

}  // namespace vantage::simulation

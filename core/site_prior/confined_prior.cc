#include "core/site_prior/confined_prior.h"

#include <array>
#include <cstring>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/bytes/byte_source.h"
#include "core/confinement/answer.h"
#include "core/confinement/child.h"

namespace vantage::site_prior {
namespace {

constexpr char kPriorReaderName[] = "site-prior";

// Measured: of OBJ, whose faces assimp holds as objects, 30 times the file; of a picture of
// kMostPlanCells pixels and of DXF what is drawn takes 600 MB whatever the file.
constexpr uint64_t kBytesInAnyCase = uint64_t{1} << 30;
constexpr uint64_t kTimesTheFile = 40;

absl::StatusOr<PriorMesh> ParseAsAsked(const std::string& question, confinement::Asker& asker) {
  PriorReading reading;
  if (question.size() != sizeof(reading)) return absl::InternalError("asked for nothing");
  std::memcpy(&reading, question.data(), sizeof(reading));
  const absl::StatusOr<std::string> bytes =
      bytes::ByteSource::Adopt(asker.file(), asker.file_bytes(), "prior").All();
  if (!bytes.ok()) return bytes.status();
  return ParsePrior(*bytes, reading);
}

void AnswerOne(confinement::Asker& asker) {
  const std::optional<std::string> question = asker.Next();
  if (!question) return;
  const absl::StatusOr<PriorMesh> mesh = ParseAsAsked(*question, asker);
  if (mesh.ok()) {
    const auto say = [&](absl::string_view bytes) { asker.Say(bytes); };
    confinement::SayValue(std::array<uint64_t, 2>{mesh->vertices.size(), mesh->triangles.size()},
                          say);
    confinement::SayValue(mesh->unit, say);
    confinement::SayVector(mesh->vertices, say);
    confinement::SayVector(mesh->triangles, say);
  }
  asker.End(mesh.status());
}

}  // namespace

confinement::Reader SitePriorReader() { return {kPriorReaderName, AnswerOne}; }

absl::StatusOr<PriorMesh> HearPrior(confinement::HearBytes hear) {
  std::array<uint64_t, 2> counts{};
  absl::Status heard = confinement::HearValue(hear, counts);
  if (!heard.ok()) return heard;
  const auto [vertices, triangles] = counts;
  if (triangles > kMostPriorTriangles || vertices > 3 * kMostPriorTriangles) {
    return absl::InvalidArgumentError("its reader answered with more of a mesh than is allowed");
  }
  PriorMesh mesh;
  heard = confinement::HearValue(hear, mesh.unit);
  if (!heard.ok()) return heard;
  if (!(mesh.unit > 0 && mesh.unit < 1e4)) {
    return absl::InvalidArgumentError("its reader answered with a unit that there is not");
  }
  heard = confinement::HearVector(hear, vertices, mesh.vertices);
  if (heard.ok()) heard = confinement::HearVector(hear, triangles, mesh.triangles);
  if (heard.ok()) heard = CheckPrior(mesh);
  if (!heard.ok()) return heard;
  return mesh;
}

absl::StatusOr<PriorMesh> ReadPriorConfined(int file, uint64_t size, const PriorReading& reading,
                                            const confinement::AllowanceSettings& settings) {
  if (size > kMostPriorFileBytes) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the file is ", size >> 20, " MiB large, more than ",
                     kMostPriorFileBytes >> 20, " MiB: simplify the mesh, centimetres do"));
  }
  absl::StatusOr<confinement::Child> reader = confinement::Child::Start(
      kPriorReaderName, file,
      confinement::AllowanceOf(size, kBytesInAnyCase + kTimesTheFile * size, settings));
  if (!reader.ok()) return reader.status();
  const std::string question(reinterpret_cast<const char*>(&reading), sizeof(reading));
  absl::StatusOr<PriorMesh> mesh = absl::InternalError("nothing was read");
  const absl::Status asked = reader->Ask(question, {}, [&](confinement::Answer& answer) {
    mesh = HearPrior([&](char* to, size_t bytes) { return answer.Read(to, bytes); });
    return mesh.status();
  });
  if (!asked.ok()) return asked;
  return mesh;
}

}  // namespace vantage::site_prior

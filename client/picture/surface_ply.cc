#include "client/picture/surface_ply.h"

#include <array>
#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/bytes/ply_reader.h"

namespace vantage::picture {
namespace {

absl::Status Bad(const std::string& why) {
  return absl::InvalidArgumentError(absl::StrCat("surface PLY: ", why));
}

// The properties that a vertex must have.
constexpr std::array<const char*, 9> kNeeded = {"x",  "y",    "z",       "nx",  "ny",
                                                "nz", "kind", "density", "area"};
using Places = std::array<size_t, kNeeded.size()>;

absl::StatusOr<Places> FindNeeded(const bytes::PlyElement& vertex) {
  Places places;
  for (size_t i = 0; i < kNeeded.size(); ++i) {
    const std::optional<size_t> place = vertex.FindScalar(kNeeded[i]);
    if (!place.has_value()) return Bad(absl::StrCat("vertices have no '", kNeeded[i], "'"));
    places[i] = *place;
  }
  return places;
}

}  // namespace

absl::StatusOr<std::vector<SurfaceElement>> ParseSurfacePly(absl::string_view bytes) {
  absl::StatusOr<bytes::PlyReader> reader = bytes::PlyReader::Open(bytes);
  if (!reader.ok()) {
    return Bad(absl::StrCat("not a PLY file that can be read: ", reader.status().message()));
  }
  if (reader->format() != bytes::PlyFormat::kBinaryLittleEndian)
    return Bad("not binary_little_endian");
  if (reader->elements().empty() || reader->elements()[0].name != "vertex") {
    return Bad("vertices do not come first");
  }
  const absl::StatusOr<Places> places = FindNeeded(reader->elements()[0]);
  if (!places.ok()) return places.status();
  std::vector<SurfaceElement> elements;
  const absl::Status read =
      reader->ReadElement([&](uint64_t index, const bytes::PlyReader::Instance& instance) {
        std::array<double, kNeeded.size()> value;
        for (size_t i = 0; i < value.size(); ++i) value[i] = instance[(*places)[i]][0];
        // Numbered as in the contract, from 1.
        if (!(value[6] >= 1 && value[6] <= model::kSurfaceKinds)) {
          return absl::InvalidArgumentError(absl::StrCat("vertex ", index, " has kind ", value[6]));
        }
        elements.push_back({{value[0], value[1], value[2]},
                            Eigen::Vector3d(value[3], value[4], value[5]).cast<float>(),
                            static_cast<model::SurfaceKind>(static_cast<int>(value[6]) - 1),
                            static_cast<float>(value[8]),
                            static_cast<float>(value[7])});
        return absl::OkStatus();
      });
  if (!read.ok()) return Bad(std::string(read.message()));
  return elements;
}

}  // namespace vantage::picture

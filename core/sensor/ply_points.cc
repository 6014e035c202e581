#include "core/sensor/ply_points.h"

#include <array>

#include "absl/strings/str_cat.h"
#include "core/bytes/ply_reader.h"

namespace vantage::sensor {
namespace {

absl::Status ReadVertices(bytes::PlyReader& reader, const bytes::PlyElement& element,
                          const ImportLimits& limits, PointCloud& cloud) {
  if (element.count > limits.max_points) {
    return absl::InvalidArgumentError(
        absl::StrCat("PLY: ", element.count, " vertices are more than the limit of ",
                     limits.max_points, "; export the scan at a lower resolution"));
  }
  const absl::StatusOr<std::array<size_t, 3>> found = element.FindPosition();
  if (!found.ok()) return found.status();
  const std::array<size_t, 3> at = *found;
  return reader.ReadElement([&](uint64_t index, const bytes::PlyReader::Instance& instance) {
    return cloud.Add({instance[at[0]][0], instance[at[1]][0], instance[at[2]][0]},
                     [&] { return absl::StrCat("PLY vertex ", index); });
  });
}

}  // namespace

absl::Status ReadPlyPoints(absl::string_view bytes, const ImportLimits& limits, PointCloud& cloud) {
  absl::StatusOr<bytes::PlyReader> reader = bytes::PlyReader::Open(bytes);
  if (!reader.ok()) return reader.status();
  if (reader->format() == bytes::PlyFormat::kBinaryBigEndian) {
    return absl::UnimplementedError(
        "PLY: binary_big_endian is not read; save as binary_little_endian");
  }
  for (const bytes::PlyElement& element : reader->elements()) {
    if (element.name == "vertex") return ReadVertices(*reader, element, limits, cloud);
    absl::Status skipped = reader->ReadElement(
        [](uint64_t, const bytes::PlyReader::Instance&) { return absl::OkStatus(); });
    if (!skipped.ok()) return skipped;
  }
  return absl::InvalidArgumentError("PLY: there is no element vertex");
}

}  // namespace vantage::sensor

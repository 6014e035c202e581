#include "core/sensor/ply_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/bytes/ply_reader.h"

namespace vantage::sensor {
namespace {

// The properties that tell how a point looks, under the names that programs give them.
struct LookFields {
  std::optional<size_t> intensity;
  std::optional<std::array<size_t, 3>> colour;
};

LookFields FindLook(const bytes::PlyElement& element) {
  LookFields fields;
  for (const char* name : {"intensity", "scalar_Intensity", "scalar_intensity"}) {
    if (!fields.intensity.has_value()) fields.intensity = element.FindScalar(name);
  }
  for (const char* prefix : {"", "diffuse_"}) {
    const auto red = element.FindScalar(absl::StrCat(prefix, "red"));
    const auto green = element.FindScalar(absl::StrCat(prefix, "green"));
    const auto blue = element.FindScalar(absl::StrCat(prefix, "blue"));
    if (!red.has_value() || !green.has_value() || !blue.has_value()) continue;
    fields.colour = {*red, *green, *blue};
    break;
  }
  return fields;
}

// The largest number that a property can hold, 1 of reals.
double WholeOf(bytes::PlyType type) {
  switch (type) {
    case bytes::PlyType::kInt8:
      return 127;
    case bytes::PlyType::kUint8:
      return 255;
    case bytes::PlyType::kInt16:
      return 32'767;
    case bytes::PlyType::kUint16:
      return 65'535;
    case bytes::PlyType::kInt32:
      return 2'147'483'647;
    case bytes::PlyType::kUint32:
      return 4'294'967'295;
    case bytes::PlyType::kFloat:
    case bytes::PlyType::kDouble:
      break;
  }
  return 1;
}

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
  const LookFields fields = FindLook(element);
  std::vector<double> intensities;
  Appearance appearance;
  absl::Status read =
      reader.ReadElement([&](uint64_t index, const bytes::PlyReader::Instance& instance) {
        if (limits.appearance.intensity && fields.intensity.has_value()) {
          intensities.push_back(instance[*fields.intensity][0]);
        }
        if (limits.appearance.colour && fields.colour.has_value()) {
          Colour& colour = appearance.colour.emplace_back();
          for (size_t i = 0; i < 3; ++i) {
            const size_t field = (*fields.colour)[i];
            colour[i] = ColourOf(instance[field][0] / WholeOf(element.properties[field].type));
          }
        }
        return cloud.Add({instance[at[0]][0], instance[at[1]][0], instance[at[2]][0]},
                         [&] { return absl::StrCat("PLY vertex ", index); });
      });
  if (!read.ok()) return read;
  if (fields.intensity.has_value()) {
    // Of reals nothing says what the whole is: one, or the most that there is.
    double whole = WholeOf(element.properties[*fields.intensity].type);
    for (const double intensity : intensities) {
      if (std::isfinite(intensity)) whole = std::max(whole, intensity);
    }
    for (const double value : intensities) {
      appearance.intensity.push_back(IntensityOf(value / whole));
    }
  }
  cloud.SetAppearance({fields.intensity.has_value(), fields.colour.has_value()},
                      std::move(appearance));
  return absl::OkStatus();
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

#include "core/sensor/las.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/bytes/byte_order.h"

namespace vantage::sensor {
namespace {

using bytes::LoadLittleEndian;

// Bytes from the file's beginning (LAS 1.4 R15, table 3). What was added by 1.4 comes last.
constexpr size_t kVersionAt = 24;  // major, minor
constexpr size_t kPointsAt = 96;
constexpr size_t kFormatAt = 104;
constexpr size_t kRecordAt = 105;
constexpr size_t kCountAt = 107;
constexpr size_t kScaleAt = 131;
constexpr size_t kOffsetAt = 155;
constexpr size_t kHeaderBytes = 227;  // of 1.0 to 1.2
constexpr size_t kLongCountAt = 247;
constexpr size_t kLongHeaderBytes = 375;
// Bytes of a record of each point format, without what users add (tables 7 to 17).
constexpr size_t kRecordBytes[] = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
constexpr uint8_t kCompressed = 0x80;  // set by LASzip in the point format
// Of a point record: where the flag stands that it was withdrawn, and which bit it is.
constexpr size_t kFlagsAt = 15;
constexpr uint8_t kWithdrawn = 0x80;     // formats 0 to 5
constexpr uint8_t kNewWithdrawn = 0x04;  // formats 6 and later
constexpr uint8_t kFirstNewFormat = 6;
constexpr size_t kIntensityAt = 12;
// Where red, green and blue stand, two bytes each, in a record of each format; 0: it has none.
constexpr size_t kColourAt[] = {0, 0, 20, 28, 0, 28, 0, 30, 30, 0, 30};

struct LasHeader {
  uint64_t count = 0;
  size_t points_at = 0;     // bytes
  size_t record_bytes = 0;  // of each point
  uint8_t format = 0;
  Eigen::Vector3d scale;   // m
  Eigen::Vector3d offset;  // m
};

absl::Status Bad(absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("LAS: ", what));
}

// `bytes`: the file's first ones, those of the longest header where it has so many; `size`: of all.
absl::StatusOr<LasHeader> ReadHeader(absl::string_view bytes, uint64_t size,
                                     const ImportLimits& limits) {
  if (bytes.substr(0, 4) != "LASF") return Bad("no LASF at its beginning; is this a LAS file?");
  if (bytes.size() < kHeaderBytes) {
    return Bad("truncated within the header; export or copy the file again");
  }
  const char* const at = bytes.data();
  const int major = at[kVersionAt];
  const int minor = at[kVersionAt + 1];
  if (major != 1 || minor < 0 || minor > 4) {
    return absl::UnimplementedError(
        absl::StrCat("LAS version ", major, ".", minor, " is not read; save it as 1.2 or 1.4"));
  }
  LasHeader header;
  header.format = LoadLittleEndian<uint8_t>(at + kFormatAt);
  if ((header.format & kCompressed) != 0) {
    return absl::UnimplementedError(
        "LAZ: compressed points are not read; decompress the file first ('laszip -i scan.laz -o "
        "scan.las' or 'pdal translate scan.laz scan.las')");
  }
  if (header.format >= std::size(kRecordBytes)) {
    return absl::UnimplementedError(absl::StrCat("LAS point format ", header.format,
                                                 " is not read; save it with format 0 to 10"));
  }
  header.points_at = LoadLittleEndian<uint32_t>(at + kPointsAt);
  header.record_bytes = LoadLittleEndian<uint16_t>(at + kRecordAt);
  header.count = LoadLittleEndian<uint32_t>(at + kCountAt);
  if (minor >= 4 && bytes.size() >= kLongHeaderBytes) {
    const auto count = LoadLittleEndian<uint64_t>(at + kLongCountAt);
    if (count > 0) header.count = count;
  }
  if (header.record_bytes < kRecordBytes[header.format]) {
    return Bad(absl::StrCat("point record length ", header.record_bytes, " of point format ",
                            header.format, ", whose records have ", kRecordBytes[header.format],
                            " bytes"));
  }
  for (int axis = 0; axis < 3; ++axis) {
    const size_t place = sizeof(double) * static_cast<size_t>(axis);
    header.scale[axis] = LoadLittleEndian<double>(at + kScaleAt + place);
    header.offset[axis] = LoadLittleEndian<double>(at + kOffsetAt + place);
  }
  if (!header.scale.allFinite() || !header.offset.allFinite() ||
      !(header.scale.array() > 0).all()) {
    return Bad("scale factors and offsets must be finite, and scale factors positive");
  }
  if (header.count == 0) return Bad("there are no points in it");
  if (header.count > limits.max_points) {
    return Bad(absl::StrCat(header.count, " points are more than the limit of ", limits.max_points,
                            "; export the scan at a lower resolution"));
  }
  if (header.points_at < kHeaderBytes || header.points_at > size ||
      (size - header.points_at) / header.record_bytes < header.count) {
    return Bad(absl::StrCat("truncated: ", size, " bytes for ", header.count, " points of ",
                            header.record_bytes, " bytes from byte ", header.points_at,
                            " on; export or copy the file again"));
  }
  return header;
}

// Colours have 16 bits; some programs fill the lower eight of them only.
std::vector<Colour> ToBytes(const std::vector<std::array<uint16_t, 3>>& colours) {
  uint16_t most = 0;
  for (const auto& colour : colours) most = std::max({most, colour[0], colour[1], colour[2]});
  const int shift = most > 255 ? 8 : 0;
  std::vector<Colour> bytes;
  bytes.reserve(colours.size());
  for (const auto& colour : colours) {
    Colour& out = bytes.emplace_back();
    for (size_t i = 0; i < 3; ++i) out[i] = static_cast<uint8_t>(colour[i] >> shift);
  }
  return bytes;
}

}  // namespace

absl::Status ReadLas(const bytes::ByteSource& source, const ImportLimits& limits,
                     PointCloud& cloud) {
  bytes::ByteSource file = source;
  const auto first =
      file.View(0, static_cast<size_t>(std::min<uint64_t>(kLongHeaderBytes, file.size())));
  if (!first.ok()) return first.status();
  const absl::StatusOr<LasHeader> header = ReadHeader(*first, file.size(), limits);
  if (!header.ok()) return header.status();
  const uint8_t withdrawn = header->format >= kFirstNewFormat ? kNewWithdrawn : kWithdrawn;
  cloud.Reserve(header->count);
  const AppearanceKinds has = {true, kColourAt[header->format] != 0};
  const AppearanceKinds wanted = {limits.appearance.intensity,
                                  limits.appearance.colour && has.colour};
  Appearance appearance;
  std::vector<std::array<uint16_t, 3>> colours;
  for (uint64_t i = 0; i < header->count; ++i) {
    const auto read = file.View(header->points_at + i * header->record_bytes, header->record_bytes);
    if (!read.ok()) return read.status();
    const char* const record = read->data();
    if ((LoadLittleEndian<uint8_t>(record + kFlagsAt) & withdrawn) != 0) continue;
    const Eigen::Array3d steps(LoadLittleEndian<int32_t>(record),
                               LoadLittleEndian<int32_t>(record + 4),
                               LoadLittleEndian<int32_t>(record + 8));
    const Eigen::Vector3d point = steps * header->scale.array() + header->offset.array();
    absl::Status added = cloud.Add(point, [&] { return absl::StrCat("LAS point ", i); });
    if (!added.ok()) return added;
    if (wanted.intensity) {
      appearance.intensity.push_back(LoadLittleEndian<uint16_t>(record + kIntensityAt));
    }
    if (wanted.colour) {
      const char* const at = record + kColourAt[header->format];
      colours.push_back({LoadLittleEndian<uint16_t>(at), LoadLittleEndian<uint16_t>(at + 2),
                         LoadLittleEndian<uint16_t>(at + 4)});
    }
  }
  if (cloud.size() == 0) return Bad("all points are withdrawn");
  appearance.colour = ToBytes(colours);
  cloud.SetAppearance(has, std::move(appearance));
  return absl::OkStatus();
}

}  // namespace vantage::sensor

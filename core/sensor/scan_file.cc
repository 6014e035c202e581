#include "core/sensor/scan_file.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <system_error>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "core/sensor/e57.h"
#include "core/sensor/encoding.h"
#include "core/sensor/las.h"
#include "core/sensor/pcd.h"
#include "core/sensor/ply_points.h"
#include "core/sensor/point_cloud.h"
#include "core/sensor/ptx.h"
#include "core/sensor/xyz.h"

namespace vantage::sensor {
namespace {

absl::StatusOr<ImportedScan> ParseImage(absl::string_view bytes, const ImportLimits& limits) {
  using Keep = RangeImageDecoder::Keep;
  absl::StatusOr<RangeImage> image = DecodeRangeImage(bytes, limits.max_points, Keep::kAll);
  if (!image.ok()) return image.status();
  const AppearanceKinds has = image->appearance.kinds();
  if (!limits.appearance.intensity) image->appearance.intensity = {};
  if (!limits.appearance.colour) image->appearance.colour = {};
  ImportedScan scan = ImportImage(*std::move(image), limits);
  scan.appearance = has;
  return scan;
}

std::string ExtensionOf(const std::string& path) {
  return absl::AsciiStrToLower(std::filesystem::path(path).extension().string());
}

// Points of these formats do not say where they were seen from.
bool NeedsStation(ScanFormat format) {
  return format == ScanFormat::kLas || format == ScanFormat::kPly || format == ScanFormat::kXyz;
}

// What is wrong with a station that was given, of a format that may have one.
absl::Status CheckStation(const std::string& path, ScanFormat format,
                          const std::optional<Eigen::Vector3d>& station) {
  if (station.has_value() && !NeedsStation(format) && format != ScanFormat::kPcd) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": it says itself where the scanner stood; leave out the station"));
  }
  if (station.has_value() && !station->allFinite()) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": the station must be three numbers"));
  }
  return absl::OkStatus();
}

absl::StatusOr<bytes::ByteSource> OpenFile(const std::string& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    return absl::NotFoundError(absl::StrCat(path, ": no such file"));
  }
  if (!std::filesystem::is_regular_file(status)) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": not a regular file"));
  }
  return bytes::ByteSource::Open(path);
}

}  // namespace

absl::StatusOr<ScanFile::Format> ScanFile::FormatOf(const std::string& path) {
  const std::string extension = ExtensionOf(path);
  constexpr std::pair<absl::string_view, Format> kFormats[] = {
      {".ptx", Format::kPtx},         {".pcd", Format::kPcd}, {".e57", Format::kE57},
      {".vrim", Format::kRangeImage}, {".las", Format::kLas}, {".ply", Format::kPly},
      {".xyz", Format::kXyz},         {".pts", Format::kXyz}, {".asc", Format::kXyz},
      {".csv", Format::kXyz},         {".txt", Format::kXyz}};
  for (const auto& [ending, format] : kFormats) {
    if (extension == ending) return format;
  }
  return absl::UnimplementedError(absl::StrCat(path, ": ", FormatNotRead(extension).message()));
}

absl::StatusOr<ScanFile> ScanFile::Open(const std::string& path,
                                        const std::optional<Eigen::Vector3d>& station,
                                        const Reached& reached) {
  absl::StatusOr<bytes::ByteSource> source = OpenSource(path, station);
  if (!source.ok()) return source.status();
  return OfSource(path, station, *std::move(source), reached);
}

absl::StatusOr<bytes::ByteSource> ScanFile::OpenSource(
    const std::string& path, const std::optional<Eigen::Vector3d>& station) {
  const absl::StatusOr<Format> format = FormatOf(path);
  if (!format.ok()) return format.status();
  if (NeedsStation(*format) && !station.has_value()) {
    return absl::InvalidArgumentError(absl::StrCat(
        path, ": points in ", ExtensionOf(path).substr(1),
        " do not say where they were seen from; give the place where the scanner stood, in the "
        "file's frame (--station x,y,z), or export the scan as structured E57 or PTX"));
  }
  if (absl::Status fits = CheckStation(path, *format, station); !fits.ok()) return fits;
  return OpenFile(path);
}

absl::StatusOr<ScanFile> ScanFile::OfSource(const std::string& path,
                                            const std::optional<Eigen::Vector3d>& station,
                                            bytes::ByteSource source, const Reached& reached) {
  const absl::StatusOr<Format> format = FormatOf(path);
  if (!format.ok()) return format.status();
  return OfFormat(path, *format, station, std::move(source), reached);
}

absl::StatusOr<ScanFile> ScanFile::OfContent(const std::string& path,
                                             const std::optional<Eigen::Vector3d>& station,
                                             bytes::ByteSource source, FileRefusal& refusal,
                                             const Reached& reached) {
  const uint64_t size = source.size();
  const absl::StatusOr<absl::string_view> head =
      source.View(0, static_cast<size_t>(std::min(size, kContentHead)));
  if (!head.ok()) return head.status();
  const FileContent content = ContentOf(*head, size, path);
  refusal = content.refusal;
  if (refusal != FileRefusal::kNone) {
    return absl::Status(content.why.code(), absl::StrCat(path, ": ", content.why.message()));
  }
  if (NeedsStation(content.format) && !station.has_value()) {
    refusal = FileRefusal::kStationMissing;
    return absl::InvalidArgumentError(absl::StrCat(
        path,
        ": its points do not say where they were seen from; give the place where the scanner "
        "stood, in the file's frame, or export the scan as structured E57 or PTX"));
  }
  if (absl::Status fits = CheckStation(path, content.format, station); !fits.ok()) return fits;
  return OfFormat(path, content.format, station, std::move(source), reached);
}

absl::StatusOr<ScanFile> ScanFile::OfFormat(const std::string& path, Format format,
                                            const std::optional<Eigen::Vector3d>& station,
                                            bytes::ByteSource source, const Reached& reached) {
  if (reached) {
    source.Watch([reached, size = source.size()](uint64_t position) { reached(position, size); });
  }
  ScanFile file(path, format, station, std::move(source));
  if (format == Format::kPcd || format == Format::kPly || format == Format::kRangeImage) {
    absl::StatusOr<std::string> bytes = file.file_.All();
    if (!bytes.ok()) return bytes.status();
    file.bytes_ = *std::move(bytes);
  }
  if (absl::Status found = file.FindSetups(); !found.ok()) return file.InFile(found);
  return file;
}

absl::Status ScanFile::FindSetups() {
  if (format_ == Format::kE57) {
    absl::StatusOr<std::vector<std::string>> names = ListE57Setups(file_);
    if (!names.ok()) return names.status();
    if (names->empty()) return absl::InvalidArgumentError("E57: there is no scan in it");
    setups_ = *std::move(names);
  } else if (format_ == Format::kPtx) {
    absl::StatusOr<std::vector<uint64_t>> begins = FindPtxSetups(file_);
    if (!begins.ok()) return begins.status();
    begins_ = *std::move(begins);
    setups_.resize(begins_.size() - 1);
  } else {
    setups_.resize(1);
  }
  return absl::OkStatus();
}

absl::StatusOr<ImportedScan> ScanFile::Parse(size_t setup, const ImportLimits& limits) const {
  switch (format_) {
    case Format::kPtx:
      return ParsePtx(file_.Part(begins_[setup], begins_[setup + 1] - begins_[setup]), limits);
    case Format::kPcd:
      return ParsePcd(bytes_, limits, station_);
    case Format::kE57:
      return ParseE57(file_, setup, limits);
    case Format::kLas:
    case Format::kPly:
    case Format::kXyz:
      return ParseCloud(limits);
    case Format::kRangeImage:
      break;
  }
  return ParseImage(bytes_, limits);
}

absl::StatusOr<ImportedScan> ScanFile::ParseCloud(const ImportLimits& limits) const {
  PointCloud cloud(*station_, limits.unit);
  const absl::Status read = format_ == Format::kLas   ? ReadLas(file_, limits, cloud)
                            : format_ == Format::kPly ? ReadPlyPoints(bytes_, limits, cloud)
                                                      : ReadXyz(file_, limits, cloud);
  if (!read.ok()) return read;
  return cloud.ToScan(limits);
}

absl::StatusOr<ImportedScan> ScanFile::Read(size_t setup, const ImportLimits& limits) const {
  if (setup >= setups_.size()) {
    return InFile(absl::InvalidArgumentError(
        absl::StrCat("there is no set-up ", setup + 1, ", it has ", setups_.size())));
  }
  absl::StatusOr<ImportedScan> scan = Parse(setup, limits);
  if (scan.ok()) return scan;
  // E57 names its set-ups itself; lines of PTX are counted from where one begins.
  const bool named = setups_.size() == 1 || format_ == Format::kE57;
  return InFile(absl::Status(scan.status().code(),
                             absl::StrCat(named ? "" : absl::StrCat("set-up ", setup + 1, ": "),
                                          scan.status().message())));
}

absl::Status ScanFile::InFile(const absl::Status& status) const {
  return {status.code(), absl::StrCat(path_, ": ", status.message())};
}

absl::StatusOr<ImportedScan> ReadScanFile(const std::string& path, const ImportLimits& limits) {
  const absl::StatusOr<ScanFile> file = ScanFile::Open(path);
  if (!file.ok()) return file.status();
  if (file->setups().size() > 1) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": it has ", file->setups().size(), " set-ups; choose one"));
  }
  return file->Read(0, limits);
}

}  // namespace vantage::sensor

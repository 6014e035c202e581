#include "core/sensor/scan_file.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <system_error>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "core/sensor/e57.h"
#include "core/sensor/encoding.h"
#include "core/sensor/pcd.h"
#include "core/sensor/ptx.h"

namespace vantage::sensor {
namespace {

absl::StatusOr<ImportedScan> ParseImage(absl::string_view bytes, const ImportLimits& limits) {
  absl::StatusOr<RangeImage> image = DecodeRangeImage(bytes, limits.max_points);
  if (!image.ok()) return image.status();
  return ImportImage(*std::move(image), limits);
}

// What vendors' own formats are exported as, by their programs.
absl::Status NotRead(const std::string& path, absl::string_view extension) {
  for (const absl::string_view vendor :
       {".fls", ".fws", ".lgs", ".lgsx", ".ptg", ".rdb", ".rdbx", ".rxp", ".rcp", ".rcs", ".tzf",
        ".tzs", ".zfs", ".zfprj"}) {
    if (extension == vendor) {
      return absl::UnimplementedError(
          absl::StrCat(path,
                       ": a vendor's own format is not read; export the scan from the "
                       "vendor's program as structured E57 or PTX"));
    }
  }
  return absl::UnimplementedError(absl::StrCat(
      path,
      ": only .e57, .ptx, .pcd and .vrim files are read; export the scan as structured E57 "
      "or PTX"));
}

absl::StatusOr<std::string> ReadBytes(const std::string& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    return absl::NotFoundError(absl::StrCat(path, ": no such file"));
  }
  if (!std::filesystem::is_regular_file(status)) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": not a regular file"));
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    const int cause = errno;
    return absl::ErrnoToStatus(cause == 0 ? EACCES : cause, absl::StrCat(path, ": cannot open"));
  }
  std::string bytes;
  bytes.resize(static_cast<size_t>(std::filesystem::file_size(path, error)));
  if (error || !file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()))) {
    return absl::DataLossError(absl::StrCat(path, ": reading failed"));
  }
  return bytes;
}

}  // namespace

absl::StatusOr<ScanFile> ScanFile::Open(const std::string& path) {
  const std::string extension =
      absl::AsciiStrToLower(std::filesystem::path(path).extension().string());
  std::optional<Format> format;
  if (extension == ".ptx") format = Format::kPtx;
  if (extension == ".pcd") format = Format::kPcd;
  if (extension == ".e57") format = Format::kE57;
  if (extension == ".vrim") format = Format::kRangeImage;
  if (!format.has_value()) return NotRead(path, extension);
  absl::StatusOr<std::string> bytes = ReadBytes(path);
  if (!bytes.ok()) return bytes.status();
  ScanFile file(path, *format, *std::move(bytes));
  if (absl::Status found = file.FindSetups(); !found.ok()) return file.InFile(found);
  return file;
}

absl::Status ScanFile::FindSetups() {
  if (format_ == Format::kE57) {
    absl::StatusOr<std::vector<std::string>> names = ListE57Setups(bytes_);
    if (!names.ok()) return names.status();
    if (names->empty()) return absl::InvalidArgumentError("E57: there is no scan in it");
    setups_ = *std::move(names);
  } else if (format_ == Format::kPtx) {
    begins_ = FindPtxSetups(bytes_);
    setups_.resize(begins_.size() - 1);
  } else {
    setups_.resize(1);
  }
  return absl::OkStatus();
}

absl::StatusOr<ImportedScan> ScanFile::Parse(size_t setup, const ImportLimits& limits) const {
  switch (format_) {
    case Format::kPtx:
      return ParsePtx(
          absl::string_view(bytes_).substr(begins_[setup], begins_[setup + 1] - begins_[setup]),
          limits);
    case Format::kPcd:
      return ParsePcd(bytes_, limits);
    case Format::kE57:
      return ParseE57(bytes_, setup, limits);
    case Format::kRangeImage:
      break;
  }
  return ParseImage(bytes_, limits);
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

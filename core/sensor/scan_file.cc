#include "core/sensor/scan_file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "core/sensor/encoding.h"
#include "core/sensor/imported_scan.h"
#include "core/sensor/pcd.h"
#include "core/sensor/ptx.h"

namespace vantage::sensor {
namespace {

absl::StatusOr<ImportedScan> ParseImage(absl::string_view bytes, const ImportLimits& limits) {
  absl::StatusOr<RangeImage> image = DecodeRangeImage(bytes, limits.max_points);
  if (!image.ok()) return image.status();
  return ImportImage(*std::move(image), limits);
}

}  // namespace

absl::StatusOr<ImportedScan> ReadScanFile(const std::string& path, const ImportLimits& limits) {
  const std::string extension =
      absl::AsciiStrToLower(std::filesystem::path(path).extension().string());
  const bool encoded = extension == ".vrim";
  if (!encoded && extension != ".ptx" && extension != ".pcd") {
    return absl::UnimplementedError(
        absl::StrCat(path, ": only .ptx, .pcd and .vrim files are read; export the scan as PTX"));
  }
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
  absl::StatusOr<ImportedScan> scan = encoded               ? ParseImage(bytes, limits)
                                      : extension == ".ptx" ? ParsePtx(bytes, limits)
                                                            : ParsePcd(bytes, limits);
  if (scan.ok()) return scan;
  return absl::Status(scan.status().code(), absl::StrCat(path, ": ", scan.status().message()));
}

}  // namespace vantage::sensor

// Reading what instruments deliver (ptx.h, pcd.h, e57.h), and encoded range images (encoding.h).
// The result is always a range image in the scanner's own frame, and the pose that the file states,
// if it states one.
#ifndef VANTAGE_CORE_SENSOR_SCAN_FILE_H_
#define VANTAGE_CORE_SENSOR_SCAN_FILE_H_

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/sensor/imported_scan.h"

namespace vantage::sensor {

// A file with one set-up or several: scans that were made one after the other, each from its place.
class ScanFile {
 public:
  // By file name (.ptx, .pcd, .e57, .vrim). NOT_FOUND and PERMISSION_DENIED as the file system
  // says; UNIMPLEMENTED: another format, with the export that works; otherwise errors as of the
  // format's own function.
  static absl::StatusOr<ScanFile> Open(const std::string& path);

  // The names that the file gives its set-ups, in its order; "" for one without.
  const std::vector<std::string>& setups() const { return setups_; }
  // One of them, by its place. Errors name the file, and the set-up where there are several.
  absl::StatusOr<ImportedScan> Read(size_t setup, const ImportLimits& limits) const;

 private:
  enum class Format { kPtx, kPcd, kE57, kRangeImage };

  ScanFile(std::string path, Format format, std::string bytes)
      : path_(std::move(path)), format_(format), bytes_(std::move(bytes)) {}
  absl::Status FindSetups();
  absl::StatusOr<ImportedScan> Parse(size_t setup, const ImportLimits& limits) const;
  absl::Status InFile(const absl::Status& status) const;

  std::string path_;
  Format format_;
  std::string bytes_;
  std::vector<std::string> setups_;
  std::vector<size_t> begins_;  // of a PTX file's set-ups: their first bytes, and the file's end
};

// The one set-up of a file. INVALID_ARGUMENT: it has several. Otherwise errors as of ScanFile.
absl::StatusOr<ImportedScan> ReadScanFile(const std::string& path, const ImportLimits& limits);

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_SCAN_FILE_H_

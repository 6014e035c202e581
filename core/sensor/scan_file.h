// Reading what instruments deliver (e57.h, ptx.h, pcd.h), encoded range images (encoding.h), and
// points of which someone knows where they were seen from (las.h, ply_points.h, xyz.h).
// The result is always a range image in the scanner's own frame, and the pose that the file states,
// if it states one.
#ifndef VANTAGE_CORE_SENSOR_SCAN_FILE_H_
#define VANTAGE_CORE_SENSOR_SCAN_FILE_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/bytes/byte_source.h"
#include "core/sensor/file_content.h"
#include "core/sensor/imported_scan.h"

namespace vantage::sensor {

// A file with one set-up or several: scans that were made one after the other, each from its place.
class ScanFile {
 public:
  // By file name: .e57, .ptx, .pcd, .vrim; .las, .ply, and text as .xyz, .pts, .asc, .csv or .txt.
  // `station`: where the scanner stood, m, in the frame of the points. The last ones need it, since
  // they do not say; of PCD it takes the place of VIEWPOINT, where points were written in the
  // world's frame; the first two say it themselves.
  // NOT_FOUND and PERMISSION_DENIED as the file system says; UNIMPLEMENTED: another format, with
  // the export that works; INVALID_ARGUMENT: a station is missing, or is not to be given; otherwise
  // errors as of the format's own function.
  // `reached` is called, from here on and by Read(), with how far the file was read, and its size.
  // What is read twice begins again.
  using Reached = std::function<void(uint64_t position, uint64_t size)>;
  static absl::StatusOr<ScanFile> Open(const std::string& path,
                                       const std::optional<Eigen::Vector3d>& station = {},
                                       const Reached& reached = {});
  // The two halves of Open(): what name and station say, and the file, of which nothing is read
  // yet; and the rest, which parses it.
  static absl::StatusOr<bytes::ByteSource> OpenSource(
      const std::string& path, const std::optional<Eigen::Vector3d>& station);
  static absl::StatusOr<ScanFile> OfSource(const std::string& path,
                                           const std::optional<Eigen::Vector3d>& station,
                                           bytes::ByteSource source, const Reached& reached = {});
  // Of an open file whose content tells the format (file_content.h); `path` is only what it is
  // called. Where it is refused, `refusal` says why, and the status in words: as ContentOf(), or
  // INVALID_ARGUMENT: a station is missing.
  static absl::StatusOr<ScanFile> OfContent(const std::string& path,
                                            const std::optional<Eigen::Vector3d>& station,
                                            bytes::ByteSource source, FileRefusal& refusal,
                                            const Reached& reached = {});

  // The names that the file gives its set-ups, in its order; "" for one without.
  const std::vector<std::string>& setups() const { return setups_; }
  // One of them, by its place. Errors name the file, and the set-up where there are several.
  absl::StatusOr<ImportedScan> Read(size_t setup, const ImportLimits& limits) const;

 private:
  using Format = ScanFormat;
  static absl::StatusOr<Format> FormatOf(const std::string& path);

  ScanFile(std::string path, Format format, std::optional<Eigen::Vector3d> station,
           bytes::ByteSource file)
      : path_(std::move(path)),
        format_(format),
        station_(std::move(station)),
        file_(std::move(file)) {}
  // Of a format that is known.
  static absl::StatusOr<ScanFile> OfFormat(const std::string& path, Format format,
                                           const std::optional<Eigen::Vector3d>& station,
                                           bytes::ByteSource source, const Reached& reached);
  absl::Status FindSetups();
  // Of a format of loose points.
  absl::StatusOr<ImportedScan> ParseCloud(const ImportLimits& limits) const;
  absl::StatusOr<ImportedScan> Parse(size_t setup, const ImportLimits& limits) const;
  absl::Status InFile(const absl::Status& status) const;

  std::string path_;
  Format format_;
  std::optional<Eigen::Vector3d> station_;
  bytes::ByteSource file_;
  std::string bytes_;  // all of it, of formats that are not read piece by piece
  std::vector<std::string> setups_;
  std::vector<uint64_t> begins_;  // of a PTX file's set-ups: their first bytes, and the file's end
};

// The one set-up of a file. INVALID_ARGUMENT: it has several. Otherwise errors as of ScanFile.
absl::StatusOr<ImportedScan> ReadScanFile(const std::string& path, const ImportLimits& limits);

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_SCAN_FILE_H_

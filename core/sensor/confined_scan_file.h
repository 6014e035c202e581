// A scan file of a stranger, parsed in a process of its own (core/confinement): what its bytes do
// to a parser costs this file, and nothing else.
#ifndef VANTAGE_CORE_SENSOR_CONFINED_SCAN_FILE_H_
#define VANTAGE_CORE_SENSOR_CONFINED_SCAN_FILE_H_

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/bytes/byte_source.h"
#include "core/confinement/child.h"
#include "core/confinement/reader.h"
#include "core/sensor/imported_scan.h"
#include "core/sensor/scan_file.h"

namespace vantage::sensor {

// The reader, for main() to hand to confinement::RunIfReader().
confinement::Reader ScanFileReader();

// As ScanFile, to the bit and, but for control characters, to the word. Of what goes wrong with the
// reader itself the errors are those of confinement::Child, with the file's name. It belongs to the
// thread that opened it.
class ConfinedScanFile {
 public:
  static absl::StatusOr<ConfinedScanFile> Open(const std::string& path,
                                               const std::optional<Eigen::Vector3d>& station,
                                               const confinement::AllowanceSettings& allowance,
                                               const ScanFile::Reached& reached = {});
  // As ScanFile::OfContent(). `name` is at most kMaxName bytes of it.
  static absl::StatusOr<ConfinedScanFile> OfContent(const std::string& name,
                                                    bytes::ByteSource source,
                                                    const std::optional<Eigen::Vector3d>& station,
                                                    const confinement::AllowanceSettings& allowance,
                                                    FileRefusal& refusal,
                                                    const ScanFile::Reached& reached = {});
  static constexpr size_t kMaxName = 1024;

  const std::vector<std::string>& setups() const { return setups_; }
  // A reader that ended with one set-up is started anew for the next.
  absl::StatusOr<ImportedScan> Read(size_t setup, const ImportLimits& limits);

 private:
  ConfinedScanFile(std::string path, std::optional<Eigen::Vector3d> station,
                   confinement::Allowance allowance, ScanFile::Reached reached,
                   bytes::ByteSource source)
      : path_(std::move(path)),
        station_(std::move(station)),
        allowance_(std::move(allowance)),
        reached_(std::move(reached)),
        source_(std::move(source)) {}
  // The set-ups as a new reader lists them. `refusal`: null, or where the content tells the format.
  absl::StatusOr<std::vector<std::string>> Start(FileRefusal* refusal);
  absl::Status Ask(const std::string& question, confinement::Child::Take take);

  std::string path_;
  std::optional<Eigen::Vector3d> station_;
  confinement::Allowance allowance_;
  ScanFile::Reached reached_;
  bytes::ByteSource source_;
  bool by_content_ = false;
  std::optional<confinement::Child> reader_;
  std::vector<std::string> setups_;
};

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_CONFINED_SCAN_FILE_H_

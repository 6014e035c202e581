// What a file is by its content, whatever it is called: which format of scans, or what it is
// instead. So that somebody who picked a photo is told that it is one.
#ifndef VANTAGE_CORE_SENSOR_FILE_CONTENT_H_
#define VANTAGE_CORE_SENSOR_FILE_CONTENT_H_

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace vantage::sensor {

enum class ScanFormat { kPtx, kPcd, kE57, kRangeImage, kLas, kPly, kXyz };

// Why a file is refused before a scan in it is read. A confined reader says it as a number, so that
// none may change.
enum class FileRefusal : uint32_t {
  kNone = 0,
  kNotAScan = 1,
  kCutOff = 2,
  kEncrypted = 3,
  kFormatNotRead = 4,
  kStationMissing = 5,
};

struct FileContent {
  ScanFormat format = ScanFormat::kXyz;  // where nothing is refused
  FileRefusal refusal = FileRefusal::kNone;
  // Of a refusal: what it is and what helps. INVALID_ARGUMENT (no scan), DATA_LOSS (cut off),
  // UNIMPLEMENTED (encrypted, or of a format that is not read).
  absl::Status why;
};

// So many of a file's first bytes are looked at.
inline constexpr uint64_t kContentHead = 1 << 16;

// `head`: a file's first kContentHead bytes, or all; `size`: of the file. `name`: of the file,
// whose ending counts where the content says nothing, for what is said of vendors' own formats.
FileContent ContentOf(absl::string_view head, uint64_t size, const std::string& name);

// UNIMPLEMENTED: files whose name ends so (".fls", lower case) are not read; with what a vendor's
// own format, or LAZ, is exported as.
absl::Status FormatNotRead(absl::string_view extension);

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_FILE_CONTENT_H_

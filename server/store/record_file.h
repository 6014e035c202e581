// Files of records that are appended one after another. Each record is preceded by its size, its
// checksum, and the checksum of these two. A file that ends within a record was cut short.
#ifndef VANTAGE_SERVER_STORE_RECORD_FILE_H_
#define VANTAGE_SERVER_STORE_RECORD_FILE_H_

#include <cstdint>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace vantage::store {

// Before every record. Little endian.
struct RecordHeader {
  uint32_t size = 0;
  uint32_t crc32c = 0;
  uint32_t own_crc32c = 0;

  static RecordHeader Of(absl::string_view record);
  uint32_t OwnChecksum() const;
  absl::string_view bytes() const {
    return absl::string_view(reinterpret_cast<const char*>(this), sizeof(*this));
  }
};
static_assert(sizeof(RecordHeader) == 12 && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__);

// Calls visit for every record of an open file before the first that is not whole, until it returns
// an error, which is returned; the size of all of them. Sets `damaged` when others follow the one
// that is not whole. UNAVAILABLE: the medium fails.
absl::StatusOr<int64_t> VisitRecords(int fd, const std::string& path,
                                     absl::FunctionRef<absl::Status(absl::string_view)> visit,
                                     bool* damaged = nullptr);

}  // namespace vantage::store

#endif  // VANTAGE_SERVER_STORE_RECORD_FILE_H_

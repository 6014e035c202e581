// The bytes of an E57 file without the checksums between them (ASTM E2807, section 9.1: pages).
#ifndef VANTAGE_CORE_E57_PAGED_BYTES_H_
#define VANTAGE_CORE_E57_PAGED_BYTES_H_

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/bytes/byte_source.h"

namespace vantage::e57 {

// A file is a row of pages, each ending in a CRC-32C of the rest. Positions in the file
// ('physical') count these checksums; positions here ('logical') do not. Not thread safe: it
// remembers which pages were checked.
class PagedBytes {
 public:
  // INVALID_ARGUMENT: not an E57 file, cut off, or its header contradicts itself;
  // UNIMPLEMENTED: of a version other than 1.
  static absl::StatusOr<PagedBytes> Open(bytes::ByteSource file);

  // Bytes without checksums.
  uint64_t size() const { return file_.size() / page_ * (page_ - kChecksum); }
  // The description of what is in the file.
  uint64_t xml_begin() const { return xml_begin_; }
  uint64_t xml_size() const { return xml_size_; }

  // INVALID_ARGUMENT: beyond the file, or within a checksum.
  absl::StatusOr<uint64_t> Logical(uint64_t physical) const;
  // Copies `size` bytes. INVALID_ARGUMENT: beyond the end; DATA_LOSS: a page's checksum is wrong.
  absl::Status Read(uint64_t begin, size_t size, char* out);

 private:
  static constexpr uint64_t kChecksum = 4;  // bytes

  PagedBytes(bytes::ByteSource file, uint64_t page, uint64_t xml_begin, uint64_t xml_size)
      : file_(std::move(file)),
        page_(page),
        xml_begin_(xml_begin),
        xml_size_(xml_size),
        checked_(file_.size() / page) {}
  // The data of a page whose checksum is right; valid until the next call.
  absl::StatusOr<absl::string_view> PageData(uint64_t page);

  bytes::ByteSource file_;
  uint64_t page_;  // bytes, checksum included
  uint64_t xml_begin_;
  uint64_t xml_size_;
  std::vector<bool> checked_;  // by page
};

}  // namespace vantage::e57

#endif  // VANTAGE_CORE_E57_PAGED_BYTES_H_

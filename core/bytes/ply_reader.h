// PLY files read: ascii and binary of both byte orders, any elements and properties.
#ifndef VANTAGE_CORE_BYTES_PLY_READER_H_
#define VANTAGE_CORE_BYTES_PLY_READER_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/bytes/ply.h"

namespace vantage::bytes {

enum class PlyFormat { kAscii, kBinaryLittleEndian, kBinaryBigEndian };

// Nothing that a file announces takes memory or time beyond a small multiple of its own size.
class PlyReader {
 public:
  // What one instance of an element holds, by property: a scalar's one value, or a list's.
  using Instance = std::vector<std::vector<double>>;
  // Gets the instances of an element with their numbers; whatever is not OK ends the reading.
  using Take = absl::FunctionRef<absl::Status(uint64_t index, const Instance& instance)>;

  // Reads the header. `bytes` must outlive the reader. INVALID_ARGUMENT names the line.
  static absl::StatusOr<PlyReader> Open(absl::string_view bytes);

  PlyFormat format() const { return format_; }
  const std::vector<PlyElement>& elements() const { return elements_; }

  // All instances of one element; the first call is about elements()[0], the next about the one
  // after it. INVALID_ARGUMENT: truncated or damaged, naming element and instance. OUT_OF_RANGE:
  // there are no more elements.
  absl::Status ReadElement(Take take);

 private:
  PlyReader() = default;
  absl::Status ReadHeader(absl::string_view bytes);
  absl::Status CheckCount(const PlyElement& element) const;
  // False at the end of the data or where no number is.
  bool NextValue(PlyType type, double& value);
  bool NextInstance(const PlyElement& element, Instance& instance);
  size_t left() const { return data_.size() - at_; }

  PlyFormat format_ = PlyFormat::kAscii;
  std::vector<PlyElement> elements_;
  size_t next_element_ = 0;
  absl::string_view data_;  // after the header
  size_t at_ = 0;
};

}  // namespace vantage::bytes

#endif  // VANTAGE_CORE_BYTES_PLY_READER_H_

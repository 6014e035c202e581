// Reads PLY files: ascii and binary of both byte orders, any elements and properties.
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

// Whatever a file announces, reading it takes no memory or time beyond a small multiple of its
// size.
class PlyReader {
 public:
  // The values of one instance of an element, by property: one of a scalar, or those of a list.
  using Instance = std::vector<std::vector<double>>;
  // Is called for each instance of an element with its number; an error ends the reading.
  using Take = absl::FunctionRef<absl::Status(uint64_t index, const Instance& instance)>;

  // Reads the header. `bytes` must outlive the reader. INVALID_ARGUMENT names the line.
  static absl::StatusOr<PlyReader> Open(absl::string_view bytes);

  PlyFormat format() const { return format_; }
  const std::vector<PlyElement>& elements() const { return elements_; }

  // Reads all instances of one element: the first call those of elements()[0], the next those of
  // the element after it. INVALID_ARGUMENT: truncated or damaged, naming element and instance.
  // OUT_OF_RANGE: there are no more elements.
  absl::Status ReadElement(Take take);

 private:
  PlyReader() = default;
  absl::Status ReadHeader(absl::string_view bytes);
  absl::Status CheckCount(const PlyElement& element) const;
  // False at the end of the data or where there is no number.
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

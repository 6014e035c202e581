// Writes PLY files, binary little-endian, piece by piece: a header, then the instances of its
// elements in order.
#ifndef VANTAGE_CORE_BYTES_PLY_WRITER_H_
#define VANTAGE_CORE_BYTES_PLY_WRITER_H_

#include <string>
#include <vector>

#include "absl/strings/string_view.h"
#include "core/bytes/byte_order.h"
#include "core/bytes/ply.h"

namespace vantage::bytes {

// Each line of `comment` becomes one of the header; names are without line breaks.
std::string EncodePlyHeader(absl::string_view comment, const std::vector<PlyElement>& elements);

// Appends the values of an instance, of exactly the types in the header; their number comes before
// those of a list.
template <typename... Values>
void AppendPlyValues(std::string& out, Values... values) {
  (AppendLittleEndian(values, out), ...);
}

}  // namespace vantage::bytes

#endif  // VANTAGE_CORE_BYTES_PLY_WRITER_H_

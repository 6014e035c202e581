// Numbers in files: unaligned, little-endian in formats of ours, and in either order in others.
#ifndef VANTAGE_CORE_BYTES_BYTE_ORDER_H_
#define VANTAGE_CORE_BYTES_BYTE_ORDER_H_

#include <algorithm>
#include <bit>
#include <cstring>
#include <string>
#include <type_traits>

namespace vantage::bytes {

static_assert(std::endian::native == std::endian::little,
              "Load and Append copy bytes as they are: only little-endian machines");

// The caller guarantees that sizeof(T) bytes follow.
template <typename T>
T LoadLittleEndian(const char* bytes) {
  static_assert(std::is_arithmetic_v<T>);
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

// The same for a number that is stored big-endian.
template <typename T>
T LoadBigEndian(const char* bytes) {
  char reversed[sizeof(T)];
  std::reverse_copy(bytes, bytes + sizeof(T), reversed);
  return LoadLittleEndian<T>(reversed);
}

template <typename T>
void AppendLittleEndian(T value, std::string& out) {
  static_assert(std::is_arithmetic_v<T>);
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  out.append(bytes, sizeof(T));
}

}  // namespace vantage::bytes

#endif  // VANTAGE_CORE_BYTES_BYTE_ORDER_H_

// Numbers as they lie in files: little-endian, unaligned.
#ifndef VANTAGE_CORE_SENSOR_BYTE_ORDER_H_
#define VANTAGE_CORE_SENSOR_BYTE_ORDER_H_

#include <bit>
#include <cstring>
#include <string>
#include <type_traits>

namespace vantage {

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

template <typename T>
void AppendLittleEndian(T value, std::string& out) {
  static_assert(std::is_arithmetic_v<T>);
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  out.append(bytes, sizeof(T));
}

}  // namespace vantage

#endif  // VANTAGE_CORE_SENSOR_BYTE_ORDER_H_

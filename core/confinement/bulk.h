// Numbers and arrays of numbers as parts of an answer. Both sides are the same program, so that
// they travel as they lie in memory.
#ifndef VANTAGE_CORE_CONFINEMENT_BULK_H_
#define VANTAGE_CORE_CONFINEMENT_BULK_H_

#include <algorithm>
#include <cstddef>
#include <type_traits>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace vantage::confinement {

using SayBytes = absl::FunctionRef<void(absl::string_view bytes)>;
// The next so many bytes, or why there are none.
using HearBytes = absl::FunctionRef<absl::Status(char* to, size_t size)>;

template <typename T>
void SayValue(const T& value, SayBytes say) {
  static_assert(std::is_trivially_copyable_v<T>);
  say({reinterpret_cast<const char*>(&value), sizeof(value)});
}

template <typename T>
void SayVector(const std::vector<T>& values, SayBytes say) {
  say({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)});
}

template <typename T>
absl::Status HearValue(HearBytes hear, T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  return hear(reinterpret_cast<char*>(&value), sizeof(value));
}

// `count` is of a stranger: the caller has compared it with what may be heard. Memory is used as it
// is filled.
template <typename T>
absl::Status HearVector(HearBytes hear, size_t count, std::vector<T>& values) {
  constexpr size_t kPiece = 1 << 18;
  values.reserve(count);  // address space only
  while (values.size() < count) {
    const size_t begin = values.size();
    const size_t piece = std::min(kPiece, count - begin);
    values.resize(begin + piece);
    absl::Status heard = hear(reinterpret_cast<char*>(values.data() + begin), piece * sizeof(T));
    if (!heard.ok()) return heard;
  }
  return absl::OkStatus();
}

}  // namespace vantage::confinement

#endif  // VANTAGE_CORE_CONFINEMENT_BULK_H_

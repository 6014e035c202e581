// Writing and reading the bytes of a snapshot's sections. Little-endian; whole numbers of any size
// as varints (seven bits a byte, lowest first).
#ifndef VANTAGE_CORE_MODEL_SNAPSHOT_SNAPSHOT_BYTES_H_
#define VANTAGE_CORE_MODEL_SNAPSHOT_SNAPSHOT_BYTES_H_

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "absl/strings/string_view.h"
#include "core/bytes/byte_order.h"

namespace vantage::model {

class SnapshotWriter {
 public:
  template <typename T>
  void Fixed(T value) {
    bytes::AppendLittleEndian(value, bytes_);
  }
  void Varint(uint64_t value) {
    for (; value >= 0x80; value >>= 7) bytes_.push_back(static_cast<char>(value | 0x80));
    bytes_.push_back(static_cast<char>(value));
  }
  void Raw(const void* data, size_t size) { bytes_.append(static_cast<const char*>(data), size); }
  void Text(absl::string_view text) {
    Varint(text.size());
    Raw(text.data(), text.size());
  }
  template <typename Derived>
  void Matrix(const Eigen::MatrixBase<Derived>& matrix) {
    for (int c = 0; c < matrix.cols(); ++c) {
      for (int r = 0; r < matrix.rows(); ++r) Fixed(matrix(r, c));
    }
  }

  std::string Take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

// Reads zeros past the end and from then on is not ok(): a decoder checks where a value decides how
// much follows, and at its end.
class SnapshotReader {
 public:
  explicit SnapshotReader(absl::string_view bytes) : at_(bytes.data()), left_(bytes.size()) {}

  bool ok() const { return ok_; }
  void Fail() { ok_ = false; }
  size_t left() const { return left_; }

  template <typename T>
  T Fixed() {
    if (!Has(sizeof(T))) return T{};
    const T value = bytes::LoadLittleEndian<T>(at_);
    Skip(sizeof(T));
    return value;
  }
  uint64_t Varint() {
    uint64_t value = 0;
    for (int shift = 0; shift < 64 && Has(1); shift += 7) {
      const auto byte = static_cast<uint8_t>(*at_);
      Skip(1);
      value |= uint64_t{byte & 0x7fu} << shift;
      if (byte < 0x80) return value;
    }
    ok_ = false;
    return 0;
  }
  // A count of things of which each takes at least `least` bytes: never more than can follow.
  size_t Count(size_t least) {
    const uint64_t count = Varint();
    if (count > left_ / least) ok_ = false;
    return ok_ ? static_cast<size_t>(count) : 0;
  }
  // `size` bytes, or null.
  const char* Raw(size_t size) {
    if (!Has(size)) return nullptr;
    const char* data = at_;
    Skip(size);
    return data;
  }
  std::string Text() {
    const size_t size = Count(1);
    const char* data = Raw(size);
    return data == nullptr ? "" : std::string(data, size);
  }
  template <typename Derived>
  void Matrix(Eigen::MatrixBase<Derived>& matrix) {
    for (int c = 0; c < matrix.cols(); ++c) {
      for (int r = 0; r < matrix.rows(); ++r) matrix(r, c) = Fixed<typename Derived::Scalar>();
    }
  }

 private:
  bool Has(size_t size) {
    if (left_ < size) ok_ = false;
    return ok_;
  }
  void Skip(size_t size) {
    at_ += size;
    left_ -= size;
  }

  const char* at_;
  size_t left_;
  bool ok_ = true;
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_SNAPSHOT_SNAPSHOT_BYTES_H_

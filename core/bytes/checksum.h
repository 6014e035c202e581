// Checksums of data that are sent, computed at both ends, and of data that are stored.
#ifndef VANTAGE_CORE_BYTES_CHECKSUM_H_
#define VANTAGE_CORE_BYTES_CHECKSUM_H_

#include <cstdint>
#include <memory>
#include <string>

#include "absl/strings/string_view.h"

namespace vantage::bytes {

// CRC-32C (Castagnoli, reflected, as in RFC 3720).
uint32_t Crc32c(absl::string_view bytes);

// SHA-256 of bytes that arrive in pieces.
class Sha256 {
 public:
  Sha256();
  ~Sha256();
  Sha256(Sha256&&) noexcept;
  Sha256& operator=(Sha256&&) noexcept;

  void Update(absl::string_view bytes);

  // The digest, 32 bytes, of everything so far. Updates may go on afterwards.
  std::string Digest() const;

  static std::string Of(absl::string_view bytes);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vantage::bytes

#endif  // VANTAGE_CORE_BYTES_CHECKSUM_H_

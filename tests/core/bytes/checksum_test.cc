// Checksums against published values.
#include "core/bytes/checksum.h"

#include <gtest/gtest.h>

#include <string>

#include "absl/strings/escaping.h"

namespace vantage::bytes {
namespace {

// RFC 3720, appendix B.4.
TEST(Crc32c, PublishedVectors) {
  EXPECT_EQ(Crc32c(std::string(32, '\0')), 0x8A9136AAU);
  EXPECT_EQ(Crc32c(std::string(32, '\xFF')), 0x62A8AB43U);
  std::string rising;
  for (char c = 0; c < 32; ++c) rising += c;
  EXPECT_EQ(Crc32c(rising), 0x46DD794EU);
  EXPECT_EQ(Crc32c("123456789"), 0xE3069283U);
  EXPECT_EQ(Crc32c(""), 0U);
}

// FIPS 180-4 examples.
TEST(Sha256, PublishedVectorsAndPieces) {
  EXPECT_EQ(absl::BytesToHexString(Sha256::Of("abc")),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  Sha256 pieces;
  pieces.Update("a");
  EXPECT_EQ(pieces.Digest(), Sha256::Of("a"));
  pieces.Update("bc");
  EXPECT_EQ(pieces.Digest(), Sha256::Of("abc"));
}

}  // namespace
}  // namespace vantage::bytes

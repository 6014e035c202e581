// Checksums and compression against published values.
#include <gtest/gtest.h>

#include <random>
#include <string>

#include "absl/strings/escaping.h"
#include "proto/wire/checksum.h"
#include "proto/wire/compression.h"

namespace vantage {
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

TEST(Zstd, RoundTripAndBounds) {
  std::mt19937 random(7);
  std::string bytes(100'000, '\0');
  for (char& c : bytes) c = static_cast<char>(random() % 7);
  const std::string frame = ZstdCompress(bytes);
  EXPECT_LT(frame.size(), bytes.size() / 2);
  EXPECT_EQ(ZstdDecompress(frame, bytes.size()).value(), bytes);
  EXPECT_FALSE(ZstdDecompress(frame, bytes.size() - 1).ok());
  EXPECT_FALSE(ZstdDecompress(frame, bytes.size() + 1).ok());
  EXPECT_FALSE(ZstdDecompress(frame + "x", bytes.size()).ok());
  EXPECT_FALSE(ZstdDecompress(frame.substr(0, frame.size() - 1), bytes.size()).ok());
  EXPECT_FALSE(ZstdDecompress("garbage", 10).ok());
  EXPECT_FALSE(ZstdDecompress("", 0).ok());
}

}  // namespace
}  // namespace vantage

#include "core/bytes/compression.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace vantage::bytes {
namespace {

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
}  // namespace vantage::bytes

#include "core/bytes/ply_writer.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "core/bytes/ply_reader.h"

namespace vantage::bytes {
namespace {

TEST(PlyWriter, HeaderNamesEveryTypeAndList) {
  EXPECT_EQ(EncodePlyHeader("a test, m", {{"vertex",
                                           2,
                                           {{"a", PlyType::kInt8},
                                            {"b", PlyType::kUint8},
                                            {"c", PlyType::kInt16},
                                            {"d", PlyType::kUint16},
                                            {"e", PlyType::kInt32},
                                            {"f", PlyType::kUint32},
                                            {"g", PlyType::kFloat},
                                            {"h", PlyType::kDouble}}},
                                          {"face", 0, {{"l", PlyType::kInt32, PlyType::kUint8}}}}),
            "ply\nformat binary_little_endian 1.0\ncomment a test, m\nelement vertex 2\n"
            "property char a\nproperty uchar b\nproperty short c\nproperty ushort d\n"
            "property int e\nproperty uint f\nproperty float g\nproperty double h\n"
            "element face 0\nproperty list uchar int l\nend_header\n");
}

TEST(PlyWriter, WhatIsWrittenIsReadBack) {
  std::string file = EncodePlyHeader(
      "", {{"vertex", 2, {{"x", PlyType::kDouble}, {"flag", PlyType::kUint8}}},
           {"face", 1, {{"corners", PlyType::kUint16, PlyType::kUint8}, {"g", PlyType::kFloat}}}});
  AppendPlyValues(file, 0.1, uint8_t{255});
  AppendPlyValues(file, -1e300, uint8_t{0});
  AppendPlyValues(file, uint8_t{3}, uint16_t{0}, uint16_t{65'535}, uint16_t{1}, 0.5f);
  absl::StatusOr<PlyReader> reader = PlyReader::Open(file);
  ASSERT_TRUE(reader.ok()) << reader.status();
  EXPECT_EQ(reader->format(), PlyFormat::kBinaryLittleEndian);
  std::vector<PlyReader::Instance> read;
  const auto keep = [&](uint64_t, const PlyReader::Instance& instance) {
    read.push_back(instance);
    return absl::OkStatus();
  };
  ASSERT_TRUE(reader->ReadElement(keep).ok());
  ASSERT_TRUE(reader->ReadElement(keep).ok());
  const std::vector<PlyReader::Instance> expected = {
      {{0.1}, {255}}, {{-1e300}, {0}}, {{0, 65'535, 1}, {0.5}}};
  EXPECT_EQ(read, expected);
}

}  // namespace
}  // namespace vantage::bytes

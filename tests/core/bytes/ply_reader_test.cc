#include "core/bytes/ply_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/bytes/byte_order.h"

namespace vantage::bytes {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr char kElements[] =
    "comment of all types\nobj_info nothing\nelement row 2\nproperty char a\nproperty uint8 b\n"
    "property int16 c\nproperty ushort d\nproperty int e\nproperty uint32 f\nproperty float g\n"
    "property float64 h\nproperty list short uchar l\nelement end 1\nproperty uchar last\n"
    "end_header\n";

std::string Header(const std::string& format) {
  return absl::StrCat("ply\nformat ", format, " 1.0\n", kElements);
}

template <typename T>
void Append(T value, bool big_endian, std::string& out) {
  const size_t at = out.size();
  AppendLittleEndian(value, out);
  if (big_endian) std::reverse(out.begin() + static_cast<ptrdiff_t>(at), out.end());
}

std::string Binary(bool big_endian) {
  std::string file = Header(big_endian ? "binary_big_endian" : "binary_little_endian");
  for (int16_t row = 0; row < 2; ++row) {
    Append(int8_t{-128}, big_endian, file);
    Append(uint8_t{255}, big_endian, file);
    Append(int16_t{-32'768}, big_endian, file);
    Append(uint16_t{65'535}, big_endian, file);
    Append(int32_t{-2'147'483'648}, big_endian, file);
    Append(uint32_t{4'294'967'295}, big_endian, file);
    Append(0.1f, big_endian, file);
    Append(0.1, big_endian, file);
    Append(row, big_endian, file);
    for (int16_t i = 0; i < row; ++i) Append(uint8_t{200}, big_endian, file);
  }
  Append(uint8_t{9}, big_endian, file);
  return file;
}

std::string Ascii() {
  return Header("ascii") +
         "-128 255 -32768 65535 -2147483648 4294967295 0.100000001490116119384765625 0.1 0\n"
         "-128 255 -32768 65535\t-2147483648 4294967295\n+0.100000001490116119384765625 1e-1 1 "
         "200\r\n9";
}

struct Contents {
  absl::Status status;
  std::vector<PlyReader::Instance> instances;
};
Contents Read(const std::string& file) {
  Contents contents;
  absl::StatusOr<PlyReader> reader = PlyReader::Open(file);
  contents.status = reader.status();
  for (size_t i = 0; contents.status.ok() && i < reader->elements().size(); ++i) {
    uint64_t next = 0;
    contents.status = reader->ReadElement([&](uint64_t index, const PlyReader::Instance& instance) {
      EXPECT_EQ(index, next++);
      contents.instances.push_back(instance);
      return absl::OkStatus();
    });
  }
  return contents;
}

TEST(PlyReader, ReadsEveryTypeInEveryFormat) {
  const PlyReader::Instance scalars = {{-128},         {255},           {-32'768},
                                       {65'535},       {-2147483648.0}, {4294967295.0},
                                       {double{0.1f}}, {0.1},           {}};
  std::vector<PlyReader::Instance> expected = {scalars, scalars, {{9}}};
  expected[1].back() = {200};
  for (const std::string& file : {Binary(false), Binary(true), Ascii()}) {
    const Contents contents = Read(file);
    EXPECT_TRUE(contents.status.ok()) << contents.status;
    EXPECT_EQ(contents.instances, expected);
    // Every truncation is refused.
    for (size_t size = 0; size < file.size(); ++size) {
      const std::string cut = file.substr(0, size);
      EXPECT_EQ(Read(cut).status.code(), absl::StatusCode::kInvalidArgument) << size;
    }
  }
}

TEST(PlyReader, FindsPropertiesByNameAndKind) {
  const std::string file =
      "ply\nformat ascii 1.0\nelement e 0\nproperty float x\nproperty list uchar int x\n"
      "property int x\nend_header\n";
  const absl::StatusOr<PlyReader> reader = PlyReader::Open(file);
  ASSERT_TRUE(reader.ok()) << reader.status();
  ASSERT_EQ(reader->elements().size(), 1u);
  const PlyElement& element = reader->elements()[0];
  EXPECT_EQ(element.FindScalar("x"), 2u);
  EXPECT_EQ(element.FindList("x"), 1u);
  EXPECT_EQ(element.FindScalar("y"), std::nullopt);
}

TEST(PlyReader, EndsWhereTheOneWhoTakesSaysSo) {
  const std::string file =
      "ply\nformat ascii 1.0\nelement e 3\nproperty int x\nend_header\n1 2 3\n";
  absl::StatusOr<PlyReader> reader = PlyReader::Open(file);
  ASSERT_TRUE(reader.ok()) << reader.status();
  std::vector<double> taken;
  const auto take = [&](uint64_t, const PlyReader::Instance& instance) {
    taken.push_back(instance[0][0]);
    return taken.size() == 2 ? absl::CancelledError() : absl::OkStatus();
  };
  EXPECT_TRUE(absl::IsCancelled(reader->ReadElement(take)));
  EXPECT_THAT(taken, ElementsAre(1, 2));
  EXPECT_TRUE(absl::IsOutOfRange(reader->ReadElement(take)));
}

std::string Message(const std::string& file) {
  const absl::Status status = Read(file).status;
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
  return std::string(status.message());
}

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(PlyReader, RefusesWithTheCause) {
  EXPECT_THAT(Message(""), HasSubstr("is this a PLY file?"));
  EXPECT_THAT(Message("ply\nformat ascii 1.0\n"), HasSubstr("no end_header"));
  EXPECT_THAT(Message("ply\nend_header\n"), HasSubstr("states no format"));
  EXPECT_THAT(Message("ply\nformat ebcdic 1.0\nend_header\n"), HasSubstr("line 2"));
  EXPECT_THAT(Message("ply\nformat ascii 1.0\nproperty int x\n"), HasSubstr("line 3"));
  EXPECT_THAT(
      Message(std::string("ply\nformat ascii 1.0\n") + std::string(1000, '\n') + "end_header\n"),
      HasSubstr("no end_header"));
  for (const char* type :
       {"half", "list uchar", "list float", "list half int", "list uchar half"}) {
    EXPECT_THAT(Message(Replaced(Ascii(), "property char", absl::StrCat("property ", type))),
                HasSubstr("line 6: 'property"))
        << type;
  }
  for (const char* count : {"-1", "x", "99999999999999999999"}) {
    EXPECT_THAT(Message(Replaced(Ascii(), "row 2", absl::StrCat("row ", count))),
                HasSubstr("line 5"))
        << count;
  }
  const std::string binary = Binary(false);
  EXPECT_THAT(Message(Replaced(binary, "row 2", "row 18446744073709551615")),
              HasSubstr("element row: 18446744073709551615 do not fit into the"));
  EXPECT_THAT(Message("ply\nformat ascii 1.0\nelement e 1\nend_header\n1 1 1"),
              HasSubstr("no properties"));
  EXPECT_THAT(Message(Replaced(Ascii(), " 200", " two")), HasSubstr("element row 1 of 2"));
  // A list that is longer than what is left, or of no length at all.
  for (const char* length : {"30000", "-1", "0.5", "nan", "inf"}) {
    EXPECT_THAT(Message(Replaced(Ascii(), " 1 200", absl::StrCat(" ", length, " 200"))),
                HasSubstr("element row 1 of 2"))
        << length;
  }
}

}  // namespace
}  // namespace vantage::bytes

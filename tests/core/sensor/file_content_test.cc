#include "core/sensor/file_content.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <optional>
#include <random>
#include <string>

#include "core/bytes/byte_source.h"
#include "core/confinement/allowance.h"
#include "core/sensor/confined_scan_file.h"
#include "core/sensor/encoding.h"
#include "tests/core/sensor/analytic_room.h"
#include "tests/support/scan_files.h"

namespace vantage::sensor {
namespace {

using namespace std::string_literals;
using ::testing::HasSubstr;

RangeImage AnalyticImage() {
  RangeImage image;
  image.azimuth = Evenly(-3.1, 0.05, 124);
  image.elevation = Evenly(-1.0, 0.05, 50);
  image.native_azimuth_step = 0.05;
  image.native_elevation_step = 0.05;
  for (const double azimuth : image.azimuth) {
    for (const double elevation : image.elevation) {
      image.range.push_back(static_cast<float>(RoomRange(DirectionOf(azimuth, elevation))));
    }
  }
  return image;
}

FileContent Of(const std::string& bytes, const std::string& name = "scan.e57") {
  return ContentOf(absl::string_view(bytes).substr(0, kContentHead), bytes.size(), name);
}

TEST(FileContent, TellsScansByHowTheyBeginWhateverTheyAreCalled) {
  const std::string head(200, ' ');
  struct Case {
    std::string bytes;
    ScanFormat format;
  };
  for (const Case& scan :
       {Case{"# .PCD v0.7 - Point Cloud Data\nVERSION 0.7\n"s, ScanFormat::kPcd},
        Case{"VERSION 0.7\nFIELDS x y z\nDATA binary\n\x01\x02\0"s, ScanFormat::kPcd},
        Case{"ply\r\nformat binary_little_endian 1.0\r\n"s, ScanFormat::kPly},
        Case{"1440\r\n600\r\n0 0 0\r\n1 0 0\r\n0 1 0\r\n"s, ScanFormat::kPtx},
        Case{"12345\n1.0 2.0 3.0 17 255 255 255\n"s, ScanFormat::kXyz},
        Case{"# made by hand\n//X;Y;Z\nX;Y;Z\n1,5;2;-3e2\n"s, ScanFormat::kXyz}}) {
    const FileContent content = Of(scan.bytes, "holiday.jpg");
    EXPECT_EQ(content.refusal, FileRefusal::kNone) << scan.bytes << content.why;
    EXPECT_EQ(content.format, scan.format) << scan.bytes;
  }
}

TEST(FileContent, SaysWhatAFileIsThatIsNoScan) {
  struct Case {
    std::string bytes;
    const char* words;
    FileRefusal refusal = FileRefusal::kNotAScan;
  };
  for (const Case& other :
       {Case{"\xff\xd8\xff\xe0\0\x10JFIF"s, "this is a photo (JPEG), not a scan"},
        Case{"\x89PNG\r\n\x1a\n"s, "a picture (PNG)"},
        Case{"\0\0\0\x18"
             "ftypheic"s,
             "a photo (HEIC)"},
        Case{"\0\0\0\x18"
             "ftypqt  "s,
             "a video"},
        Case{"%PDF-1.7\n"s, "a document (PDF)"},
        Case{"PK\x03\x04\x14\0\0\0\x08\0"s, "a ZIP archive"},
        Case{"PK\x03\x04\x14\0\x01\0\x08\0"s, "an archive with a password",
             FileRefusal::kEncrypted},
        Case{"Salted__0123456789"s, "encrypted (OpenSSL)", FileRefusal::kEncrypted},
        Case{"Dear Sir or Madam,\n"s, "text without coordinates"},
        Case{"\x01\x02\x03"s, "a file of an unknown kind"},
        Case{std::string(5000, '\0'), "nothing but zeros", FileRefusal::kCutOff},
        Case{"", "the file is empty", FileRefusal::kCutOff}}) {
    const FileContent content = Of(other.bytes);
    EXPECT_EQ(content.refusal, other.refusal) << other.words;
    EXPECT_THAT(std::string(content.why.message()), HasSubstr(other.words));
  }
}

TEST(FileContent, AVendorsFormatIsNamedByTheEndingOnly) {
  EXPECT_EQ(Of("\x01\x02\x03", "flat.FLS").refusal, FileRefusal::kFormatNotRead);
  EXPECT_THAT(std::string(Of("\x01\x02\x03", "flat.FLS").why.message()), HasSubstr("vendor"));
  std::string laz = "LASF" + std::string(300, '\0');
  laz[104] = static_cast<char>(0x80);
  EXPECT_EQ(Of(laz, "a.las").refusal, FileRefusal::kFormatNotRead);
}

// What is encrypted or compressed has all bytes equally often; what is binary otherwise has not.
TEST(FileContent, NoiseIsToldFromOtherBytes) {
  std::mt19937 random(7);
  int noise = 0;
  for (int i = 0; i < 50; ++i) {
    std::string bytes(20'000, '\0');
    for (char& c : bytes) c = static_cast<char>(random());
    bytes[0] = '\x01';
    noise += Of(bytes).refusal == FileRefusal::kEncrypted ? 1 : 0;
  }
  EXPECT_GE(noise, 49);
  std::string floats;
  for (int i = 0; i < 5000; ++i) {
    const float value = 0.001F * static_cast<float>(i);
    floats.append(reinterpret_cast<const char*>(&value), sizeof(value));
  }
  EXPECT_EQ(Of("\x01" + floats).refusal, FileRefusal::kNotAScan);
}

TEST(FileContent, WhatWasCutOffIsToldWhereTheBeginningSaysHowLongItIs) {
  const RangeImage image = AnalyticImage();
  for (const std::string& whole : {test_support::E57Of(image), EncodeRangeImage(image)}) {
    EXPECT_EQ(Of(whole).refusal, FileRefusal::kNone);
    for (const size_t left : {whole.size() - 1, whole.size() / 2, size_t{60}, size_t{10}}) {
      EXPECT_EQ(Of(whole.substr(0, left)).refusal, FileRefusal::kCutOff) << left;
    }
  }
}

// The confined reader says the same, and reads what is a scan.
TEST(FileContent, AConfinedReaderTellsByContent) {
  const RangeImage image = AnalyticImage();
  const auto open = [&](const std::string& bytes, FileRefusal& refusal) {
    const std::string path = testing::TempDir() + "/holiday.jpg";
    std::ofstream(path, std::ios::binary) << bytes;
    return ConfinedScanFile::OfContent("holiday.jpg", bytes::ByteSource::Open(path).value(),
                                       std::nullopt, {}, refusal);
  };
  FileRefusal refusal = FileRefusal::kNotAScan;
  auto file = open(test_support::E57Of(image), refusal);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(refusal, FileRefusal::kNone);
  const auto scan = file->Read(0, {});
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->image.columns(), image.columns());
  const auto photo = open("\xff\xd8\xff\xe0", refusal);
  EXPECT_EQ(refusal, FileRefusal::kNotAScan);
  EXPECT_EQ(photo.status().message(),
            "holiday.jpg: this is a photo (JPEG), not a scan; export the scan as structured E57 or "
            "PTX, and send that");
  EXPECT_EQ(open("1 2 3\n4 5 6\n", refusal).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(refusal, FileRefusal::kStationMissing);
  EXPECT_EQ(open(test_support::E57Of(image).substr(0, 3000), refusal).status().code(),
            absl::StatusCode::kDataLoss);
  EXPECT_EQ(refusal, FileRefusal::kCutOff);
}

TEST(FileContent, AReaderThatIsGivenUpEnds) {
  const std::string path = testing::TempDir() + "/given-up.ptx";
  std::ofstream(path, std::ios::binary) << test_support::PtxOf(AnalyticImage());
  confinement::AllowanceSettings allowance;
  allowance.given_up = [] { return true; };
  FileRefusal refusal = FileRefusal::kNone;
  const auto file = ConfinedScanFile::OfContent("a", bytes::ByteSource::Open(path).value(),
                                                std::nullopt, allowance, refusal);
  EXPECT_EQ(file.status().code(), absl::StatusCode::kCancelled) << file.status();
}

}  // namespace
}  // namespace vantage::sensor

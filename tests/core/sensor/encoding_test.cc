#include "core/sensor/encoding.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <ostream>
#include <random>

namespace vantage::sensor {
namespace {

constexpr size_t kMaxCells = 1'000'000;
constexpr auto kAll = RangeImageDecoder::Keep::kAll;

// A valid image with irregular axes, all three kinds of cell and extreme ranges.
RangeImage RandomImage(uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  RangeImage image;
  const auto columns = static_cast<int>(2 + random() % 40);
  const auto rows = static_cast<int>(2 + random() % 40);
  double azimuth = uniform(-3.2, -3.0);
  for (int i = 0; i < columns; ++i) image.azimuth.push_back(azimuth += uniform(1e-6, 0.15));
  double elevation = -1.5;
  for (int i = 0; i < rows; ++i) image.elevation.push_back(elevation += uniform(1e-6, 0.07));
  image.full_turn = random() % 2 == 0;
  image.native_azimuth_step = uniform(1e-5, 0.1);
  image.native_elevation_step = uniform(1e-5, 0.1);
  for (size_t i = 0; i < image.cells(); ++i) {
    const uint64_t kind = random() % 8;
    float range = static_cast<float>(uniform(0.5, 20));
    if (kind == 0) range = RangeImage::kNoReturn;
    if (kind == 1) range = RangeImage::kNoInformation;
    if (kind == 2) range = static_cast<float>(uniform(1e-4, 1000));
    image.range.push_back(range);
  }
  image.range[0] = 1000.0f;
  const auto of_cells = [&](auto& values, const auto& make) {
    if (random() % 2 == 0) return;
    values.resize(image.cells());
    for (size_t i = 0; i < values.size(); ++i) {
      if (RangeImage::IsRange(image.range[i])) values[i] = make();
    }
  };
  of_cells(image.appearance.intensity, [&] { return static_cast<uint16_t>(random()); });
  of_cells(image.appearance.colour, [&] {
    return Colour{static_cast<uint8_t>(random()), static_cast<uint8_t>(random()), 0};
  });
  return image;
}

TEST(EncodingTest, RoundTripsWithinHalfAUnit) {
  for (uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE(seed);
    const RangeImage image = RandomImage(seed);
    ASSERT_TRUE(image.Validate().ok()) << image.Validate();
    const std::string bytes = EncodeRangeImage(image);
    EXPECT_EQ(bytes.size(),
              EncodedSize(image.azimuth.size(), image.elevation.size(), image.appearance.kinds()));
    const absl::StatusOr<RangeImage> decoded = DecodeRangeImage(bytes, kMaxCells, kAll);
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(decoded->appearance.intensity, image.appearance.intensity);
    EXPECT_EQ(decoded->appearance.colour, image.appearance.colour);
    EXPECT_EQ(decoded->azimuth, image.azimuth);
    EXPECT_EQ(decoded->elevation, image.elevation);
    EXPECT_EQ(decoded->full_turn, image.full_turn);
    EXPECT_EQ(decoded->native_azimuth_step, image.native_azimuth_step);
    EXPECT_EQ(decoded->native_elevation_step, image.native_elevation_step);
    ASSERT_EQ(decoded->range.size(), image.range.size());
    for (size_t i = 0; i < image.range.size(); ++i) {
      const float before = image.range[i];
      const float after = decoded->range[i];
      if (RangeImage::IsRange(before)) {
        // Half a unit, and half a float's spacing at 1 km.
        EXPECT_NEAR(after, before, 0.5 * kEncodedRangeUnit + 4e-5);
        EXPECT_TRUE(RangeImage::IsRange(after));
      } else {
        EXPECT_EQ(after, before);
      }
    }
    EXPECT_EQ(EncodeRangeImage(*decoded), bytes);
  }
}

TEST(EncodingTest, WhateverDecodesEncodesToTheSameBytes) {
  std::mt19937_64 random(7);
  int decoded_mutants = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string bytes = EncodeRangeImage(RandomImage(random() % 50));
    for (uint64_t flips = 1 + random() % 3; flips > 0; --flips) {
      bytes[random() % bytes.size()] ^= static_cast<char>(1 << random() % 8);
    }
    const absl::StatusOr<RangeImage> decoded = DecodeRangeImage(bytes, kMaxCells, kAll);
    if (!decoded.ok()) continue;
    ++decoded_mutants;
    ASSERT_TRUE(decoded->Validate().ok());
    ASSERT_EQ(EncodeRangeImage(*decoded), bytes) << "mutant " << i;
  }
  EXPECT_GT(decoded_mutants, 1000);
}

// Property: however it is cut, a decoder finds what is found in the whole: image or error.
TEST(EncodingTest, PiecesCutAnywhereAreTheWhole) {
  std::mt19937_64 random(17);
  int wrong = 0;
  for (int i = 0; i < 3'000; ++i) {
    std::string bytes = EncodeRangeImage(RandomImage(random() % 50));
    const uint64_t spoilt = random() % 4;
    if (spoilt == 0) bytes[random() % bytes.size()] ^= static_cast<char>(1 << random() % 8);
    if (spoilt == 1) bytes.resize(random() % bytes.size());
    if (spoilt == 2) bytes.append(random() % 5, 'x');
    const absl::StatusOr<RangeImage> whole = DecodeRangeImage(bytes, kMaxCells, kAll);
    wrong += whole.ok() ? 0 : 1;
    RangeImageDecoder kept(kMaxCells, kAll);
    RangeImageDecoder checked(kMaxCells, RangeImageDecoder::Keep::kNothing);
    for (size_t at = 0; at < bytes.size();) {
      const size_t size = std::min<size_t>(random() % 100, bytes.size() - at);
      const absl::Status taken = kept.Take(bytes.substr(at, size));
      EXPECT_EQ(checked.Take(bytes.substr(at, size)), taken);
      at += size;
    }
    const auto contents = checked.Finish();
    const absl::StatusOr<RangeImage> image = std::move(kept).FinishImage();
    EXPECT_EQ(contents.status(), image.status());
    ASSERT_EQ(image.ok(), whole.ok()) << image.status() << whole.status();
    if (!image.ok()) continue;
    EXPECT_EQ(contents->samples, whole->SampleCount());
    EXPECT_EQ(contents->columns, whole->azimuth.size());
    EXPECT_EQ(contents->rows, whole->elevation.size());
    EXPECT_EQ(image->range, whole->range);
    EXPECT_EQ(contents->appearance.colour, whole->appearance.kinds().colour);
    EXPECT_EQ(EncodeRangeImage(*image), bytes);
  }
  EXPECT_GT(wrong, 1000);
}

TEST(EncodingTest, NeverRoundsAReturnAwayAndDropsWhatIsBeyondAKilometre) {
  RangeImage image = RandomImage(1);
  image.range[0] = 1e-6f;
  image.range[1] = 1000.1f;
  image.range[2] = 3.0f;
  const absl::StatusOr<RangeImage> decoded = DecodeRangeImage(EncodeRangeImage(image), kMaxCells);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_FLOAT_EQ(decoded->range[0], 1e-4f);
  EXPECT_EQ(decoded->range[1], RangeImage::kNoReturn);
  EXPECT_FLOAT_EQ(decoded->range[2], 3.0f);
}

struct BadBytes {
  const char* name;
  void (*spoil)(std::string& bytes);
  absl::StatusCode code;
  const char* says;
};
// What test names show.
void PrintTo(const BadBytes& tested, std::ostream* out) { *out << tested.name; }

template <typename T>
void Put(std::string& bytes, size_t offset, T value) {
  std::memcpy(bytes.data() + offset, &value, sizeof(T));
}

class BadEncodingTest : public testing::TestWithParam<BadBytes> {};

TEST_P(BadEncodingTest, IsRefusedWithTheCause) {
  RangeImage image = RandomImage(3);
  image.appearance = {};
  std::string bytes = EncodeRangeImage(image);
  GetParam().spoil(bytes);
  const absl::StatusOr<RangeImage> decoded = DecodeRangeImage(bytes, kMaxCells);
  EXPECT_EQ(decoded.status().code(), GetParam().code) << decoded.status();
  EXPECT_NE(decoded.status().message().find(GetParam().says), absl::string_view::npos)
      << decoded.status();
}

INSTANTIATE_TEST_SUITE_P(
    Spoilt, BadEncodingTest,
    testing::Values(BadBytes{"Empty", [](std::string& b) { b.clear(); },
                             absl::StatusCode::kInvalidArgument, "header"},
                    BadBytes{"Magic", [](std::string& b) { b[0] = 'X'; },
                             absl::StatusCode::kInvalidArgument, "magic"},
                    BadBytes{"Version", [](std::string& b) { b[4] = 9; },
                             absl::StatusCode::kInvalidArgument, "version 9"},
                    BadBytes{"Flags", [](std::string& b) { b[7] = 1; },
                             absl::StatusCode::kInvalidArgument, "flags"},
                    BadBytes{"NoColumns", [](std::string& b) { Put<uint32_t>(b, 8, 0); },
                             absl::StatusCode::kInvalidArgument, "0 columns"},
                    BadBytes{"Huge",
                             [](std::string& b) {
                               Put<uint32_t>(b, 8, 0xFFFFFFFF);
                               Put<uint32_t>(b, 12, 0xFFFFFFFF);
                             },
                             absl::StatusCode::kInvalidArgument, "4294967295 columns"},
                    BadBytes{"AboveTheLimit", [](std::string& b) { Put<uint32_t>(b, 8, 500'001); },
                             absl::StatusCode::kInvalidArgument, "limit of 1000000 cells"},
                    BadBytes{"TooManyColumns",
                             [](std::string& b) {
                               Put<uint32_t>(b, 8, 300'000);
                               Put<uint32_t>(b, 12, 2);
                             },
                             absl::StatusCode::kInvalidArgument, "no more than 262144"},
                    BadBytes{"Truncated", [](std::string& b) { b.pop_back(); },
                             absl::StatusCode::kInvalidArgument, "truncated"},
                    BadBytes{"Padded", [](std::string& b) { b.push_back(0); },
                             absl::StatusCode::kInvalidArgument, "padded"},
                    BadBytes{"NanStep", [](std::string& b) { Put<double>(b, 16, std::nan("")); },
                             absl::StatusCode::kInvalidArgument, "native_azimuth_step"},
                    BadBytes{"NegativeStep", [](std::string& b) { Put<double>(b, 24, -1); },
                             absl::StatusCode::kInvalidArgument, "native_elevation_step"},
                    BadBytes{"NanElevation",
                             [](std::string& b) { Put<double>(b, 32, std::nan("")); },
                             absl::StatusCode::kInvalidArgument, "elevation"},
                    BadBytes{"RangeOutOfBounds", [](std::string& b) { b[b.size() - 1] = 0x7f; },
                             absl::StatusCode::kInvalidArgument, "range outside"}),
    [](const auto& suite) { return suite.param.name; });

}  // namespace
}  // namespace vantage::sensor

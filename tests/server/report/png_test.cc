// Pictures, read back by libpng itself.
#include "server/report/png.h"

#include <gtest/gtest.h>
#include <png.h>

namespace vantage::report {
namespace {

TEST(Png, ComesBackPixelByPixel) {
  const PngColour palette[] = {{0, 0, 0, 0}, {250, 10, 20}, {1, 2, 3, 128}};
  PaletteImage image{37, 11, {}};
  for (int i = 0; i < image.width * image.height; ++i) {
    image.pixels.push_back(static_cast<uint8_t>(i * 7 % 3));
  }
  const std::string file = EncodePng(image, palette);
  png_image read{};
  read.version = PNG_IMAGE_VERSION;
  ASSERT_NE(png_image_begin_read_from_memory(&read, file.data(), file.size()), 0) << read.message;
  EXPECT_EQ(read.width, 37U);
  EXPECT_EQ(read.height, 11U);
  read.format = PNG_FORMAT_RGBA;
  std::vector<uint8_t> pixels(PNG_IMAGE_SIZE(read));
  ASSERT_NE(png_image_finish_read(&read, nullptr, pixels.data(), 0, nullptr), 0) << read.message;
  for (size_t i = 0; i < image.pixels.size(); ++i) {
    const PngColour& colour = palette[image.pixels[i]];
    ASSERT_EQ(pixels[4 * i + 3], colour.alpha);
    if (colour.alpha == 0) continue;
    ASSERT_EQ(pixels[4 * i], colour.red);
    ASSERT_EQ(pixels[4 * i + 1], colour.green);
    ASSERT_EQ(pixels[4 * i + 2], colour.blue);
  }
}

}  // namespace
}  // namespace vantage::report

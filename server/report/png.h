// Pictures of few colours as PNG.
#ifndef VANTAGE_SERVER_REPORT_PNG_H_
#define VANTAGE_SERVER_REPORT_PNG_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace vantage::report {

struct PngColour {
  uint8_t red = 0;
  uint8_t green = 0;
  uint8_t blue = 0;
  uint8_t alpha = 255;
};

// Row after row from the top, an index into the palette each.
struct PaletteImage {
  int width = 0;
  int height = 0;
  std::vector<uint8_t> pixels;
};

// At most 256 colours, width and height > 0. Throws std::bad_alloc where there is no memory left.
std::string EncodePng(const PaletteImage& image, std::span<const PngColour> palette);

}  // namespace vantage::report

#endif  // VANTAGE_SERVER_REPORT_PNG_H_

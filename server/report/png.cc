#include "server/report/png.h"

#include <png.h>

#include <new>

namespace vantage::report {
namespace {

// libpng jumps over frames where something fails, so that nothing with a destructor may live in the
// function that it jumps to, and nothing be thrown through its own.
struct PngSink {
  std::string* out;
  bool full = false;
};

void AppendPng(png_structp png, png_bytep bytes, png_size_t size) {
  auto* sink = static_cast<PngSink*>(png_get_io_ptr(png));
  try {
    sink->out->append(reinterpret_cast<const char*>(bytes), size);  // NOLINT: bytes
  } catch (const std::bad_alloc&) {
    sink->full = true;
  }
}

bool WritePalettePng(const PaletteImage& image, std::span<const PngColour> palette,
                     const png_color* colours, const png_byte* alphas, PngSink* sink) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  if (png == nullptr) return false;
  png_infop info = png_create_info_struct(png);
  if (info == nullptr || setjmp(png_jmpbuf(png)) != 0) {  // NOLINT: libpng's way
    png_destroy_write_struct(&png, &info);
    return false;
  }
  png_set_write_fn(png, sink, AppendPng, nullptr);
  png_set_IHDR(png, info, static_cast<png_uint_32>(image.width),
               static_cast<png_uint_32>(image.height), 8, PNG_COLOR_TYPE_PALETTE,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_PLTE(png, info, colours, static_cast<int>(palette.size()));
  png_set_tRNS(png, info, alphas, static_cast<int>(palette.size()), nullptr);
  png_write_info(png, info);
  for (int y = 0; y < image.height; ++y) {
    png_write_row(png, image.pixels.data() + static_cast<size_t>(y) * image.width);
  }
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return !sink->full;
}

}  // namespace

std::string EncodePng(const PaletteImage& image, std::span<const PngColour> palette) {
  std::vector<png_color> colours;
  std::vector<png_byte> alphas;
  for (const PngColour& colour : palette) {
    colours.push_back({colour.red, colour.green, colour.blue});
    alphas.push_back(colour.alpha);
  }
  std::string out;
  PngSink sink{&out};
  // Nothing but memory can be short: what is asked for is a picture that there is.
  if (!WritePalettePng(image, palette, colours.data(), alphas.data(), &sink)) {
    throw std::bad_alloc();
  }
  return out;
}

}  // namespace vantage::report

#include "core/site_prior/plan_picture.h"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace vantage::site_prior {
namespace {

constexpr double kFinestCell = 0.02;  // m: no wall is thinner
constexpr size_t kMostCells = 16'000'000;
// What is dark, smaller than this (m) and not mostly filled is a letter or a symbol.
constexpr double kLetter = 0.6;
constexpr double kFilled = 0.6;
constexpr double kStroke = 0.12;  // m: what is as thin and no longer is one, too; pillars are not

void RemoveLetters(PlanRaster& plan) {
  std::vector<uint8_t> seen(plan.wall.size(), 0);
  const auto width = static_cast<size_t>(plan.width);
  std::vector<size_t> piece;
  for (size_t start = 0; start < plan.wall.size(); ++start) {
    if (plan.wall[start] == 0 || seen[start] != 0) continue;
    piece.assign(1, start);
    seen[start] = 1;
    int x0 = plan.width;
    int y0 = plan.height;
    int x1 = -1;
    int y1 = -1;
    for (size_t head = 0; head < piece.size(); ++head) {
      const auto x = static_cast<int>(piece[head] % width);
      const auto y = static_cast<int>(piece[head] / width);
      x0 = std::min(x0, x);
      x1 = std::max(x1, x);
      y0 = std::min(y0, y);
      y1 = std::max(y1, y);
      for (int v = std::max(0, y - 1); v <= std::min(plan.height - 1, y + 1); ++v) {
        for (int u = std::max(0, x - 1); u <= std::min(plan.width - 1, x + 1); ++u) {
          const size_t to = static_cast<size_t>(v) * width + static_cast<size_t>(u);
          if (plan.wall[to] == 0 || seen[to] != 0) continue;
          seen[to] = 1;
          piece.push_back(to);
        }
      }
    }
    const double extent = std::max(x1 - x0 + 1, y1 - y0 + 1) * plan.cell;
    const double filled = static_cast<double>(piece.size()) /
                          (static_cast<double>(x1 - x0 + 1) * static_cast<double>(y1 - y0 + 1));
    const double least = std::min(x1 - x0 + 1, y1 - y0 + 1) * plan.cell;
    if (extent > kLetter || (least > kStroke && filled >= kFilled)) continue;
    for (const size_t cell : piece) plan.wall[cell] = 0;
  }
}

}  // namespace

absl::StatusOr<PlanRaster> ReadPlanPicture(absl::string_view bytes, double metres, double darkest) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()) == 0) {
    return absl::InvalidArgumentError(absl::StrCat("the picture is no PNG: ", image.message));
  }
  const size_t pixels = static_cast<size_t>(image.width) * image.height;
  if (pixels > kMostPlanCells) {
    png_image_free(&image);
    return absl::InvalidArgumentError(absl::StrCat(
        "the picture has ", pixels, " pixels, more than ", kMostPlanCells, ": make it smaller"));
  }
  image.format = PNG_FORMAT_GRAY;
  std::vector<uint8_t> grey(pixels);
  const png_color white = {255, 255, 255};
  if (png_image_finish_read(&image, &white, grey.data(), 0, nullptr) == 0) {
    return absl::InvalidArgumentError(absl::StrCat("the picture is damaged: ", image.message));
  }
  size_t thin = static_cast<size_t>(std::max(1.0, std::floor(kFinestCell / metres + 1e-9)));
  while ((image.width / thin + 1) * (image.height / thin + 1) > kMostCells) ++thin;
  PlanRaster plan;
  plan.cell = metres * static_cast<double>(thin);
  plan.width = static_cast<int>((image.width + thin - 1) / thin);
  plan.height = static_cast<int>((image.height + thin - 1) / thin);
  plan.origin = {0, -plan.height * plan.cell};
  plan.wall.assign(static_cast<size_t>(plan.width) * static_cast<size_t>(plan.height), 0);
  const auto dark = static_cast<uint8_t>(std::clamp(darkest * 255, 0.0, 255.0));
  for (size_t row = 0; row < image.height; ++row) {
    const int y = plan.height - 1 - static_cast<int>(row / thin);
    for (size_t column = 0; column < image.width; ++column) {
      if (grey[row * image.width + column] < dark) {
        plan.At(static_cast<int>(column / thin), y) = 1;
      }
    }
  }
  RemoveLetters(plan);
  return plan;
}

}  // namespace vantage::site_prior

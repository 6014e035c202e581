#include "client/picture/tour_picture.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vantage::picture {
namespace {

int PixelsOf(const Canvas& canvas, const Colour& colour) {
  int count = 0;
  for (int y = 0; y < canvas.height(); ++y) {
    for (int x = 0; x < canvas.width(); ++x) {
      const Colour at = canvas.PixelAt(x, y);
      const double off =
          std::abs(at.r - colour.r) + std::abs(at.g - colour.g) + std::abs(at.b - colour.b);
      count += off < 0.03 ? 1 : 0;
    }
  }
  return count;
}

TourPicture TwoTours() {
  TourPicture picture;
  picture.title = "flat";
  picture.tours.resize(2);
  picture.tours[0] = {"one", {{{1, 1}, {}, true}, {{4, 1}, {{1, 1}, {4, 1}}, true}}};
  picture.tours[1] = {"two", {{{1, 3}, {}, true}}};
  return picture;
}

TEST(TourPicture, EachScannerHasItsColour) {
  const Canvas canvas = DrawTourPicture(TwoTours());
  EXPECT_GT(PixelsOf(canvas, Distinct(0)), PixelsOf(canvas, Distinct(1)));
  EXPECT_GT(PixelsOf(canvas, Distinct(1)), 300);
  EXPECT_EQ(PixelsOf(canvas, Distinct(2)), 0);
}

TEST(TourPicture, WaysAreDrawn) {
  TourPicture without = TwoTours();
  without.tours[0].stops[1].way.clear();
  EXPECT_GT(PixelsOf(DrawTourPicture(TwoTours()), Distinct(0)),
            PixelsOf(DrawTourPicture(without), Distinct(0)) + 1000);
}

TEST(TourPicture, NothingIsStillAPicture) {
  const Canvas canvas = DrawTourPicture({});
  EXPECT_GT(canvas.width(), 0);
  EXPECT_GT(canvas.height(), 0);
}

TEST(Palette, DistinctColoursDiffer) {
  for (int i = 0; i < kDistinctColours; ++i) {
    for (int j = 0; j < i; ++j) EXPECT_FALSE(Distinct(i) == Distinct(j)) << i << " " << j;
  }
}

}  // namespace
}  // namespace vantage::picture

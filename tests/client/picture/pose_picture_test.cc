#include "client/picture/pose_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace vantage::picture {
namespace {

int Dots(const Canvas& canvas, const Colour& colour) {
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

int Differences(const Canvas& a, const Canvas& b) {
  EXPECT_EQ(a.width(), b.width());
  int count = 0;
  for (int y = 0; y < std::min(a.height(), b.height()); ++y) {
    for (int x = 0; x < a.width(); ++x) count += a.PixelAt(x, y) == b.PixelAt(x, y) ? 0 : 1;
  }
  return count;
}

// A wall of 6 m, and what a scan sees of it.
PosePicture Wall(double residual, PosePicture::Mark mark, int poses = 1) {
  PosePicture picture;
  picture.title = "Scan s2: doubtful";
  picture.largest_residual = 0.01;
  PosePicture::Pose pose;
  pose.title = "Pose 1";
  pose.station = {0, -2, 1.5};
  for (double x = -3; x < 3; x += 0.1) {
    for (double z = 0; z < 2.5; z += 0.1) {
      picture.surface.push_back({{x, 0, z}, -Eigen::Vector3f::UnitY()});
      pose.samples.push_back({{x, residual, z}, -Eigen::Vector3f::UnitY(), residual, mark});
    }
  }
  picture.poses.assign(static_cast<size_t>(poses), pose);
  return picture;
}

constexpr Colour kVermilion = Rgb(0xd55e00);

TEST(PosePicture, TheScaleGoesFromLightToDark) {
  double lighter = 1e9;
  for (const double residual : {0.0, 0.005, 0.01, 0.1}) {
    const Canvas canvas = DrawPosePicture(Wall(residual, PosePicture::Mark::kFits));
    const Colour expected = Viridis(0.82 * (1 - std::min(1.0, residual / 0.01)));
    EXPECT_GT(Dots(canvas, expected), 300) << residual;
    const double light = 0.21 * expected.r + 0.72 * expected.g + 0.07 * expected.b;
    EXPECT_LE(light, lighter) << "without colour vision it is told by its lightness";
    lighter = light;
  }
}

TEST(PosePicture, WhatContradictsIsMarkedInPlanAndSection) {
  const int legend = Dots(DrawPosePicture(Wall(0, PosePicture::Mark::kFits)), kVermilion);
  for (const auto mark : {PosePicture::Mark::kInEmptySpace, PosePicture::Mark::kBehindSurface}) {
    EXPECT_GT(Dots(DrawPosePicture(Wall(0.5, mark)), kVermilion), legend + 500);
  }
}

TEST(PosePicture, EachPoseHasItsPanels) {
  const auto fits = [](int poses) {
    return Dots(DrawPosePicture(Wall(0.0, PosePicture::Mark::kFits, poses)), Viridis(0.82));
  };
  EXPECT_GT(fits(2), 1.2 * fits(1));
  EXPECT_GT(fits(3), fits(2));
}

TEST(PosePicture, PlacesAndWhatIsSeenThroughAreDrawn) {
  PosePicture picture = Wall(0, PosePicture::Mark::kFits);
  const Canvas without = DrawPosePicture(picture);
  for (size_t i = 0; i < 600; ++i) picture.poses[0].seen_through.push_back(i);
  const Canvas through = DrawPosePicture(picture);
  EXPECT_GT(Differences(without, through), 500);
  picture.poses[0].places.push_back(
      {{1, 0, 1}, {Eigen::Vector3d(0, -1, 0), Eigen::Vector3d(2, 1, 2)}, "1.2 m2: a wall"});
  EXPECT_GT(Differences(DrawPosePicture(picture), through), 500);
}

TEST(PosePicture, NarrowWideEmptyAndManyAreStillPictures) {
  PosePicture wide = Wall(0, PosePicture::Mark::kFits, 5);
  for (PosePicture::Pose& pose : wide.poses) {
    for (PosePicture::Sample& s : pose.samples) s.at.x() *= 20;
  }
  for (const Canvas& canvas : {DrawPosePicture(wide)}) {
    EXPECT_LE(canvas.width(), 1900);
    EXPECT_LE(canvas.height(), 6000);
  }
  const Canvas nothing = DrawPosePicture({});
  EXPECT_GT(nothing.width(), 0);
  PosePicture bare;
  bare.poses.resize(1);
  EXPECT_GT(DrawPosePicture(bare).height(), 0);
}

}  // namespace
}  // namespace vantage::picture

// Compares all bytes of a session's PLY exports, since other people's tools read them.
#include "server/session/ply.h"

#include <gtest/gtest.h>

#include <string>

#include "core/bytes/byte_order.h"

namespace vantage::session {
namespace {

TEST(SessionPly, SamplesAreWrittenColumnAfterColumn) {
  EXPECT_EQ(SamplesPlyHeader(12'345'678'901, {}),
            "ply\nformat binary_little_endian 1.0\ncomment registered samples, m, world frame\n"
            "comment x y z: as measured; scan: the number of the scan in this file, from 1\n"
            "element vertex 12345678901\nproperty double x\nproperty double y\nproperty double z\n"
            "property uint scan\nend_header\n");
  sensor::RangeImage image;
  image.azimuth = {0, 0.1};
  image.elevation = {0, 0.1};
  image.range = {2, sensor::RangeImage::kNoReturn, sensor::RangeImage::kNoInformation, 0.5};
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = Eigen::Vector3d(1, -2, 3);
  const Eigen::Vector3d last = pose * (0.5 * image.Direction(1, 1));
  std::string expected;
  for (const Eigen::Vector3d& p : {Eigen::Vector3d(3, -2, 3), last}) {
    for (int axis = 0; axis < 3; ++axis) bytes::AppendLittleEndian(p[axis], expected);
    bytes::AppendLittleEndian(uint32_t{7}, expected);
  }
  EXPECT_EQ(SamplesPlyBody(image, pose, 7, {}), expected);
  EXPECT_EQ(expected.size(), static_cast<size_t>(2 * SamplePlyBytes({})));
}

TEST(SessionPly, SamplesHaveTheIntensityAndColourThatAnyScanHas) {
  const std::string header = SamplesPlyHeader(1, {true, true});
  EXPECT_NE(header.find("property uint scan\nproperty ushort intensity\nproperty uchar red\n"
                        "property uchar green\nproperty uchar blue\nend_header\n"),
            std::string::npos)
      << header;
  sensor::RangeImage image;
  image.azimuth = {0, 0.1};
  image.elevation = {0, 0.1};
  image.range = {2, 0, 0, 0};
  image.appearance.intensity = {0x1234, 0, 0, 0};
  image.appearance.colour = {{1, 2, 3}, {}, {}, {}};
  const Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  const std::string all = SamplesPlyBody(image, pose, 7, {true, true});
  EXPECT_EQ(all.substr(28), std::string("\x34\x12\x01\x02\x03"));
  EXPECT_EQ(all.size(), static_cast<size_t>(SamplePlyBytes({true, true})));
  image.appearance = {};
  const std::string none = SamplesPlyBody(image, pose, 7, {false, true});
  EXPECT_EQ(none.substr(28), std::string(3, '\0'));
}

void Set(double x, double y, double z, v1::Vector3& v) {
  v.set_x(x);
  v.set_y(y);
  v.set_z(z);
}

TEST(SessionPly, PatchesAreQuadrilaterals) {
  v1::PlanResult result;
  for (int i = 0; i < 2; ++i) {
    v1::Patch& patch = *result.add_patches();
    patch.set_kind(v1::SURFACE_KIND_HOLE_BOUNDARY);
    Set(10 * i, 0, 1, *patch.mutable_centre());
    Set(0, 0, 1, *patch.mutable_normal());
    Set(1, 0, 0, *patch.mutable_axis_u());
    patch.set_length_u_m(4);
    patch.set_length_v_m(2);
    patch.set_deficit(0.125 + i);
  }
  std::string expected =
      "ply\nformat binary_little_endian 1.0\ncomment deficient patches, m, world frame\n"
      "comment kind: 1 measured, 2 occlusion, 3 hole, 4 image boundary; deficit: samples\n"
      "element vertex 8\nproperty double x\nproperty double y\nproperty double z\nelement face 2\n"
      "property list uchar uint vertex_indices\nproperty uchar kind\nproperty double deficit\n"
      "end_header\n";
  for (int i = 0; i < 2; ++i) {
    for (const auto& [u, v] : {std::pair(-2, -1), {2, -1}, {2, 1}, {-2, 1}}) {
      bytes::AppendLittleEndian(10.0 * i + u, expected);
      bytes::AppendLittleEndian(static_cast<double>(v), expected);
      bytes::AppendLittleEndian(1.0, expected);
    }
  }
  for (uint32_t i = 0; i < 2; ++i) {
    bytes::AppendLittleEndian(uint8_t{4}, expected);
    for (uint32_t corner = 0; corner < 4; ++corner)
      bytes::AppendLittleEndian(4 * i + corner, expected);
    bytes::AppendLittleEndian(static_cast<uint8_t>(v1::SURFACE_KIND_HOLE_BOUNDARY), expected);
    bytes::AppendLittleEndian(0.125 + i, expected);
  }
  EXPECT_EQ(PatchesPly(result), expected);
}

}  // namespace
}  // namespace vantage::session

#include "server/session/ply.h"

#include <bit>
#include <cstring>

#include "absl/strings/str_cat.h"

namespace vantage {
namespace {

static_assert(std::endian::native == std::endian::little, "PLY bodies are copied as they are");

template <typename T>
void Put(T value, std::string& out) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  out.append(bytes, sizeof(T));
}

Eigen::Vector3d Read(const v1::Vector3& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

std::string SamplesPlyHeader(int64_t samples) {
  return absl::StrCat(
      "ply\nformat binary_little_endian 1.0\ncomment registered samples, m, world frame\n"
      "element vertex ",
      samples,
      "\nproperty double x\nproperty double y\nproperty double z\nproperty uint scan\n"
      "end_header\n");
}

std::string SamplesPlyBody(const RangeImage& image, const Eigen::Isometry3d& T_world_scan,
                           uint32_t scan) {
  std::string out;
  out.reserve(image.SampleCount() * static_cast<size_t>(kSamplePlyBytes));
  for (int column = 0; column < image.columns(); ++column) {
    for (int row = 0; row < image.rows(); ++row) {
      const float range = image.at(column, row);
      if (!RangeImage::IsRange(range)) continue;
      const Eigen::Vector3d point =
          T_world_scan * (static_cast<double>(range) * image.Direction(column, row));
      for (int axis = 0; axis < 3; ++axis) Put(point[axis], out);
      Put(scan, out);
    }
  }
  return out;
}

std::string PatchesPly(const v1::PlanResult& result) {
  std::string out = absl::StrCat(
      "ply\nformat binary_little_endian 1.0\ncomment patches that need work, m, world frame\n"
      "element vertex ",
      4 * result.patches_size(),
      "\nproperty double x\nproperty double y\nproperty double z\nelement face ",
      result.patches_size(),
      "\nproperty list uchar uint vertex_indices\nproperty uchar kind\nproperty double deficit\n"
      "end_header\n");
  for (const v1::Patch& patch : result.patches()) {
    const Eigen::Vector3d u = 0.5 * patch.length_u() * Read(patch.axis_u());
    const Eigen::Vector3d v =
        0.5 * patch.length_v() * Read(patch.normal()).cross(Read(patch.axis_u()));
    const Eigen::Vector3d centre = Read(patch.centre());
    for (const Eigen::Vector3d& corner :
         {Eigen::Vector3d(centre - u - v), Eigen::Vector3d(centre + u - v),
          Eigen::Vector3d(centre + u + v), Eigen::Vector3d(centre - u + v)}) {
      for (int axis = 0; axis < 3; ++axis) Put(corner[axis], out);
    }
  }
  uint32_t first = 0;
  for (const v1::Patch& patch : result.patches()) {
    Put(uint8_t{4}, out);
    for (uint32_t i = 0; i < 4; ++i) Put(first + i, out);
    first += 4;
    Put(static_cast<uint8_t>(patch.kind()), out);
    Put(patch.deficit(), out);
  }
  return out;
}

}  // namespace vantage

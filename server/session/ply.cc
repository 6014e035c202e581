#include "server/session/ply.h"

#include "core/bytes/ply_writer.h"
#include "server/conversion/to_proto.h"

namespace vantage::session {

std::string SamplesPlyHeader(int64_t samples, const sensor::AppearanceKinds& appearance) {
  bytes::PlyElement vertex = {"vertex",
                              static_cast<uint64_t>(samples),
                              {{"x", bytes::PlyType::kDouble},
                               {"y", bytes::PlyType::kDouble},
                               {"z", bytes::PlyType::kDouble},
                               {"scan", bytes::PlyType::kUint32}}};
  std::string comment =
      "registered samples, m, world frame\nx y z: as measured; scan: the number of the scan in "
      "this file, from 1";
  if (appearance.intensity) {
    vertex.properties.push_back({"intensity", bytes::PlyType::kUint16});
    comment += "; intensity: of 65535";
  }
  if (appearance.colour) {
    for (const char* name : {"red", "green", "blue"}) {
      vertex.properties.push_back({name, bytes::PlyType::kUint8});
    }
    comment += "; red green blue: of 255";
  }
  if (appearance.any()) comment += "; 0 in scans without them";
  return bytes::EncodePlyHeader(comment, {vertex});
}

int64_t SamplePlyBytes(const sensor::AppearanceKinds& appearance) {
  return 3 * 8 + 4 + (appearance.intensity ? 2 : 0) + (appearance.colour ? 3 : 0);
}

std::string SamplesPlyBody(const sensor::RangeImage& image, const Eigen::Isometry3d& T_world_scan,
                           uint32_t scan, const sensor::AppearanceKinds& appearance) {
  const sensor::Appearance& looks = image.appearance;
  std::string out;
  out.reserve(image.SampleCount() * static_cast<size_t>(SamplePlyBytes(appearance)));
  for (int column = 0; column < image.columns(); ++column) {
    for (int row = 0; row < image.rows(); ++row) {
      const size_t cell = image.Index(column, row);
      const float range = image.range[cell];
      if (!sensor::RangeImage::IsRange(range)) continue;
      const Eigen::Vector3d point =
          T_world_scan * (static_cast<double>(range) * image.Direction(column, row));
      bytes::AppendPlyValues(out, point.x(), point.y(), point.z(), scan);
      if (appearance.intensity) {
        bytes::AppendPlyValues(out, looks.intensity.empty() ? uint16_t{0} : looks.intensity[cell]);
      }
      if (appearance.colour) {
        const sensor::Colour colour = looks.colour.empty() ? sensor::Colour{} : looks.colour[cell];
        bytes::AppendPlyValues(out, colour[0], colour[1], colour[2]);
      }
    }
  }
  return out;
}

std::string PatchesPly(const v1::PlanResult& result) {
  const auto patches = static_cast<uint64_t>(result.patches_size());
  const bytes::PlyElement vertex = {"vertex",
                                    4 * patches,
                                    {{"x", bytes::PlyType::kDouble},
                                     {"y", bytes::PlyType::kDouble},
                                     {"z", bytes::PlyType::kDouble}}};
  const bytes::PlyElement face = {
      "face",
      patches,
      {{"vertex_indices", bytes::PlyType::kUint32, bytes::PlyType::kUint8},
       {"kind", bytes::PlyType::kUint8},
       {"deficit", bytes::PlyType::kDouble}}};
  std::string out = bytes::EncodePlyHeader(
      "deficient patches, m, world frame\n"
      "kind: 1 measured, 2 occlusion, 3 hole, 4 image boundary; deficit: samples",
      {vertex, face});
  for (const v1::Patch& patch : result.patches()) {
    const Eigen::Vector3d u = 0.5 * patch.length_u_m() * conversion::ReadOwnVector(patch.axis_u());
    const Eigen::Vector3d v =
        0.5 * patch.length_v_m() *
        conversion::ReadOwnVector(patch.normal()).cross(conversion::ReadOwnVector(patch.axis_u()));
    const Eigen::Vector3d centre = conversion::ReadOwnVector(patch.centre());
    for (const Eigen::Vector3d& corner :
         {Eigen::Vector3d(centre - u - v), Eigen::Vector3d(centre + u - v),
          Eigen::Vector3d(centre + u + v), Eigen::Vector3d(centre - u + v)}) {
      bytes::AppendPlyValues(out, corner.x(), corner.y(), corner.z());
    }
  }
  uint32_t first = 0;
  for (const v1::Patch& patch : result.patches()) {
    bytes::AppendPlyValues(out, uint8_t{4}, first, first + 1, first + 2, first + 3,
                           static_cast<uint8_t>(patch.kind()), patch.deficit());
    first += 4;
  }
  return out;
}

}  // namespace vantage::session

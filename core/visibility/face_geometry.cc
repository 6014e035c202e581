#include "core/visibility/face_geometry.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

namespace vantage::visibility {
namespace {

// A rectangle of faces in one plane: [u0, u1) x [v0, v1), u along the bits of a row.
struct FaceRectangle {
  int u0, u1, v0, v1;
};

uint64_t RunMask(int first, int last) {  // bits [first, last) of a word
  const uint64_t upper = last == 64 ? ~uint64_t{0} : (uint64_t{1} << last) - 1;
  return upper & ~((uint64_t{1} << first) - 1);
}

bool AllSet(const uint64_t* row, int u0, int u1) {
  for (int w = u0 >> 6; w <= (u1 - 1) >> 6; ++w) {
    const uint64_t mask = RunMask(std::max(u0 - 64 * w, 0), std::min(u1 - 64 * w, 64));
    if ((row[w] & mask) != mask) return false;
  }
  return true;
}

void Clear(uint64_t* row, int u0, int u1) {
  for (int w = u0 >> 6; w <= (u1 - 1) >> 6; ++w) {
    row[w] &= ~RunMask(std::max(u0 - 64 * w, 0), std::min(u1 - 64 * w, 64));
  }
}

// Covers the set bits of a bitmap by rectangles: the longest run first met, then down as far as it
// goes. Consumes the bitmap.
void MergeFaces(std::vector<uint64_t>& bits, size_t words, int rows,
                std::vector<FaceRectangle>& out) {
  for (int v = 0; v < rows; ++v) {
    uint64_t* row = bits.data() + static_cast<size_t>(v) * words;
    for (size_t w = 0; w < words; ++w) {
      while (row[w] != 0) {
        const int u0 = static_cast<int>(w) * 64 + std::countr_zero(row[w]);
        int u1 = u0;
        for (size_t at = w; at < words; ++at) {
          const int skip = at == w ? u0 & 63 : 0;
          const int run = std::min(std::countr_one(row[at] >> skip), 64 - skip);
          u1 += run;
          if (skip + run < 64) break;
        }
        int v1 = v + 1;
        while (v1 < rows && AllSet(bits.data() + static_cast<size_t>(v1) * words, u0, u1)) ++v1;
        for (int r = v; r < v1; ++r) Clear(bits.data() + static_cast<size_t>(r) * words, u0, u1);
        out.push_back({u0, u1, v, v1});
      }
    }
  }
}

// Rectangles by axis and plane: plane i of an axis lies between voxels i - 1 and i, counted from
// the grid's corner.
using Planes = std::array<std::vector<std::vector<FaceRectangle>>, 3>;

// The axes along and across the rows of a plane's bitmap.
constexpr int UAxis(int axis) { return axis == 0 ? 1 : 0; }
constexpr int VAxis(int axis) { return axis == 2 ? 1 : 2; }

// The voxels of a brick's layer across an axis: bit u + 8 v.
uint64_t Layer(const model::BrickMask& mask, int axis, int at) {
  if (axis == 2) return mask.word[static_cast<size_t>(at)];
  uint64_t layer = 0;
  for (size_t z = 0; z < mask.word.size(); ++z) {
    // Of the eight bits that are wanted of a word, those along y are eight apart.
    const uint64_t bits =
        axis == 1 ? mask.word[z] >> (8 * at) & 0xff
                  : ((mask.word[z] >> at & 0x0101010101010101) * 0x0102040810204080) >> 56;
    layer |= bits << (8 * z);
  }
  return layer;
}

// Faces in one plane between two bricks: bit u + 8 v counted from (u, v), scene coordinates.
struct BrickFaces {
  int u, v;
  uint64_t bits;
};

// The faces in a plane, brick by brick. Pages that are all alike have none within.
std::vector<BrickFaces> FacesIn(const OpaqueGrid& grid, int axis, int plane) {
  const model::VoxelIndex& min = grid.box().min;
  const int far = plane + min[axis];  // the voxels behind the plane
  const int near = far - 1;
  const int u_axis = UAxis(axis);
  const int v_axis = VAxis(axis);
  const model::VoxelIndex first = model::BrickPage::Of(model::Brick::Of(min));
  const model::VoxelIndex last =
      model::BrickPage::Of(model::Brick::Of(grid.box().max - model::VoxelIndex::Ones()));
  std::vector<BrickFaces> faces;
  model::VoxelIndex at;
  for (int pv = first[v_axis]; pv <= last[v_axis]; ++pv) {
    at[v_axis] = pv;
    for (int pu = first[u_axis]; pu <= last[u_axis]; ++pu) {
      at[u_axis] = pu;
      at[axis] = near >> 6;
      const model::BrickPage& near_page = grid.Page(at);
      at[axis] = far >> 6;
      const model::BrickPage& far_page = grid.Page(at);
      if ((near_page.all_empty() && far_page.all_empty()) ||
          (near_page.all_opaque() && far_page.all_opaque())) {
        continue;
      }
      model::VoxelIndex brick;
      for (int v = 0; v < model::BrickPage::kSide; ++v) {
        brick[v_axis] = v;
        for (int u = 0; u < model::BrickPage::kSide; ++u) {
          brick[u_axis] = u;
          brick[axis] = near >> 3 & 7;
          const model::BrickMask& near_mask = near_page.Opaque(model::Brick::LocalOf(brick));
          brick[axis] = far >> 3 & 7;
          const model::BrickMask& far_mask = far_page.Opaque(model::Brick::LocalOf(brick));
          const uint64_t bits = Layer(near_mask, axis, near & 7) ^ Layer(far_mask, axis, far & 7);
          if (bits == 0) continue;
          faces.push_back({model::BrickPage::kVoxels * pu + 8 * u - min[u_axis],
                           model::BrickPage::kVoxels * pv + 8 * v - min[v_axis], bits});
        }
      }
    }
  }
  return faces;
}

// Merges the faces of a plane: in a bitmap of the part of the plane in which there are any.
void MergePlane(const std::vector<BrickFaces>& faces, std::vector<FaceRectangle>& out) {
  if (faces.empty()) return;
  int u0 = faces[0].u, u1 = u0, v0 = faces[0].v, v1 = v0;
  for (const BrickFaces& part : faces) {
    u0 = std::min(u0, part.u);
    u1 = std::max(u1, part.u + 8);
    v0 = std::min(v0, part.v);
    v1 = std::max(v1, part.v + 8);
  }
  const size_t words = (static_cast<size_t>(u1 - u0) + 63) / 64;
  std::vector<uint64_t> bits(words * static_cast<size_t>(v1 - v0));
  for (const BrickFaces& part : faces) {
    // Bricks lie whole eights apart, so none lies across two words.
    const auto u = static_cast<size_t>(part.u - u0);
    for (int v = 0; v < 8; ++v) {
      bits[static_cast<size_t>(part.v + v - v0) * words + (u >> 6)] |= (part.bits >> (8 * v) & 0xff)
                                                                       << (u & 63);
    }
  }
  const size_t before = out.size();
  MergeFaces(bits, words, v1 - v0, out);
  for (size_t i = before; i < out.size(); ++i) {
    out[i].u0 += u0;
    out[i].u1 += u0;
    out[i].v0 += v0;
    out[i].v1 += v0;
  }
}

// The faces between empty and non-empty voxels, merged. Incomplete when cancelled.
Planes FindFaces(const OpaqueGrid& grid, parallel::Parallel& parallel,
                 const parallel::Cancellation& cancelled) {
  const model::VoxelIndex size = grid.box().max - grid.box().min;
  Planes planes;
  for (int axis = 0; axis < 3; ++axis) {
    planes[static_cast<size_t>(axis)].resize(static_cast<size_t>(size[axis]));
  }
  const auto count = static_cast<size_t>(size.x() + size.y() + size.z());
  parallel.For(count, [&](size_t slot) {
    int axis = 0;
    int plane = static_cast<int>(slot);
    while (plane >= size[axis]) plane -= size[axis++];
    if (plane == 0 || cancelled.Requested()) return;
    MergePlane(FacesIn(grid, axis, plane),
               planes[static_cast<size_t>(axis)][static_cast<size_t>(plane)]);
  });
  return planes;
}

// For each face four vertices (x, y and z, scene coordinates) and their indices.
void WriteQuads(const Planes& planes, float* vertex, uint32_t* index) {
  uint32_t next = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const int u_axis = UAxis(axis);
    const int v_axis = VAxis(axis);
    const auto& cuts = planes[static_cast<size_t>(axis)];
    for (size_t plane = 0; plane < cuts.size(); ++plane) {
      for (const FaceRectangle& face : cuts[plane]) {
        const int corner[4][2] = {
            {face.u0, face.v0}, {face.u1, face.v0}, {face.u1, face.v1}, {face.u0, face.v1}};
        for (const auto& at : corner) {
          vertex[axis] = static_cast<float>(plane);
          vertex[u_axis] = static_cast<float>(at[0]);
          vertex[v_axis] = static_cast<float>(at[1]);
          vertex += 3;
          *index++ = next++;
        }
      }
    }
  }
}

}  // namespace

RTCGeometry FaceGeometry(RTCDevice device, const OpaqueGrid& grid, parallel::Parallel& parallel,
                         const parallel::Cancellation& cancelled, size_t& count) {
  const Planes planes = FindFaces(grid, parallel, cancelled);
  count = 0;
  for (const auto& axis : planes) {
    for (const auto& plane : axis) count += plane.size();
  }
  if (count == 0 || cancelled.Requested()) return nullptr;
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_QUAD);
  auto* vertex = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), 4 * count));
  auto* index = static_cast<uint32_t*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4, 4 * sizeof(uint32_t), count));
  WriteQuads(planes, vertex, index);
  return geometry;
}

}  // namespace vantage::visibility

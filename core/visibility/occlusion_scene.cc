#include "core/visibility/occlusion_scene.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <bit>
#include <memory>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/visibility/opaque_rows.h"

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

const char* DeviceOptions(RayInstructions instructions) {
  switch (instructions) {
    case RayInstructions::kSse42:
      return "threads=1,set_affinity=0,isa=sse4.2";
    case RayInstructions::kAvx2:
      return "threads=1,set_affinity=0,isa=avx2";
    case RayInstructions::kBest:
      break;
  }
  return "threads=1,set_affinity=0";
}

// Rectangles by axis and plane: plane i of an axis lies between voxels i - 1 and i, counted from
// the grid's corner.
using Planes = std::array<std::vector<std::vector<FaceRectangle>>, 3>;

// The faces between empty and non-empty voxels, merged. Incomplete when cancelled.
Planes FindFaces(const OpaqueGrid& grid, const OpaqueRows& across, parallel::Parallel& parallel,
                 const parallel::Cancellation& cancelled) {
  const model::VoxelIndex size = grid.box().max - grid.box().min;
  const model::VoxelIndex& min = grid.box().min;
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
    const OpaqueRows& source = axis == 0 ? across : grid.rows();
    const size_t words = source.words_per_row();
    const int rows = axis == 2 ? size.y() : size.z();
    std::vector<uint64_t> bits(words * static_cast<size_t>(rows));
    bool any = false;
    for (int r = 0; r < rows; ++r) {
      const auto row = [&](int at) {
        if (axis == 0) return source.Row(min.z() + r, min.x() + at);
        return axis == 1 ? source.Row(min.y() + at, min.z() + r)
                         : source.Row(min.y() + r, min.z() + at);
      };
      const auto near = row(plane - 1);
      const auto far = row(plane);
      for (size_t w = 0; w < words; ++w) {
        const uint64_t faces = near[w] ^ far[w];
        bits[static_cast<size_t>(r) * words + w] = faces;
        any |= faces != 0;
      }
    }
    if (any) {
      MergeFaces(bits, words, rows, planes[static_cast<size_t>(axis)][static_cast<size_t>(plane)]);
    }
  });
  return planes;
}

// For each face four vertices (x, y and z, scene coordinates) and their indices.
void WriteQuads(const Planes& planes, float* vertex, uint32_t* index) {
  uint32_t next = 0;
  for (int axis = 0; axis < 3; ++axis) {
    // The axes along the rows of bits and across them, as the planes were cut above.
    const int u_axis = axis == 0 ? 1 : 0;
    const int v_axis = axis == 2 ? 1 : 2;
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

struct OcclusionScene::Tracer {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  ~Tracer() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }
};

absl::StatusOr<OcclusionScene> OcclusionScene::Create(const model::PlanningView& model,
                                                      const OpaqueGrid& grid,
                                                      parallel::Parallel& parallel,
                                                      const parallel::Cancellation& cancelled,
                                                      RayInstructions instructions) {
  const absl::Status stopped = absl::CancelledError("occlusion scene");
  const auto across = OpaqueRows::Create(model, {1, 2, 0}, cancelled);
  if (!across.ok()) return across.status();
  const Planes planes = FindFaces(grid, *across, parallel, cancelled);
  if (cancelled.Requested()) return stopped;
  size_t faces = 0;
  for (const auto& axis : planes) {
    for (const auto& plane : axis) faces += plane.size();
  }
  auto tracer = std::make_unique<Tracer>();
  tracer->device = rtcNewDevice(DeviceOptions(instructions));
  tracer->scene = rtcNewScene(tracer->device);
  rtcSetSceneFlags(tracer->scene, RTC_SCENE_FLAG_ROBUST);
  // Splitting long rectangles takes longer, but rays are a third faster for it.
  rtcSetSceneBuildQuality(tracer->scene, RTC_BUILD_QUALITY_HIGH);
  if (faces > 0) {
    RTCGeometry geometry = rtcNewGeometry(tracer->device, RTC_GEOMETRY_TYPE_QUAD);
    auto* vertex = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), 4 * faces));
    auto* index = static_cast<uint32_t*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4, 4 * sizeof(uint32_t), faces));
    WriteQuads(planes, vertex, index);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(tracer->scene, geometry);
    rtcReleaseGeometry(geometry);
  }
  // Building asks now and then whether to go on.
  parallel::Cancellation copy = cancelled;
  rtcSetSceneProgressMonitorFunction(
      tracer->scene,
      [](void* of, double) { return !static_cast<const parallel::Cancellation*>(of)->Requested(); },
      &copy);
  rtcCommitScene(tracer->scene);
  rtcSetSceneProgressMonitorFunction(tracer->scene, nullptr, nullptr);
  if (cancelled.Requested()) return stopped;
  return OcclusionScene(grid, std::move(tracer), faces);
}

OcclusionScene::OcclusionScene(const OpaqueGrid& grid, std::unique_ptr<Tracer> tracer, size_t faces)
    : corner_(grid.box().min.cast<double>()), faces_(faces), tracer_(std::move(tracer)) {}

OcclusionScene::~OcclusionScene() = default;
OcclusionScene::OcclusionScene(OcclusionScene&&) noexcept = default;
OcclusionScene& OcclusionScene::operator=(OcclusionScene&&) noexcept = default;

uint32_t OcclusionScene::Occluded(const Eigen::Vector3f& origin, const TargetPacket& targets,
                                  uint32_t valid) const {
  alignas(32) int active[8];
  RTCRay8 rays;
  for (int i = 0; i < 8; ++i) {
    active[i] = (valid >> i) & 1 ? -1 : 0;
    rays.org_x[i] = origin.x();
    rays.org_y[i] = origin.y();
    rays.org_z[i] = origin.z();
    rays.dir_x[i] = targets.x[i] - origin.x();
    rays.dir_y[i] = targets.y[i] - origin.y();
    rays.dir_z[i] = targets.z[i] - origin.z();
    rays.tnear[i] = 0.0f;
    rays.tfar[i] = 1.0f;
    rays.time[i] = 0.0f;
    rays.mask[i] = ~0u;
    rays.id[i] = 0;
    rays.flags[i] = 0;
  }
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcOccluded8(active, tracer_->scene, &context, &rays);
  uint32_t occluded = 0;
  for (int i = 0; i < 8; ++i) {
    occluded |= static_cast<uint32_t>(rays.tfar[i] < 0.0f) << i;
  }
  return occluded & valid;
}

}  // namespace vantage::visibility

#include "core/visibility/occlusion_scene.h"

#include <embree3/rtcore.h>

#include <memory>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/visibility/brick_geometry.h"
#include "core/visibility/face_geometry.h"

namespace vantage::visibility {
namespace {

// Rectangles take 150 bytes each, Embree's boxes included, and there are a dozen to a brick that is
// neither empty nor opaque; a brick takes 130. Rays through bricks take about twice as long. So
// sites of some 2,000 m2 and less, where rays decide how good an answer within a budget is, are
// traced by faces, which take up to 200 MB there; a hall of 6,000 m2 with 242,000 such bricks would
// take 570 MB and five seconds to build, and takes 48 MB and a third of a second by bricks.
constexpr size_t kMostBricksByFaces = size_t{1} << 17;

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

}  // namespace

struct OcclusionScene::Tracer {
  std::vector<OpaqueBrick> bricks;  // that the scene refers to, where it is of bricks
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  ~Tracer() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }
};

ScenePrimitives OcclusionScene::PrimitivesOf(const model::PlanningView& model) {
  return MixedBricks(model) > kMostBricksByFaces ? ScenePrimitives::kBricks
                                                 : ScenePrimitives::kFaces;
}

absl::StatusOr<OcclusionScene> OcclusionScene::Create(const OpaqueGrid& grid,
                                                      parallel::Parallel& parallel,
                                                      const parallel::Cancellation& cancelled,
                                                      const SceneOptions& options) {
  const absl::Status stopped = absl::CancelledError("occlusion scene");
  auto tracer = std::make_unique<Tracer>();
  tracer->device = rtcNewDevice(DeviceOptions(options.instructions));
  tracer->scene = rtcNewScene(tracer->device);
  rtcSetSceneFlags(tracer->scene, RTC_SCENE_FLAG_ROBUST);
  // Splitting long rectangles takes longer, but rays are a third faster for it.
  rtcSetSceneBuildQuality(tracer->scene, RTC_BUILD_QUALITY_HIGH);
  size_t primitives = 0;
  RTCGeometry geometry = nullptr;
  if (options.primitives.value_or(PrimitivesOf(grid.model())) == ScenePrimitives::kFaces) {
    geometry = FaceGeometry(tracer->device, grid, parallel, cancelled, primitives);
  } else {
    tracer->bricks = FindOpaqueBricks(grid, parallel, cancelled);
    primitives = tracer->bricks.size();
    if (primitives > 0) geometry = BrickGeometry(tracer->device, tracer->bricks);
  }
  if (geometry != nullptr) {
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(tracer->scene, geometry);
    rtcReleaseGeometry(geometry);
  }
  if (cancelled.Requested()) return stopped;
  // Building asks now and then whether to go on.
  parallel::Cancellation copy = cancelled;
  rtcSetSceneProgressMonitorFunction(
      tracer->scene,
      [](void* of, double) { return !static_cast<const parallel::Cancellation*>(of)->Requested(); },
      &copy);
  rtcCommitScene(tracer->scene);
  rtcSetSceneProgressMonitorFunction(tracer->scene, nullptr, nullptr);
  if (cancelled.Requested()) return stopped;
  return OcclusionScene(grid, std::move(tracer), primitives);
}

OcclusionScene::OcclusionScene(const OpaqueGrid& grid, std::unique_ptr<Tracer> tracer,
                               size_t primitives)
    : corner_(SceneCorner(grid)), primitives_(primitives), tracer_(std::move(tracer)) {}

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

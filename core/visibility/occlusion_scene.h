// Stops rays at the first voxel that is not known to be empty, traced by Embree (algorithm.md
// section 5, 'Visibility').
#ifndef VANTAGE_CORE_VISIBILITY_OCCLUSION_SCENE_H_
#define VANTAGE_CORE_VISIBILITY_OCCLUSION_SCENE_H_

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>

#include "absl/status/statusor.h"
#include "core/parallel/cancellation.h"
#include "core/parallel/parallel.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::visibility {

// Targets of one packet, in scene coordinates.
struct alignas(32) TargetPacket {
  float x[8];
  float y[8];
  float z[8];
};

// The instructions that rays are traced with.
enum class RayInstructions { kBest, kSse42, kAvx2 };

// What the scene is made of. Only rays that run along an edge are told otherwise by one than by the
// other.
enum class ScenePrimitives {
  kFaces,   // rectangles of faces between empty and opaque voxels: rays are quick
  kBricks,  // bricks, walked through voxel by voxel: quick to build, and small
};

struct SceneOptions {
  RayInstructions instructions = RayInstructions::kBest;
  std::optional<ScenePrimitives> primitives;  // nothing: OcclusionScene::PrimitivesOf()
};

// The origin of scene coordinates, in voxels, model frame.
inline Eigen::Vector3d SceneCorner(const OpaqueGrid& grid) { return grid.box().min.cast<double>(); }

// Scene coordinates are voxels counted from `grid`'s corner: faces lie on whole numbers, which
// floats hold exactly. Outside the grid everything is opaque, so rays between empty voxels never
// leave it. Const methods may be called from any thread; Embree starts none of its own. The model
// of the grid outlives the scene.
class OcclusionScene {
 public:
  // CANCELLED when that was requested on the way.
  static absl::StatusOr<OcclusionScene> Create(const OpaqueGrid& grid, parallel::Parallel& parallel,
                                               const parallel::Cancellation& cancelled = {},
                                               const SceneOptions& options = {});
  // By the model's size alone, so that every scene of a model gives the same answers.
  static ScenePrimitives PrimitivesOf(const model::PlanningView& model);
  ~OcclusionScene();
  OcclusionScene(OcclusionScene&&) noexcept;
  OcclusionScene& operator=(OcclusionScene&&) noexcept;

  // The origin of scene coordinates, in voxels, model frame.
  const Eigen::Vector3d& corner() const { return corner_; }
  // `p` in units of voxels, model frame.
  Eigen::Vector3f ToScene(const Eigen::Vector3d& p) const { return (p - corner_).cast<float>(); }

  // Bit i: the segment from `origin` to target i is blocked. Only targets in `valid` are traced.
  uint32_t Occluded(const Eigen::Vector3f& origin, const TargetPacket& targets,
                    uint32_t valid) const;

  size_t primitives() const { return primitives_; }

 private:
  struct Tracer;
  OcclusionScene(const OpaqueGrid& grid, std::unique_ptr<Tracer> tracer, size_t primitives);

  Eigen::Vector3d corner_;
  size_t primitives_ = 0;
  std::unique_ptr<Tracer> tracer_;
};

}  // namespace vantage::visibility

#endif  // VANTAGE_CORE_VISIBILITY_OCCLUSION_SCENE_H_

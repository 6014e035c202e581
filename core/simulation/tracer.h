// Embree behind the simulation's own types.
#ifndef VANTAGE_CORE_SIMULATION_TRACER_H_
#define VANTAGE_CORE_SIMULATION_TRACER_H_

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "core/simulation/triangle_mesh.h"

namespace vantage::simulation {

struct TraceHit {
  bool hit = false;
  float distance = 0;                                // m along the unit direction
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  // unit; either side
  uint32_t triangle = 0;                             // index into the mesh
};

// An immutable scene. Thread safe.
class Tracer {
 public:
  static constexpr size_t kPacket = 8;

  explicit Tracer(const TriangleMesh& mesh);
  ~Tracer();
  Tracer(const Tracer&) = delete;
  Tracer& operator=(const Tracer&) = delete;

  // Traces up to kPacket rays from one origin; directions are unit vectors. `hits` is as long as
  // `directions`.
  void TracePacket(const Eigen::Vector3f& origin, std::span<const Eigen::Vector3f> directions,
                   std::span<TraceHit> hits) const;
  TraceHit Trace(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float near) const;

  // Which of up to kPacket points see `point`, as bits: nothing lies between, up to `gap` (m) from
  // either end.
  uint32_t VisibleFrom(const Eigen::Vector3f& point, std::span<const Eigen::Vector3f> from,
                       float gap) const;

  // Distance to the nearest surface, m, at most `limit`.
  double Clearance(const Eigen::Vector3d& point, double limit) const;

  // True when nothing reaches into the upright cylinder of `radius` (m) around `foot` between the
  // heights `low` and `high` (m, scene frame).
  bool CylinderFree(const Eigen::Vector2d& foot, double radius, double low, double high) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_TRACER_H_

// Sites around which a chain of scans leads back to where it began.
#ifndef VANTAGE_TESTS_BENCH_LOOP_SCENES_H_
#define VANTAGE_TESTS_BENCH_LOOP_SCENES_H_

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/simulation/triangle_mesh.h"

namespace vantage::bench {

struct LoopScene {
  simulation::TriangleMesh mesh;
  std::vector<Eigen::Vector3d> stations;  // m, in the order of the chain
};

// A corridor of 200 m that closes, with cupboards, pillars and door frames at random places.
LoopScene RingCorridor(uint64_t seed);
// Three furnished storeys and the stairs between them; a scan on each flight.
LoopScene StoreysByStairs(uint64_t seed);
// A street of 10 m around a block of 50 x 30 m, with cars, lamp posts and windows.
LoopScene StreetAroundBlock(uint64_t seed);

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_LOOP_SCENES_H_

// Scenes that repeat themselves, and some that do not, with places for scans.
#ifndef VANTAGE_TESTS_BENCH_REPETITIVE_SCENES_H_
#define VANTAGE_TESTS_BENCH_REPETITIVE_SCENES_H_

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/simulation/scenes/scene.h"

namespace vantage::bench {

struct RepetitiveScene {
  simulation::TriangleMesh mesh;
  double bay = 0;                        // m, by which it repeats itself; 0: it does not
  std::vector<Eigen::Vector3d> scanned;  // stations of the model
  std::vector<Eigen::Vector3d> places;   // of scans to come
  // What these see, where it is not the same as before.
  std::optional<simulation::TriangleMesh> later;
};

// A corridor longer than ranges with a pillar each bay on both sides; of `marks` other things along
// it none repeats itself.
RepetitiveScene PillarCorridor(uint64_t seed, uint64_t marks);
// A corridor of 39 m with a door each bay on both sides, shut, in frames that stand out.
RepetitiveScene DoorCorridor(uint64_t seed);
// A parking deck with a column each bay, both ways.
RepetitiveScene ParkingDeck(uint64_t seed);
// Any scene: scans beside the only station, and some metres from it, where they overlap by little.
RepetitiveScene AroundStart(simulation::Scene of, uint64_t seed);

// What changes between scans.
enum class Change : uint8_t { kPeopleCame, kPeopleLeft, kDoorShut, kCupboardMoved, kCar };
// `scene` with a change within sight of its places: ten people, a panel as large as a door across
// where was seen through, a cupboard that stands 0.7 m farther, a car that came.
RepetitiveScene Changed(RepetitiveScene scene, Change change, uint64_t seed);

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_REPETITIVE_SCENES_H_

// Which scenes serve for tuning and which report. No scene does both: a figure from a scene that a
// default was chosen on says how well the default was fitted, not how good it is.
//
// Generated scenes of every kind and size, by seed:
//   below 200    tuning. These had a say in a default, or in what was mended:
//                - what a sample is worth (PlanningConfig): flats 1 to 3, halls 1, 2 and 101, two
//                  rooms 1, storeys 1 and 2 of 250 m^2
//                - the race (RaceOptions, AnytimeOptions): flat 1 after one and three scans,
//                  storeys of seed 1 with 250 and 1,000 m^2
//                - doubtful views (RegistrationCheck): storey 1 of 1,000 m^2
//                - reach, dropouts, mirrors: flats 2, 3, 7 and 101
//                - what is predicted of a sector (bound/prediction): flats 3 to 10
//                - where views stand: random edge scenes 1 to 120 and 178
//                - openings and what is expected: flats 1 to 7, two rooms 1, storey 1 of 250 m^2
//                - what a scan brings (gain_forecast): flats 1 to 12, two rooms 1 to 5, halls 1
//                  to 6, offices 1 to 3, houses 1 and 2
//                - mirrors told together: mirror scenes 1 to 50
//                - the sky: the four outdoor scenes of seed 1
//                - speed of carving, merging, scoring and aligning: flats 1 to 5, storeys of seed 1
//   from 200 on  reporting. Nothing was chosen on these.
// Meshes from files: `small_house` is for tuning (the turns of the race, what a scan
// brings), `bookstore` reports.
// Calibration of registration has kinds of scenes and a split of its own
// (tests/bench/vantage_calibrate.cc).
//
// When a scene that reports has had a say in a default, it belongs to tuning from then on: raise
// kFirstReportingSeed above it.
#ifndef VANTAGE_CORE_SIMULATION_SCENES_SCENE_USE_H_
#define VANTAGE_CORE_SIMULATION_SCENES_SCENE_USE_H_

#include <cstdint>

namespace vantage::simulation {

enum class SceneUse { kTuning, kReporting };

inline constexpr uint64_t kFirstReportingSeed = 200;

// Of a generated scene.
constexpr SceneUse UseOfSeed(uint64_t seed) {
  return seed < kFirstReportingSeed ? SceneUse::kTuning : SceneUse::kReporting;
}

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_SCENES_SCENE_USE_H_

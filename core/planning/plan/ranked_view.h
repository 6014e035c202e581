// A candidate view as a plan returns it (algorithm.md section 11).
#ifndef VANTAGE_CORE_PLANNING_PLAN_RANKED_VIEW_H_
#define VANTAGE_CORE_PLANNING_PLAN_RANKED_VIEW_H_

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/model/view/voxel.h"
#include "core/planning/plan/expected_station.h"
#include "core/planning/plan/open_door.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/plan/storey.h"
#include "core/planning/plan/target_advice.h"
#include "core/registration/bound/verdict.h"

namespace vantage::planning {

// The place of a candidate: its storey, and relative to walls and the last station.
struct WallOffset {
  Eigen::Vector3d wall_point;   // m, on the wall
  Eigen::Vector3d wall_normal;  // unit, horizontal, towards the candidate
  double distance = 0;          // m
};
// As descriptions call it. Who knows by which name its scan goes puts that in its place.
inline constexpr char kLastStation[] = "the last station";

struct LocationDescription {
  std::vector<WallOffset> walls;                // two distinct walls where there are any
  std::optional<double> last_station_distance;  // m, horizontally; absent before the first one
  std::optional<double> last_station_bearing;   // rad, counter-clockwise from the model's +x
  std::string description;  // '1.84 m from the last station at a bearing of ...; 1.10 m from the
                            // wall on ...'
};

// The connected viewcells around a candidate that score at least 95 % of it.
struct EquivalentRegion {
  Region box;         // m
  double volume = 0;  // m^3
  int viewcell_count = 0;
};

struct PatchScore {
  int patch = 0;     // index into Plan::patches
  double score = 0;  // samples
};

struct RankedView {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // m, model frame
  // Where the scanner's +x points, rad, counter-clockwise from the model's +x, [0, 2 pi). Absent
  // for scanners that turn all around. Score, bounds and verdict are those of this heading.
  std::optional<double> heading;
  // Score by heading, samples: element i of n is that of the heading
  // 2 pi i / n. Exact. Empty for scanners that turn all around, and in interim plans.
  std::vector<float> score_by_heading;
  // Expected useful new samples, weighted (by `weights` and by what samples are worth).
  double score = 0;
  double lower = 0;  // samples; bounds of the score at the plan's confidence
  double upper = 0;
  bool exact = false;  // lower == score == upper, confidence 1
  // Surface that it would bring to the required density in the model, m^2; known when exact.
  std::optional<double> model_gain;
  // The same by kind of surface, m^2; sums to model_gain.
  std::array<double, model::kSurfaceKinds> gain_by_kind{};
  // The expected gain, m^2: what a scan is forecast to bring to density (ranking/gain_forecast.h);
  // known when exact.
  std::optional<double> expected_gain;
  // What a scan brings lies between these in four cases of five, m^2; known when exact.
  std::optional<double> expected_gain_lower;
  std::optional<double> expected_gain_upper;
  // The model gain, and what the view would bring of surface that is expected and not known, if it
  // is as expected, m^2: what plans end by, so that a small opening does not keep a job open for
  // what may be behind it. Known when exact.
  std::optional<double> gain_without_hidden;
  // Index into Plan::refused of a view that is predicted to register after a scan from here: this
  // view comes first for the sake of both.
  std::optional<size_t> enables;
  double model_gain_upper = 0;                               // m^2, equal to it where it is known
  std::array<double, model::kSurfaceKinds> score_by_kind{};  // samples, weighted, sums to score
  double height_over_floor = 0;                              // m; NaN where no floor is below
  std::optional<ExpectedStation> expected;  // absent: floor, way and clearance are known
  std::optional<Storey> storey;             // of the floor below; absent where there is none
  bool floor_measured = false;           // false: the floor below lies between measured floor, or
                                         // was given
  double clearance = 0;                  // m, to the nearest thing not empty
  std::optional<double> travel;          // m, from the last station through free space
  std::vector<PatchScore> patch_scores;  // the highest score first, at most 5
  LocationDescription location;
  EquivalentRegion region;
  registration::RegistrationVerdict verdict;
  // Of a view that was refused: targets with which it would register, where some were found.
  std::optional<TargetAdvice> targets;
  // Doors that have to stay open until the scan from here is made, else it does not register.
  // Looked for of the first views of a plan.
  std::vector<OpenDoor> doors;
  // The scanner's setting that the view is planned with and the time of a scan with it, minutes;
  // empty and absent where the plan does not choose the setting.
  std::string setting;
  std::optional<double> scan_minutes;
  std::optional<double> score_per_minute;  // samples, for each minute of setting up and scanning
  bool checked = true;  // `verdict`, `location` and `region` are set; false of all but the first in
                        // interim plans
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PLAN_RANKED_VIEW_H_

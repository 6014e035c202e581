// Pairs of a model and a scan whose true pose is known: the prediction, the alignment's own error
// bound, and its true error.
#ifndef VANTAGE_TESTS_BENCH_CALIBRATION_PAIR_H_
#define VANTAGE_TESTS_BENCH_CALIBRATION_PAIR_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/registration/align/registration_config.h"
#include "core/registration/bound/registration_result.h"
#include "core/registration/bound/verdict.h"
#include "core/sensor/scan.h"
#include "tests/bench/calibration_scene.h"

namespace vantage::bench {

// The errors of the study's instrument and of its pose priors, one sigma. Error bounds are computed
// with the defaults.
struct CalibrationSettings {
  double step = sensor::Radians(0.5);         // rad between samples
  double position_guess = 0.15;               // m per axis, error of reaching the planned place
  double heading_guess = sensor::Radians(5);  // rad
  double tilt_guess = sensor::Radians(1);     // rad
  // Errors of ranges that neighbours share, beside the scanner's white noise: a field over each
  // scan's surfaces of this sigma (m) and this integral scale (m). The defaults are what bounds are
  // configured for: two scans of one surface at the usual incidence differ by about 2 mm.
  double shared_sigma = 0.002;
  double correlation_length = 0.5;
  // Scenes, distances and ranges are so many times as large: 4 makes ranges of 40 m.
  double scale = 1;
  // Errors of priors are so many times what they state.
  double prior_lie = 1;
  // Scans of a scene tell the next ones what their residuals show of the instrument.
  bool learn = false;
};

struct CalibrationPair {
  std::string family;
  bool degenerate = false;
  int scene = 0;
  int pair = 0;
  double prior_metres = 0;  // error of the pose prior
  double prior_degrees = 0;
  // Predicted for the planned place before the scan was made.
  registration::RegistrationOutcome predicted = registration::RegistrationOutcome::kFailed;
  double predicted_bound = 0;   // E, m
  double predicted_judged = 0;  // m
  double predicted_overlap = 0;
  // Of the alignment.
  registration::RegistrationOutcome outcome = registration::RegistrationOutcome::kFailed;
  double bound = 0;   // E, m
  double judged = 0;  // m
  double overlap = 0;
  double achieved = 0;  // m, of the corners of the overlap's box
  double metres = 0;    // of the scanner
  double degrees = 0;
  double seconds = 0;  // Register(), one thread
  std::string decided_by;
  double attainable = 0;  // m, that the verdict says instead of the required accuracy; 0: nothing

  bool Accurate(const registration::RegistrationConfig& config) const {
    return achieved <= config.required_accuracy;
  }
};

// One model of a scene of the family, and `count` scans beside it. Everything follows from `seed`.
std::vector<CalibrationPair> MeasureScene(const SceneFamily& family, int scene, uint64_t seed,
                                          int count, const CalibrationSettings& settings,
                                          const registration::RegistrationConfig& config);

// Box of the samples that lie on the model's surface at the true pose, m; error bounds refer to it.
Eigen::AlignedBox3d OverlapBox(const model::PlanningView& model, const sensor::Scan& scan,
                               const Eigen::Isometry3d& truth, parallel::Parallel& parallel);

// How far a wrong pose moves the corners of the box at most, m; of an empty box: the scanner.
double LargestMove(const Eigen::Isometry3d& pose, const Eigen::Isometry3d& truth,
                   const Eigen::AlignedBox3d& box);

// The alignment's own error bound and its true error; `overlap` is from OverlapBox().
void RecordAlignment(const registration::RegistrationResult& aligned,
                     const Eigen::Isometry3d& truth, const Eigen::AlignedBox3d& overlap,
                     CalibrationPair& pair);

// A pair as a line of a table, and back; nothing when the line is none.
std::string CalibrationHeader();
std::string ToLine(const CalibrationPair& pair);
std::optional<CalibrationPair> FromLine(const std::string& line);

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_CALIBRATION_PAIR_H_

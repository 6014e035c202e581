// Whether a scan that was not made yet will register (algorithm.md section 9, 'Prediction').
#ifndef VANTAGE_CORE_REGISTRATION_BOUND_PREDICTION_H_
#define VANTAGE_CORE_REGISTRATION_BOUND_PREDICTION_H_

#include <Eigen/Core>
#include <optional>
#include <span>

#include "core/registration/align/registration_config.h"
#include "core/registration/align/targets.h"
#include "core/registration/bound/error_bound.h"
#include "core/registration/bound/overlap_element.h"
#include "core/registration/bound/verdict.h"
#include "core/sensor/scanner_model.h"

namespace vantage::registration {

// The error bound of a view from which a scanner turns all around has to be within the required
// accuracy by this factor: the view that gains most is one that just suffices, and without the
// margin one scan in two hundred was lost for a bound larger than predicted. With it one of 88 was,
// at 1.3 times the prediction (furnished flats, steps of 0.034 degrees; no other sites).
inline constexpr double kBoundMargin = 1.2;

// `overlap` is every true-surface voxel visible from `position` with a positive cosine of incidence
// (a regular subset will do: `weight` >= 1 elements stand behind each). `expected_samples` counts
// the returns a scan from there is expected to have on any surface, known or not. `targets`: that
// the scan will see; of each its place and sigma count.
RegistrationVerdict PredictRegistration(std::span<const OverlapElement> overlap, double weight,
                                        double expected_samples, const Eigen::Vector3d& position,
                                        const sensor::ScannerModel& scanner,
                                        const RegistrationConfig& config,
                                        std::span<const TargetTie> targets = {});

// The share of a scan's returns that has to lie on known surface before it is predicted to
// register, without targets, [0, 1].
double AskedShare(const sensor::ScannerModel& scanner, const RegistrationConfig& config);

// What one overlap is predicted to be good for with targets, whichever they are.
class TargetedPrediction {
 public:
  TargetedPrediction(std::span<const OverlapElement> overlap, double weight,
                     const Eigen::Vector3d& position, const sensor::ScannerModel& scanner,
                     const RegistrationConfig& config);
  // The bound that decides the verdict (RegistrationVerdict::judged_bound), m.
  double Bound(std::span<const TargetTie> targets) const;

 private:
  std::optional<OverlapGeometry> geometry_;  // absent: hardly anything overlaps
  sensor::Matrix6d levelled_ = sensor::Matrix6d::Zero();
};

// The same bound without margins, from the surface alone: with what the scans so far have shown of
// the instrument, and by its data sheet. m; 2 OverlapGeometry::kUnconstrained where hardly
// anything overlaps.
struct ExpectedBounds {
  double bound = 0;
  double by_sheet = 0;
};
ExpectedBounds BoundsOf(std::span<const OverlapElement> overlap, double weight,
                        const Eigen::Vector3d& position, const sensor::ScannerModel& scanner,
                        const RegistrationConfig& config);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_BOUND_PREDICTION_H_

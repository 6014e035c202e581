// Other poses at which a scan that was not made yet would fit, too (algorithm.md section 9,
// 'Prediction').
#ifndef VANTAGE_CORE_REGISTRATION_BOUND_RIVAL_FORECAST_H_
#define VANTAGE_CORE_REGISTRATION_BOUND_RIVAL_FORECAST_H_

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/registration/align/align.h"
#include "core/registration/align/correspondence_field.h"
#include "core/registration/align/registration_config.h"
#include "core/registration/align/scan_surface.h"
#include "core/registration/align/targets.h"
#include "core/registration/align/voxel_search.h"
#include "core/registration/bound/coarse_surface.h"
#include "core/registration/bound/move_search.h"
#include "core/registration/bound/overlap_element.h"
#include "core/registration/bound/registration_result.h"
#include "core/registration/bound/verdict.h"
#include "core/sensor/scanner_model.h"

namespace vantage::registration {

// What a forecast looks at around a scan, made once for all of a model, in cells of 20 cm or,
// beyond 12,000 m^3, as few as around a scan: for who asks of so many scans that it pays.
struct FieldAllOver {
  FieldAllOver(const model::PlanningView& model, const RegistrationConfig& config,
               parallel::Parallel& parallel);
  // Whether cells of all of the model stay well below the first stage's reach, as the field asks.
  static bool Serves(const model::PlanningView& model, const RegistrationConfig& config);
  static uint64_t EstimatedBytes();

  double reach;  // m, config.max_correspondence
  CorrespondenceField field;
};

// Where the known surface looks like itself, as far as the priors of scans may be wrong. Thread
// safe.
class RivalForecast {
 public:
  // Keeps the reference to the model.
  explicit RivalForecast(const model::PlanningView& model);

  // The same with what was made for all of the model; it answers questions with other reaches as
  // without it.
  RivalForecast With(std::shared_ptr<const FieldAllOver> all_over) const {
    RivalForecast forecast = *this;
    forecast.all_over_ = std::move(all_over);
    return forecast;
  }

  // Asks of what a view would see what is asked of a scan (OpenRivals()): the poses at which that
  // fits as well and which nothing refutes, within all that priors with `config.prior_sigma` and
  // `config.prior_heading_sigma` leave open (ReachOf()), the best fit first.
  // `targets` that the scan will see refute what puts them elsewhere.
  std::vector<RivalPose> Rivals(std::span<const OverlapElement> overlap,
                                const Eigen::Vector3d& position,
                                const sensor::ScannerModel& scanner,
                                const RegistrationConfig& config,
                                std::span<const TargetTie> targets = {}) const;

  // What one takes that is made of a model, bytes, besides its voxel search.
  static double EstimatedBytes(const model::PlanningView& model);

  // A verdict 'registered' becomes doubtful when there is a rival that `targets` do not refute.
  void Judge(std::span<const OverlapElement> overlap, const Eigen::Vector3d& position,
             const sensor::ScannerModel& scanner, const RegistrationConfig& config,
             RegistrationVerdict& verdict, std::span<const TargetTie> targets = {}) const;

 private:
  // Where a scan ends that starts from each of `moves`, those apart from each other and from where
  // it is, scored as in an alignment, best first; only those that fit `least` or more.
  std::vector<Minimum> Refined(const ScanSurface& surface, const Eigen::Vector3d& position,
                               std::span<const ScanMove> moves, const MoveReach& reach,
                               double least, const RegistrationConfig& config) const;
  std::vector<RivalPose> Twins(const ScanSurface& surface, const Eigen::Vector3d& position,
                               const MoveReach& reach, const RegistrationConfig& config) const;

  const model::PlanningView& model_;
  VoxelSearch search_;
  std::shared_ptr<const CoarseSurface> coarse_;
  std::shared_ptr<const FieldAllOver> all_over_;
};

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_BOUND_RIVAL_FORECAST_H_

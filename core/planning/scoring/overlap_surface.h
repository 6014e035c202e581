// What a scan from a view would overlap, and whether it would register by that (algorithm.md
// section 9, 'Prediction').
#ifndef VANTAGE_CORE_PLANNING_SCORING_OVERLAP_SURFACE_H_
#define VANTAGE_CORE_PLANNING_SCORING_OVERLAP_SURFACE_H_

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/budget.h"
#include "core/parallel/cancellation.h"
#include "core/parallel/parallel.h"
#include "core/planning/scoring/constraints.h"
#include "core/planning/scoring/headings.h"
#include "core/planning/scoring/plane_extent.h"
#include "core/registration/align/registration_config.h"
#include "core/registration/bound/prediction.h"
#include "core/registration/bound/rival_forecast.h"
#include "core/registration/bound/verdict.h"
#include "core/sensor/scanner_model.h"
#include "core/visibility/occlusion_scene.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::planning {

// The true surface to which a scan could be aligned, thinned to every n-th voxel so that about
// 16,000 are left. Thinning to a quarter or a sixteenth changes the predicted error by half a
// percent at most.
class OverlapSurface {
 public:
  // `grid` and `scene` are the model's; the reference to the model is kept. The same on any number
  // of threads. CANCELLED when that was requested on the way.
  static absl::StatusOr<OverlapSurface> Create(const model::PlanningView& model,
                                               const visibility::OpaqueGrid& grid,
                                               const visibility::OcclusionScene& scene,
                                               const sensor::ScannerModel& scanner,
                                               parallel::Parallel& parallel,
                                               const parallel::Cancellation& cancelled = {});

  // Rivals are looked for with what was made for all of Create()'s model.
  void LookForRivalsIn(std::shared_ptr<const registration::FieldAllOver> all_over) {
    rivals_ =
        std::make_shared<const registration::RivalForecast>(rivals_->With(std::move(all_over)));
  }

  struct Seen {
    registration::RegistrationVerdict verdict;
    uint64_t rays = 0;
    size_t heading = 0;  // of Headings
  };
  // The verdict on a scan with a heading (rad; of no matter where the scanner turns all around).
  // Only surface counts that the scan sees even if it misses the heading by a step of Headings:
  // the heading of most gain often holds on to the model by a strip at the sector's border.
  // Nothing when the budget expired on the way. `scene` is that of Create(). `expected`, where
  // given, is surface that earlier scans are expected to have measured by then: cells as from
  // Thinned().
  std::optional<Seen> Predict(const Eigen::Vector3d& view, const visibility::OcclusionScene& scene,
                              const registration::RegistrationConfig& config,
                              const parallel::Budget& budget, const CellArrays* expected = nullptr,
                              std::optional<double> heading = std::nullopt) const;
  // The same with the heading of most gain that registers, of those that gain something; where none
  // does, of those that are doubtful, or else of all. `by_heading`:
  // BruteForceScorer::ScoreHeadings(). The surface is looked at once for all headings.
  std::optional<Seen> PredictBest(const Eigen::Vector3d& view, std::span<const double> by_heading,
                                  const visibility::OcclusionScene& scene,
                                  const registration::RegistrationConfig& config,
                                  const parallel::Budget& budget,
                                  const CellArrays* expected = nullptr) const;
  // The bounds of a scan that sees what is known around a place, with the heading that sees most of
  // it (registration::BoundsOf()). Nothing when the budget expired on the way.
  struct Bounds {
    registration::ExpectedBounds bounds;
    uint64_t rays = 0;
  };
  std::optional<Bounds> BoundsAt(const Eigen::Vector3d& view,
                                 const visibility::OcclusionScene& scene,
                                 const registration::RegistrationConfig& config,
                                 const parallel::Budget& budget) const;
  // Every n-th of `indices` into `cells`, as surface that a scan can be aligned to; `areas` (m^2)
  // has one for each index.
  CellArrays Thinned(const CellArrays& cells, std::span<const uint32_t> indices,
                     std::span<const float> areas) const;
  // What it is made of.
  const CellArrays& cells() const { return cells_; }
  // Voxels behind each element.
  double weight() const { return weight_; }
  // Directions that a scan measures.
  double directions() const;
  // What a scan from a place would see of it.
  struct Sight {
    std::vector<float> samples;  // of the scan, by element of cells(); 0: not seen
    std::vector<registration::OverlapElement> elements;
    uint64_t rays = 0;
  };
  // Nothing when the budget expired on the way.
  std::optional<Sight> SightFrom(const Eigen::Vector3d& view,
                                 const visibility::OcclusionScene& scene,
                                 const parallel::Budget& budget,
                                 std::optional<double> heading = std::nullopt) const;
  // Predict() of such a scan, with targets.
  registration::RegistrationVerdict JudgeSight(
      const Sight& sight, const Eigen::Vector3d& view,
      const registration::RegistrationConfig& config,
      std::span<const registration::TargetTie> targets) const;
  // The same without targets and before rivals are looked for, which takes most of the time: what
  // does not register so does not at all.
  registration::RegistrationVerdict JudgeSightBeforeRivals(
      const Sight& sight, const Eigen::Vector3d& view,
      const registration::RegistrationConfig& config) const;
  registration::TargetedPrediction Targeted(const Sight& sight, const Eigen::Vector3d& view,
                                            const registration::RegistrationConfig& config) const;
  // Whether a scan sees a point that lies on surface, or two voxels before it.
  bool Sees(const Eigen::Vector3d& view, const Eigen::Vector3d& point,
            const visibility::OcclusionScene& scene, std::optional<double> heading) const;
  // What one prediction can cost at most.
  uint64_t MostRays() const { return std::max<uint64_t>(1, cells_.size()); }

 private:
  // What a scan that turns all around would overlap.
  struct Overlap {
    std::vector<registration::OverlapElement> elements;
    std::vector<size_t> bins;     // of the headings, by element
    std::vector<uint32_t> cells;  // index into cells_, of the first elements: those of the model
    uint64_t rays = 0;
  };
  OverlapSurface(double voxel, const sensor::ScannerModel& scanner);
  std::optional<Overlap> See(const Eigen::Vector3d& view, const visibility::OcclusionScene& scene,
                             const parallel::Budget& budget, const CellArrays* expected) const;
  registration::RegistrationVerdict Judge(
      std::span<const registration::OverlapElement> overlap, const Eigen::Vector3d& view,
      const registration::RegistrationConfig& config,
      std::span<const registration::TargetTie> targets = {}) const;
  // Leaves only what is seen even if the heading is missed by a step.
  void KeepSeen(double heading, const Eigen::Vector3d& view, Overlap& around) const;

  double voxel_;
  sensor::ScannerModel scanner_;
  Headings headings_;
  SensingConstraints constraints_;  // any incidence, no cap on the density
  double weight_ = 1;               // voxels behind each element
  CellArrays cells_;
  std::shared_ptr<const registration::RivalForecast> rivals_;
  std::vector<uint32_t> samples_;    // of the model, by element
  std::vector<PlaneExtent> planes_;  // by element; of a scanner that sees a sector
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_SCORING_OVERLAP_SURFACE_H_

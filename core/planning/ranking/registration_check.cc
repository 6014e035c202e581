#include "core/planning/ranking/registration_check.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "absl/container/flat_hash_set.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "core/planning/scoring/brute_force.h"
#include "core/registration/bound/prediction.h"
#include "core/visibility/surface_walk.h"
#include "core/visibility/target.h"

namespace vantage::planning {
namespace {

constexpr size_t kElements = 16000;
constexpr size_t kBatch = 4;  // candidates checked at a time, whatever the number of threads

sensor::ScannerModel AnyIncidence(sensor::ScannerModel scanner) {
  scanner.max_incidence = sensor::kPi / 2 - 1e-3;
  return scanner;
}

// Number of directions that a scan measures indoors, where every ray meets something.
double DirectionsOf(const sensor::ScannerModel& scanner) {
  return scanner.azimuth_span / scanner.azimuth_step *
         ((scanner.elevation_max - scanner.elevation_min) / scanner.elevation_step);
}

}  // namespace

OverlapSurface::OverlapSurface(double voxel, const sensor::ScannerModel& scanner)
    : voxel_(voxel), scanner_(scanner), constraints_(AnyIncidence(scanner)) {}

absl::StatusOr<OverlapSurface> OverlapSurface::Create(const model::PlanningView& model,
                                                      const visibility::OpaqueGrid& grid,
                                                      const visibility::OcclusionScene& scene,
                                                      const sensor::ScannerModel& scanner,
                                                      const parallel::Cancellation& cancelled) {
  OverlapSurface overlap(model.voxel_size(), scanner);
  size_t total = 0;
  visibility::WalkSurface(
      model, cancelled,
      [&](const model::VoxelIndex&, model::VoxelState state, const model::SurfaceVoxel&) {
        total += state == model::VoxelState::kTrueSurface;
      });
  const size_t stride = std::max<size_t>(1, (total + kElements - 1) / kElements);
  overlap.weight_ = static_cast<double>(stride);
  size_t at = 0;
  std::vector<Eigen::Vector3f> dropouts;
  const bool whole = visibility::WalkSurface(
      model, cancelled,
      [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& surface) {
        if (state != model::VoxelState::kTrueSurface || at++ % stride != 0 || !(surface.area > 0))
          return;
        const auto target = visibility::TargetOf(grid, v, surface.normal);
        if (!target.has_value()) return;
        dropouts.clear();
        for (const model::Dropout& dropout : model.Dropouts(v)) dropouts.push_back(dropout.from);
        overlap.cells_.Add(surface.centroid, surface.normal, surface.area, 0,
                           std::numeric_limits<float>::max(), scene.ToScene(*target),
                           static_cast<uint32_t>(overlap.samples_.size()), dropouts);
        overlap.samples_.push_back(surface.samples);
      });
  if (!whole) return absl::CancelledError("overlap surface");
  overlap.cells_.Pad();
  return overlap;
}

CellArrays OverlapSurface::Thinned(const CellArrays& cells, std::span<const uint32_t> indices,
                                   std::span<const float> areas) const {
  CellArrays thinned;
  const auto stride = static_cast<size_t>(weight_);
  for (size_t k = 0; k < indices.size(); k += stride) {
    const size_t i = indices[k];
    thinned.Add({cells.x[i], cells.y[i], cells.z[i]}, {cells.nx[i], cells.ny[i], cells.nz[i]},
                areas[k], 0, std::numeric_limits<float>::max(),
                {cells.tx[i], cells.ty[i], cells.tz[i]}, cells.cell[i], cells.DropoutsOf(i));
  }
  thinned.Pad();
  return thinned;
}

std::optional<OverlapSurface::Seen> OverlapSurface::Predict(
    const Eigen::Vector3d& view, const visibility::OcclusionScene& scene,
    const registration::RegistrationConfig& config, const parallel::Budget& budget,
    const CellArrays* expected) const {
  const BruteForceScorer scorer(constraints_, scene, voxel_);
  Seen seen;
  std::vector<registration::OverlapElement> overlap;
  std::vector<float> samples;
  const auto add = [&](const CellArrays& cells, const uint32_t* model_samples) {
    samples.resize(cells.size());
    const ViewScore score = scorer.ScoreCells(view, cells, budget, samples);
    seen.rays += score.rays;
    for (size_t i = 0; score.finished && i < samples.size(); ++i) {
      if (samples[i] <= 0) continue;
      overlap.push_back({{cells.x[i], cells.y[i], cells.z[i]},
                         {cells.nx[i], cells.ny[i], cells.nz[i]},
                         samples[i],
                         model_samples != nullptr ? model_samples[i] : 1});
    }
    return score.finished;
  };
  if (!add(cells_, samples_.data())) return std::nullopt;
  if (expected != nullptr && !add(*expected, nullptr)) return std::nullopt;
  seen.verdict = registration::PredictRegistration(overlap, weight_, DirectionsOf(scanner_), view,
                                                   scanner_, config);
  return seen;
}

namespace {

class Checking {
 public:
  Checking(const PlanningProblem& problem, const OverlapSurface& surface,
           const Evaluation& evaluation, const parallel::Budget& budget,
           parallel::Parallel& parallel)
      : surface_(surface),
        scene_(problem.scene()),
        evaluation_(evaluation),
        feasible_(problem.feasible()),
        config_(problem.config()),
        budget_(budget),
        parallel_(parallel) {}

  RegistrationCheck Run(std::span<const uint32_t> candidates, size_t wanted) {
    size_t count = 0;
    for (size_t begin = 0; begin < candidates.size(); begin += count) {
      if (check_.registrable.size() >= wanted) break;
      count = Check(candidates.subspan(begin), [&](const CheckedView& view) {
        if (!view.verdict.registered()) {
          check_.refused.push_back(view);
        } else if (check_.registrable.size() < wanted) {
          check_.registrable.push_back(view);
        }
      });
      if (count == 0) return check_;
    }
    check_.finished = true;
    TryAroundDoubtful(wanted);
    return check_;
  }

 private:
  // Checks the first few of `views` and returns how many; 0 when the budget ended.
  size_t Check(std::span<const uint32_t> views, absl::FunctionRef<void(const CheckedView&)> note) {
    if (NoTimeLeft()) return 0;
    const uint64_t affordable = (budget_.work_limit - check_.rays) / surface_.MostRays();
    const size_t count =
        std::min(static_cast<size_t>(std::clamp<uint64_t>(affordable, 1, kBatch)), views.size());
    std::vector<std::optional<OverlapSurface::Seen>> seen(count);
    parallel_.For(count, [&](size_t k) {
      seen[k] = surface_.Predict(feasible_.Centre(views[k]), scene_, config_.registration, budget_);
    });
    for (size_t k = 0; k < count; ++k) {
      if (!seen[k].has_value()) return 0;
      check_.rays += seen[k]->rays;
      ++check_.checked;
      note({views[k], seen[k]->verdict});
    }
    return count;
  }

  bool NoTimeLeft() const { return check_.rays >= budget_.work_limit || budget_.Expired(); }
  double Score(uint32_t view) const { return evaluation_.views[view].Rank(); }
  bool Near(uint32_t a, uint32_t b) const {
    return (feasible_.Centre(a) - feasible_.Centre(b)).norm() < config_.candidate_separation;
  }

  // The views around a candidate that were not tried yet, the best first.
  std::vector<uint32_t> BestAround(uint32_t candidate) const {
    std::vector<uint32_t> around;
    for (uint32_t i = 0; i < evaluation_.views.size(); ++i) {
      if (i == candidate || !evaluation_.views[i].scored || !Near(i, candidate)) continue;
      if (Score(i) > 0 && Score(i) <= Score(candidate) && !tried_.contains(i)) around.push_back(i);
    }
    const size_t count = std::min(kTriedAround, around.size());
    std::partial_sort(around.begin(), around.begin() + static_cast<ptrdiff_t>(count), around.end(),
                      [this](uint32_t a, uint32_t b) {
                        return Score(a) != Score(b) ? Score(a) > Score(b) : a < b;
                      });
    around.resize(count);
    return around;
  }

  void TryAroundDoubtful(size_t wanted) {
    const size_t most = check_.checked + static_cast<size_t>(config_.max_checked);
    std::vector<CheckedView> found;
    for (CheckedView& refused : check_.refused) {
      if (refused.verdict.outcome != registration::RegistrationOutcome::kDoubtful) continue;
      if (check_.checked >= most || NoTimeLeft()) break;
      const std::vector<uint32_t> around = BestAround(refused.view);
      std::span<const uint32_t> left = around;
      std::vector<uint32_t> tried;
      while (!left.empty() && !refused.alone && check_.checked < most) {
        const size_t count = Check(left, [&](const CheckedView& view) {
          tried_.insert(view.view);
          if (!view.verdict.registered()) {
            tried.push_back(view.view);
          } else if (!refused.alone) {
            refused.alone = true;
            found.push_back(view);
          }
        });
        if (count == 0) break;
        left = left.subspan(count);
      }
      if (refused.alone) {
        check_.refused_around.insert(check_.refused_around.end(), tried.begin(), tried.end());
      }
    }
    if (found.empty()) return;
    std::vector<CheckedView> all = std::move(check_.registrable);
    all.insert(all.end(), found.begin(), found.end());
    std::stable_sort(all.begin(), all.end(), [this](const CheckedView& a, const CheckedView& b) {
      return Score(a.view) > Score(b.view);
    });
    check_.registrable.clear();
    for (const CheckedView& view : all) {
      const bool near = std::any_of(check_.registrable.begin(), check_.registrable.end(),
                                    [&](const CheckedView& o) { return Near(o.view, view.view); });
      if (!near && check_.registrable.size() < wanted) check_.registrable.push_back(view);
    }
  }

  const OverlapSurface& surface_;
  const visibility::OcclusionScene& scene_;
  const Evaluation& evaluation_;
  const FeasibleViews& feasible_;
  const PlanningConfig& config_;
  const parallel::Budget& budget_;
  parallel::Parallel& parallel_;
  RegistrationCheck check_;
  absl::flat_hash_set<uint32_t> tried_;  // around doubtful candidates
};

}  // namespace

RegistrationCheck CheckRegistration(const PlanningProblem& problem, const OverlapSurface& surface,
                                    const Evaluation& evaluation,
                                    std::span<const uint32_t> candidates, size_t wanted,
                                    const parallel::Budget& budget, parallel::Parallel& parallel) {
  return Checking(problem, surface, evaluation, budget, parallel).Run(candidates, wanted);
}

RegistrationCheck CheckRegistration(const PlanningProblem& problem, const Evaluation& evaluation,
                                    std::span<const uint32_t> candidates, size_t wanted,
                                    const parallel::Budget& budget, parallel::Parallel& parallel) {
  const auto surface = OverlapSurface::Create(problem.model(), problem.grid(), problem.scene(),
                                              problem.scanner(), budget);
  if (!surface.ok()) return {};
  return CheckRegistration(problem, *surface, evaluation, candidates, wanted, budget, parallel);
}

}  // namespace vantage::planning

#include "core/planning/ranking/registration_check.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "absl/container/flat_hash_set.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "core/planning/ranking/rank_views.h"
#include "core/planning/scoring/brute_force.h"
#include "core/registration/bound/prediction.h"
#include "core/visibility/surface_walk.h"
#include "core/visibility/target.h"

namespace vantage::planning {
namespace {

// Surface elements of which a scan's prediction is made, at most: a share of them is right to 0.4
// %, one sigma, and the cost of a check grows with them.
constexpr size_t kElements = 16'000;
constexpr double kRoundingOfShare = 1e-9;
constexpr size_t kBatch = 4;  // candidates checked at a time, whatever the number of threads

sensor::ScannerModel AnyIncidence(sensor::ScannerModel scanner) {
  scanner.max_incidence = sensor::kPi / 2 - 1e-3;
  return scanner;
}

// Whether the surface around a voxel is a plane, as an alignment needs it to be for a sample of the
// scan to count (SampleSurface): the voxel and its neighbours, as many as a plane through it has at
// least. Voxels on edges have normals of either side or of neither.
bool LiesInPlane(const model::PlanningView& model, const model::VoxelIndex& v,
                 const model::SurfaceVoxel& surface) {
  constexpr int kFewest = 6;         // with itself; a plane meets nine or more of the 27
  constexpr float kSimilar = 0.9f;   // cosine, 26 degrees: five sigma of two noisy normals
  constexpr double kOffPlane = 0.4;  // voxels: a noise of up to a fifth
  const auto off = static_cast<float>(kOffPlane * model.voxel_size());
  int count = 0;
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        const model::VoxelIndex at = v + model::VoxelIndex(x, y, z);
        if (model.State(at) != model::VoxelState::kTrueSurface) continue;
        const std::optional<model::SurfaceVoxel> other = model.Surface(at);
        count += other->normal.dot(surface.normal) >= kSimilar &&
                 std::abs(surface.normal.dot(other->centroid - surface.centroid)) <= off;
      }
    }
  }
  return count >= kFewest;
}

// Number of directions that a scan measures indoors, where every ray meets something.
double DirectionsOf(const sensor::ScannerModel& scanner) {
  return scanner.azimuth_span / scanner.azimuth_step *
         ((scanner.elevation_max - scanner.elevation_min) / scanner.elevation_step);
}

// Calls fn(rank, local) for the voxels of true surface of a brick, in order.
template <typename Fn>
void ForEachTrueSurface(const model::Brick& brick, Fn&& fn) {
  size_t rank = 0;
  for (size_t word = 0; word < brick.surface_mask.size(); ++word) {
    for (uint64_t bits = brick.surface_mask[word]; bits != 0; bits &= bits - 1, ++rank) {
      const size_t local = word * 64 + static_cast<size_t>(std::countr_zero(bits));
      if (brick.state[local] == model::VoxelState::kTrueSurface) fn(rank, static_cast<int>(local));
    }
  }
}

// How many voxels of true surface each of the model's bricks has. Nothing when cancelled on the
// way.
std::optional<std::vector<uint16_t>> TrueSurfaceByBrick(const model::PlanningView& model,
                                                        const parallel::Cancellation& cancelled) {
  std::vector<uint16_t> counts;
  for (const model::BrickAt& at : model.bricks()) {
    if (counts.size() % visibility::kBricksBetweenPolls == 0 && cancelled.Requested()) {
      return std::nullopt;
    }
    uint16_t count = 0;
    ForEachTrueSurface(*at.contents, [&](size_t, int) { ++count; });
    counts.push_back(count);
  }
  return counts;
}

// Calls fn(VoxelIndex, const SurfaceVoxel&) for every `stride`-th voxel of true surface, in the
// model's order; looks closer only at bricks that have one. False when cancelled on the way.
template <typename Fn>
bool WalkEvery(size_t stride, const model::PlanningView& model, std::span<const uint16_t> in_brick,
               const parallel::Cancellation& cancelled, Fn&& fn) {
  size_t wanted = 0;  // the next, by its number among all
  size_t number = 0;
  size_t i = 0;
  for (const model::BrickAt& at : model.bricks()) {
    if (i % visibility::kBricksBetweenPolls == 0 && cancelled.Requested()) return false;
    const size_t count = in_brick[i++];
    if (wanted >= number + count) {
      number += count;
      continue;
    }
    ForEachTrueSurface(*at.contents, [&](size_t rank, int local) {
      if (number++ != wanted) return;
      wanted += stride;
      const model::SurfaceVoxel surface = at.contents->surface[rank];
      fn(model::PlanningView::Global(at.brick, local), surface);
    });
  }
  return true;
}

}  // namespace

OverlapSurface::OverlapSurface(double voxel, const sensor::ScannerModel& scanner)
    : voxel_(voxel), scanner_(scanner), headings_(scanner), constraints_(AnyIncidence(scanner)) {}

absl::StatusOr<OverlapSurface> OverlapSurface::Create(const model::PlanningView& model,
                                                      const visibility::OpaqueGrid& grid,
                                                      const visibility::OcclusionScene& scene,
                                                      const sensor::ScannerModel& scanner,
                                                      const parallel::Cancellation& cancelled) {
  OverlapSurface overlap(model.voxel_size(), scanner);
  const std::optional<std::vector<uint16_t>> in_brick = TrueSurfaceByBrick(model, cancelled);
  if (!in_brick) return absl::CancelledError("overlap surface");
  const size_t total = std::accumulate(in_brick->begin(), in_brick->end(), size_t{0});
  const size_t stride = std::max<size_t>(1, (total + kElements - 1) / kElements);
  overlap.weight_ = static_cast<double>(stride);
  std::vector<Eigen::Vector3f> dropouts;
  const auto add = [&](const model::VoxelIndex& v, const model::SurfaceVoxel& surface) {
    if (!(surface.area > 0)) return;
    const auto target = visibility::TargetOf(grid, v, surface.normal);
    if (!target.has_value()) return;
    // What a scan all around overlaps is large, and its edges are a small part of it.
    if (!scanner.TurnsAllAround() && !LiesInPlane(model, v, surface)) return;
    dropouts.clear();
    for (const model::Dropout& dropout : model.Dropouts(v)) dropouts.push_back(dropout.from);
    overlap.cells_.Add(surface.centroid, surface.normal, surface.area, 0,
                       std::numeric_limits<float>::max(), scene.ToScene(*target),
                       static_cast<uint32_t>(overlap.samples_.size()), dropouts);
    overlap.samples_.push_back(surface.samples);
  };
  const bool whole = WalkEvery(stride, model, *in_brick, cancelled, add);
  if (!whole) return absl::CancelledError("overlap surface");
  overlap.cells_.Pad();
  return overlap;
}

absl::StatusOr<OverlapSurface> OverlapSurface::Of(const PlanningProblem& problem,
                                                  const parallel::Cancellation& cancelled) {
  return Create(problem.model(), problem.grid(), problem.scene(), problem.scanner(), cancelled);
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

std::optional<OverlapSurface::Overlap> OverlapSurface::See(const Eigen::Vector3d& view,
                                                           const visibility::OcclusionScene& scene,
                                                           const parallel::Budget& budget,
                                                           const CellArrays* expected) const {
  const BruteForceScorer scorer(constraints_, scene, voxel_);
  const Eigen::Vector3f at = view.cast<float>();
  Overlap overlap;
  std::vector<float> samples;
  const auto add = [&](const CellArrays& cells, const uint32_t* model_samples) {
    samples.resize(cells.size());
    const ViewScore score = scorer.ScoreCells(view, cells, budget, samples);
    overlap.rays += score.rays;
    for (size_t i = 0; score.finished && i < samples.size(); ++i) {
      if (samples[i] <= 0) continue;
      overlap.elements.push_back({{cells.x[i], cells.y[i], cells.z[i]},
                                  {cells.nx[i], cells.ny[i], cells.nz[i]},
                                  samples[i],
                                  model_samples != nullptr ? model_samples[i] : 1});
      overlap.bins.push_back(headings_.BinOf(cells.x[i] - at.x(), cells.y[i] - at.y()));
    }
    return score.finished;
  };
  if (!add(cells_, samples_.data())) return std::nullopt;
  if (expected != nullptr && !add(*expected, nullptr)) return std::nullopt;
  return overlap;
}

registration::RegistrationVerdict OverlapSurface::Judge(
    std::span<const registration::OverlapElement> overlap, const Eigen::Vector3d& view,
    const registration::RegistrationConfig& config) const {
  return registration::PredictRegistration(overlap, weight_, DirectionsOf(scanner_), view, scanner_,
                                           config);
}

std::optional<OverlapSurface::Seen> OverlapSurface::Predict(
    const Eigen::Vector3d& view, const visibility::OcclusionScene& scene,
    const registration::RegistrationConfig& config, const parallel::Budget& budget,
    const CellArrays* expected, std::optional<double> heading) const {
  std::optional<Overlap> around = See(view, scene, budget, expected);
  if (!around.has_value()) return std::nullopt;
  if (!headings_.all_around() && heading.has_value()) {
    const Sector one_side(scanner_, *heading - headings_.step());
    const Sector other_side(scanner_, *heading + headings_.step());
    const Eigen::Vector3f at = view.cast<float>();
    std::erase_if(around->elements, [&](const registration::OverlapElement& element) {
      const float x = element.position.x() - at.x();
      const float y = element.position.y() - at.y();
      return !one_side.Sees(x, y) || !other_side.Sees(x, y);
    });
  }
  return Seen{Judge(around->elements, view, config), around->rays, 0};
}

std::optional<OverlapSurface::Seen> OverlapSurface::PredictBest(
    const Eigen::Vector3d& view, std::span<const double> by_heading,
    const visibility::OcclusionScene& scene, const registration::RegistrationConfig& config,
    const parallel::Budget& budget, const CellArrays* expected) const {
  const std::optional<Overlap> around = See(view, scene, budget, expected);
  if (!around.has_value()) return std::nullopt;
  std::vector<size_t> order;
  for (size_t i = 0; i < headings_.size(); ++i) {
    if (by_heading[i] > 0) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return by_heading[a] > by_heading[b]; });
  if (order.empty()) order.push_back(0);
  // What overlaps too little does not register; so the share alone rules out most headings.
  std::vector<double> by_bin(headings_.bins(), 0);
  std::vector<double> samples(headings_.size());
  for (size_t k = 0; k < around->elements.size(); ++k) {
    by_bin[around->bins[k]] += weight_ * static_cast<double>(around->elements[k].samples);
  }
  headings_.Sum(by_bin, samples);
  const double fewest = (1 - kRoundingOfShare) * config.minimum_overlap * DirectionsOf(scanner_);
  std::optional<Seen> best;
  for (const size_t heading : order) {
    if (best.has_value() && samples[heading] < fewest) continue;
    if (budget.Expired()) return std::nullopt;
    const size_t one_side = (heading + headings_.size() - 1) % headings_.size();
    const size_t other_side = (heading + 1) % headings_.size();
    std::vector<registration::OverlapElement> overlap;
    for (size_t k = 0; k < around->elements.size(); ++k) {
      const size_t bin = around->bins[k];
      if (!headings_.Sees(one_side, bin) || !headings_.Sees(other_side, bin)) continue;
      overlap.push_back(around->elements[k]);
    }
    Seen seen{Judge(overlap, view, config), around->rays, heading};
    if (seen.verdict.registered()) return seen;
    if (!best.has_value() || seen.verdict.outcome < best->verdict.outcome) best = std::move(seen);
  }
  return best;
}

namespace {

class Checking {
 public:
  Checking(const PlanningProblem& problem, const OverlapSurface& surface,
           const Evaluation& evaluation, const parallel::Budget& budget,
           parallel::Parallel& parallel)
      : surface_(surface),
        scoring_(problem.scoring()),
        scene_(problem.scene()),
        evaluation_(evaluation),
        feasible_(problem.feasible()),
        config_(problem.config()),
        budget_(budget),
        parallel_(parallel) {}

  RegistrationCheck Run(std::span<const uint32_t> candidates, size_t wanted) {
    size_t count = 0;
    for (size_t begin = 0; begin < candidates.size(); begin += count) {
      if (AsGoodAs(candidates[begin]) >= wanted) break;
      count = Check(candidates.subspan(begin), [&](const CheckedView& view) {
        if (!view.verdict.registered()) {
          check_.refused.push_back(view);
        } else if (view.heading.has_value() || check_.registrable.size() < wanted) {
          check_.registrable.push_back(view);
        }
      });
      if (count == 0) break;
    }
    if (!headings().all_around()) SortByHeadingThatRegisters(wanted);
    if (ended_) return check_;
    check_.finished = true;
    TryAroundDoubtful(wanted);
    return check_;
  }

 private:
  // Checks the first few of `views` and returns how many; 0 when the budget ended.
  size_t Check(std::span<const uint32_t> views, absl::FunctionRef<void(const CheckedView&)> note) {
    ended_ = NoTimeLeft();
    if (ended_) return 0;
    const uint64_t affordable = (budget_.work_limit - check_.rays) / MostRays();
    const size_t count =
        std::min(static_cast<size_t>(std::clamp<uint64_t>(affordable, 1, kBatch)), views.size());
    std::vector<std::optional<Judged>> judged(count);
    parallel_.For(count, [&](size_t k) { judged[k] = Judge(views[k]); });
    for (size_t k = 0; k < count; ++k) {
      ended_ = !judged[k].has_value();
      if (ended_) return 0;
      check_.rays += judged[k]->rays;
      ++check_.checked;
      note(judged[k]->view);
    }
    return count;
  }

  // Views may be worth less with the headings that register than their ranks say.
  void SortByHeadingThatRegisters(size_t wanted) {
    std::stable_sort(
        check_.registrable.begin(), check_.registrable.end(),
        [this](const CheckedView& a, const CheckedView& b) { return Score(a) > Score(b); });
    check_.facing = check_.registrable;
    if (check_.registrable.size() > wanted) check_.registrable.resize(wanted);
  }

  struct Judged {
    CheckedView view;
    uint64_t rays = 0;
  };
  // Nothing when the budget ended.
  std::optional<Judged> Judge(uint32_t view) const {
    const Eigen::Vector3d at = feasible_.Centre(view);
    if (headings().all_around()) {
      const auto seen = surface_.Predict(at, scene_, config_.registration, budget_);
      if (!seen.has_value()) return std::nullopt;
      return Judged{{view, seen->verdict, std::nullopt, 0}, seen->rays};
    }
    std::vector<double> by_heading(headings().size());
    const ViewScore score =
        scoring_.scorer().ScoreHeadings(at, scoring_.cells(), budget_, by_heading);
    if (!score.finished) return std::nullopt;
    const auto seen = surface_.PredictBest(at, by_heading, scene_, config_.registration, budget_);
    if (!seen.has_value()) return std::nullopt;
    return Judged{{view, seen->verdict, seen->heading, by_heading[seen->heading]},
                  score.rays + seen->rays};
  }

  const Headings& headings() const { return scoring_.scorer().headings(); }
  uint64_t MostRays() const {
    return surface_.MostRays() +
           (headings().all_around() ? 0 : scoring_.scorer().MostRays(scoring_.cells()));
  }
  // How many of the views that register gain as much as a candidate may. Without headings all do,
  // since the best come first.
  size_t AsGoodAs(uint32_t candidate) const {
    if (headings().all_around()) return check_.registrable.size();
    return static_cast<size_t>(
        std::count_if(check_.registrable.begin(), check_.registrable.end(),
                      [&](const CheckedView& view) { return view.score >= Score(candidate); }));
  }

  bool NoTimeLeft() const { return check_.rays >= budget_.work_limit || budget_.Expired(); }
  double Score(uint32_t view) const { return evaluation_.views[view].Rank(); }
  double Score(const CheckedView& view) const {
    return view.heading.has_value() ? view.score : Score(view.view);
  }
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
      return Score(a) > Score(b);
    });
    check_.registrable.clear();
    for (const CheckedView& view : all) {
      const bool near = std::any_of(check_.registrable.begin(), check_.registrable.end(),
                                    [&](const CheckedView& o) { return Near(o.view, view.view); });
      if (!near && check_.registrable.size() < wanted) check_.registrable.push_back(view);
    }
  }

  const OverlapSurface& surface_;
  const Scoring& scoring_;
  const visibility::OcclusionScene& scene_;
  const Evaluation& evaluation_;
  const FeasibleViews& feasible_;
  const PlanningConfig& config_;
  const parallel::Budget& budget_;
  parallel::Parallel& parallel_;
  RegistrationCheck check_;
  bool ended_ = false;                   // the budget did
  absl::flat_hash_set<uint32_t> tried_;  // around doubtful candidates
};

}  // namespace

RegistrationCheck CheckRegistration(const PlanningProblem& problem, const OverlapSurface& surface,
                                    const Evaluation& evaluation,
                                    std::span<const uint32_t> candidates, size_t wanted,
                                    const parallel::Budget& budget, parallel::Parallel& parallel) {
  return Checking(problem, surface, evaluation, budget, parallel).Run(candidates, wanted);
}

RegistrationCheck CheckUntilOneRegisters(const PlanningProblem& problem,
                                         const Evaluation& evaluation,
                                         std::span<const uint32_t> candidates, size_t wanted,
                                         const parallel::Budget& budget,
                                         parallel::Parallel& parallel) {
  const auto surface = OverlapSurface::Of(problem, budget);
  if (!surface.ok()) return {};
  RegistrationCheck check =
      CheckRegistration(problem, *surface, evaluation, candidates, wanted, budget, parallel);
  const PlanningConfig& config = problem.config();
  double separation = config.candidate_separation;
  while (check.finished && check.registrable.empty() && separation > 0) {
    separation *= 2;
    std::vector<uint32_t> refused;
    for (const CheckedView& view : check.refused) refused.push_back(view.view);
    const std::vector<uint32_t> farther =
        RankViews(evaluation, problem.feasible(), separation,
                  static_cast<size_t>(config.max_checked), refused);
    if (farther.empty()) break;
    parallel::Budget left = budget;
    left.work_limit -= std::min(left.work_limit, check.rays);
    RegistrationCheck next =
        CheckRegistration(problem, *surface, evaluation, farther, wanted, left, parallel);
    check.registrable = std::move(next.registrable);
    check.facing = std::move(next.facing);
    check.refused.insert(check.refused.end(), next.refused.begin(), next.refused.end());
    check.refused_around.insert(check.refused_around.end(), next.refused_around.begin(),
                                next.refused_around.end());
    check.checked += next.checked;
    check.rays += next.rays;
    check.finished = next.finished;
  }
  return check;
}

}  // namespace vantage::planning

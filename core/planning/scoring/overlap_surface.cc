#include "core/planning/scoring/overlap_surface.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "absl/status/status.h"
#include "core/planning/scoring/brute_force.h"
#include "core/visibility/surface_walk.h"
#include "core/visibility/target.h"

namespace vantage::planning {
namespace {

// Surface elements of which a scan's prediction is made, at most: a share of them is right to 0.4
// %, one sigma, and the cost of a check grows with them.
constexpr size_t kElements = 16'000;
constexpr double kRoundingOfShare = 1e-9;

sensor::ScannerModel AnyIncidence(sensor::ScannerModel scanner) {
  scanner.max_incidence = sensor::kPi / 2 - 1e-3;
  return scanner;
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

// A brick that has surface.
struct SurfaceBrick {
  model::VoxelIndex at;
  const model::Brick* brick = nullptr;  // of the model
};

// Those of the model, in its order. Nothing when cancelled on the way.
std::optional<std::vector<SurfaceBrick>> BricksWithSurface(
    const model::PlanningView& model, const parallel::Cancellation& cancelled) {
  std::vector<SurfaceBrick> bricks;
  size_t until_poll = 0;
  for (const model::BrickAt& at : model.surface_bricks()) {
    if (until_poll-- == 0) {
      if (cancelled.Requested()) return std::nullopt;
      until_poll = visibility::kBricksBetweenPolls;
    }
    if (!at.contents->surface.empty()) bricks.push_back({at.brick, at.contents.get()});
  }
  return bricks;
}

// Neighbours in the model's order that one task looks at.
constexpr size_t kBricksOfRun = visibility::kBricksBetweenPolls / 2;

size_t RunsOf(std::span<const SurfaceBrick> bricks) {
  return (bricks.size() + kBricksOfRun - 1) / kBricksOfRun;
}

std::span<const SurfaceBrick> InRun(std::span<const SurfaceBrick> bricks, size_t run) {
  const size_t begin = run * kBricksOfRun;
  return bricks.subspan(begin, std::min(kBricksOfRun, bricks.size() - begin));
}

size_t CountTrueSurface(const model::Brick& brick) {
  size_t count = 0;
  ForEachTrueSurface(brick, [&](size_t, int) { ++count; });
  return count;
}

// The number of the first voxel of true surface of each run among those of all runs, and after the
// last the number of all. Nothing when cancelled on the way.
std::optional<std::vector<size_t>> FirstOfRuns(std::span<const SurfaceBrick> bricks,
                                               parallel::Parallel& parallel,
                                               const parallel::Cancellation& cancelled) {
  std::vector<size_t> first(RunsOf(bricks) + 1, 0);
  parallel.For(RunsOf(bricks), [&](size_t run) {
    if (cancelled.Requested()) return;
    for (const SurfaceBrick& at : InRun(bricks, run)) first[run + 1] += CountTrueSurface(*at.brick);
  });
  if (cancelled.Requested()) return std::nullopt;
  for (size_t run = 1; run < first.size(); ++run) first[run] += first[run - 1];
  return first;
}

// Calls fn(VoxelIndex, const SurfaceVoxel&) for every `stride`-th voxel of true surface of a run of
// which the first has the number `number`; looks closer only at bricks that have one.
template <typename Fn>
void WalkEvery(size_t stride, size_t number, std::span<const SurfaceBrick> run, Fn&& fn) {
  size_t wanted = (number + stride - 1) / stride * stride;  // the next, by its number among all
  for (const SurfaceBrick& at : run) {
    if (const size_t count = CountTrueSurface(*at.brick); wanted >= number + count) {
      number += count;
      continue;
    }
    ForEachTrueSurface(*at.brick, [&](size_t rank, int local) {
      if (number++ != wanted) return;
      wanted += stride;
      const model::SurfaceVoxel surface = at.brick->surface[rank];
      fn(model::PlanningView::Global(at.at, local), surface);
    });
  }
}

// A voxel that a scan may overlap.
struct Element {
  model::VoxelIndex voxel;
  model::SurfaceVoxel surface;
  Eigen::Vector3d target;
  PlaneExtent plane;
};

}  // namespace

OverlapSurface::OverlapSurface(double voxel, const sensor::ScannerModel& scanner)
    : voxel_(voxel), scanner_(scanner), headings_(scanner), constraints_(AnyIncidence(scanner)) {}

absl::StatusOr<OverlapSurface> OverlapSurface::Create(const model::PlanningView& model,
                                                      const visibility::OpaqueGrid& grid,
                                                      const visibility::OcclusionScene& scene,
                                                      const sensor::ScannerModel& scanner,
                                                      parallel::Parallel& parallel,
                                                      const parallel::Cancellation& cancelled) {
  const absl::Status stopped = absl::CancelledError("overlap surface");
  const auto bricks = BricksWithSurface(model, cancelled);
  if (!bricks) return stopped;
  const auto first = FirstOfRuns(*bricks, parallel, cancelled);
  if (!first) return stopped;
  const size_t stride = std::max<size_t>(1, (first->back() + kElements - 1) / kElements);
  std::vector<std::vector<Element>> elements(RunsOf(*bricks));
  parallel.For(elements.size(), [&](size_t run) {
    if (cancelled.Requested()) return;
    const auto note = [&](const model::VoxelIndex& v, const model::SurfaceVoxel& surface) {
      if (!(surface.area > 0)) return;
      const auto target = visibility::TargetOf(grid, v, surface.normal);
      if (!target.has_value()) return;
      Element element{v, surface, *target, {}};
      // What a scan all around overlaps is large, and edges and strips are a small part of it.
      if (!scanner.TurnsAllAround()) {
        if (!LiesInPlane(model, v, surface)) return;
        element.plane = ExtentOfPlane(model, surface);
      }
      elements[run].push_back(element);
    };
    WalkEvery(stride, (*first)[run], InRun(*bricks, run), note);
  });
  if (cancelled.Requested()) return stopped;
  OverlapSurface overlap(model.voxel_size(), scanner);
  overlap.weight_ = static_cast<double>(stride);
  overlap.rivals_ = std::make_shared<const registration::RivalForecast>(model);
  std::vector<Eigen::Vector3f> dropouts;
  for (const std::vector<Element>& of_run : elements) {
    for (const Element& element : of_run) {
      const model::SurfaceVoxel& surface = element.surface;
      dropouts.clear();
      for (const model::Dropout& dropout : model.Dropouts(element.voxel)) {
        dropouts.push_back(dropout.from);
      }
      overlap.cells_.Add(surface.centroid, surface.normal, surface.area, 0,
                         std::numeric_limits<float>::max(), scene.ToScene(element.target),
                         static_cast<uint32_t>(overlap.samples_.size()), dropouts);
      overlap.samples_.push_back(surface.samples);
      if (!scanner.TurnsAllAround()) overlap.planes_.push_back(element.plane);
    }
  }
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

std::optional<OverlapSurface::Overlap> OverlapSurface::See(const Eigen::Vector3d& view,
                                                           const visibility::OcclusionScene& scene,
                                                           const parallel::Budget& budget,
                                                           const CellArrays* expected) const {
  const BruteForceScorer scorer(constraints_, scene, voxel_);
  const Eigen::Vector3f at = view.cast<float>();
  Overlap overlap;
  std::vector<float> samples;
  const auto add = [&](const CellArrays& cells, const uint32_t* model_samples,
                       std::span<const PlaneExtent> planes) {
    samples.resize(cells.size());
    const ViewScore score = scorer.ScoreCells(view, cells, budget, samples);
    overlap.rays += score.rays;
    for (size_t i = 0; score.finished && i < samples.size(); ++i) {
      if (samples[i] <= 0) continue;
      const Eigen::Vector3f ray(cells.x[i] - at.x(), cells.y[i] - at.y(), cells.z[i] - at.z());
      if (!planes.empty() && !FindsPlane(planes[i], ray, scanner_)) samples[i] = 0;
      overlap.elements.push_back({{cells.x[i], cells.y[i], cells.z[i]},
                                  {cells.nx[i], cells.ny[i], cells.nz[i]},
                                  samples[i],
                                  model_samples != nullptr ? model_samples[i] : 1});
      overlap.bins.push_back(headings_.BinOf(ray.x(), ray.y()));
      if (&cells == &cells_) overlap.cells.push_back(static_cast<uint32_t>(i));
    }
    return score.finished;
  };
  if (!add(cells_, samples_.data(), planes_)) return std::nullopt;
  if (expected != nullptr && !add(*expected, nullptr, {})) return std::nullopt;
  return overlap;
}

double OverlapSurface::directions() const { return DirectionsOf(scanner_); }

registration::RegistrationVerdict OverlapSurface::Judge(
    std::span<const registration::OverlapElement> overlap, const Eigen::Vector3d& view,
    const registration::RegistrationConfig& config,
    std::span<const registration::TargetTie> targets) const {
  registration::RegistrationVerdict verdict = registration::PredictRegistration(
      overlap, weight_, DirectionsOf(scanner_), view, scanner_, config, targets);
  rivals_->Judge(overlap, view, scanner_, config, verdict, targets);
  return verdict;
}

std::optional<OverlapSurface::Sight> OverlapSurface::SightFrom(
    const Eigen::Vector3d& view, const visibility::OcclusionScene& scene,
    const parallel::Budget& budget, std::optional<double> heading) const {
  std::optional<Overlap> around = See(view, scene, budget, nullptr);
  if (!around.has_value()) return std::nullopt;
  if (!headings_.all_around() && heading.has_value()) KeepSeen(*heading, view, *around);
  Sight sight{std::vector<float>(cells_.size()), std::move(around->elements), around->rays};
  for (size_t k = 0; k < sight.elements.size(); ++k) {
    sight.samples[around->cells[k]] = sight.elements[k].samples;
  }
  return sight;
}

registration::RegistrationVerdict OverlapSurface::JudgeSight(
    const Sight& sight, const Eigen::Vector3d& view, const registration::RegistrationConfig& config,
    std::span<const registration::TargetTie> targets) const {
  return Judge(sight.elements, view, config, targets);
}

registration::RegistrationVerdict OverlapSurface::JudgeSightBeforeRivals(
    const Sight& sight, const Eigen::Vector3d& view,
    const registration::RegistrationConfig& config) const {
  return registration::PredictRegistration(sight.elements, weight_, DirectionsOf(scanner_), view,
                                           scanner_, config);
}

registration::TargetedPrediction OverlapSurface::Targeted(
    const Sight& sight, const Eigen::Vector3d& view,
    const registration::RegistrationConfig& config) const {
  return {sight.elements, weight_, view, scanner_, config};
}

bool OverlapSurface::Sees(const Eigen::Vector3d& view, const Eigen::Vector3d& point,
                          const visibility::OcclusionScene& scene,
                          std::optional<double> heading) const {
  // Rays end in front of surface, which is opaque.
  constexpr double kBefore = 2;  // voxels
  const Eigen::Vector3d ray = point - view;
  if (!Sector(scanner_, heading).Sees(static_cast<float>(ray.x()), static_cast<float>(ray.y()))) {
    return false;
  }
  const double range = ray.norm();
  const Eigen::Vector3d end = point - std::min(kBefore * voxel_, range) / range * ray;
  const Eigen::Vector3f to = scene.ToScene(end / voxel_);
  visibility::TargetPacket packet{};
  packet.x[0] = to.x();
  packet.y[0] = to.y();
  packet.z[0] = to.z();
  return scene.Occluded(scene.ToScene(view / voxel_), packet, 1) == 0;
}

void OverlapSurface::KeepSeen(double heading, const Eigen::Vector3d& view, Overlap& around) const {
  const Sector one_side(scanner_, heading - headings_.step());
  const Sector other_side(scanner_, heading + headings_.step());
  const Eigen::Vector3f at = view.cast<float>();
  size_t kept = 0;
  size_t kept_of_model = 0;
  for (size_t k = 0; k < around.elements.size(); ++k) {
    const float x = around.elements[k].position.x() - at.x();
    const float y = around.elements[k].position.y() - at.y();
    if (!one_side.Sees(x, y) || !other_side.Sees(x, y)) continue;
    around.elements[kept] = around.elements[k];
    around.bins[kept] = around.bins[k];
    // Those of the model come first, so that they stay the first.
    if (k < around.cells.size()) around.cells[kept_of_model++] = around.cells[k];
    ++kept;
  }
  around.elements.resize(kept);
  around.bins.resize(kept);
  around.cells.resize(kept_of_model);
}

std::optional<OverlapSurface::Seen> OverlapSurface::Predict(
    const Eigen::Vector3d& view, const visibility::OcclusionScene& scene,
    const registration::RegistrationConfig& config, const parallel::Budget& budget,
    const CellArrays* expected, std::optional<double> heading) const {
  std::optional<Overlap> around = See(view, scene, budget, expected);
  if (!around.has_value()) return std::nullopt;
  if (!headings_.all_around() && heading.has_value()) KeepSeen(*heading, view, *around);
  return Seen{Judge(around->elements, view, config), around->rays, 0};
}

std::optional<OverlapSurface::Bounds> OverlapSurface::BoundsAt(
    const Eigen::Vector3d& view, const visibility::OcclusionScene& scene,
    const registration::RegistrationConfig& config, const parallel::Budget& budget) const {
  std::optional<Overlap> around = See(view, scene, budget, nullptr);
  if (!around.has_value()) return std::nullopt;
  std::vector<registration::OverlapElement> overlap = std::move(around->elements);
  if (!headings_.all_around()) {
    std::vector<double> by_bin(headings_.bins(), 0);
    std::vector<double> samples(headings_.size());
    for (size_t k = 0; k < overlap.size(); ++k) {
      by_bin[around->bins[k]] += static_cast<double>(overlap[k].samples);
    }
    headings_.Sum(by_bin, samples);
    const size_t heading = BestOf(samples).heading;
    std::vector<registration::OverlapElement> seen;
    for (size_t k = 0; k < overlap.size(); ++k) {
      if (headings_.Sees(heading, around->bins[k])) seen.push_back(overlap[k]);
    }
    overlap = std::move(seen);
  }
  return Bounds{registration::BoundsOf(overlap, weight_, view, scanner_, config), around->rays};
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

}  // namespace vantage::planning

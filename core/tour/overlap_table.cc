#include "core/tour/overlap_table.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "core/model/view/voxel.h"
#include "core/planning/scoring/brute_force.h"
#include "core/registration/bound/prediction.h"
#include "core/registration/bound/rival_forecast.h"

namespace vantage::tour {
namespace {

// Least share, in (0, 1/3), of the weakest of the three directions that surface faces, in what
// overlaps: less leaves a slide. Where a corridor's two walls and its floor are all that is seen
// its ends are a twentieth; they have to do.
constexpr float kWeakestDirection = 0.02F;
constexpr uint32_t kEveryNth = 4;  // element of a pair

sensor::ScannerModel AtAnyIncidence(sensor::ScannerModel scanner) {
  scanner.max_incidence = sensor::kPi / 2 - 1e-3;
  return scanner;
}

// The share of a scan that overlaps, and which ways it faces.
class OverlapSum {
 public:
  void Add(float share, const Eigen::Vector3f& normal) {
    share_ += share;
    facing_ += share * normal * normal.transpose();
  }
  bool Suffices(double least_share) const {
    if (share_ < static_cast<float>(least_share)) return false;
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver;
    solver.computeDirect(facing_, Eigen::EigenvaluesOnly);
    return solver.eigenvalues()(0) >= kWeakestDirection * share_;
  }

 private:
  float share_ = 0;
  Eigen::Matrix3f facing_ = Eigen::Matrix3f::Zero();
};

}  // namespace

absl::StatusOr<OverlapTable> OverlapTable::Create(const planning::PlanningProblem& problem,
                                                  parallel::Parallel& parallel,
                                                  const parallel::Cancellation& cancelled) {
  absl::StatusOr<planning::OverlapSurface> surface = absl::UnknownError("not made");
  std::shared_ptr<const registration::FieldAllOver> all_over;
  parallel.For(2, [&](size_t part) {
    if (part == 0) {
      surface = planning::OverlapSurface::Create(problem.view(), problem.grid(), problem.scene(),
                                                 problem.scanner(), parallel, cancelled);
    } else if (!cancelled.Requested() &&
               registration::FieldAllOver::Serves(problem.view(), problem.config().registration)) {
      // Verdicts are asked for by the hundred. Of a larger site each makes its own.
      all_over = std::make_shared<const registration::FieldAllOver>(
          problem.view(), problem.config().registration, parallel);
    }
  });
  if (!surface.ok()) return surface.status();
  if (cancelled.Requested()) return absl::CancelledError("overlap table");
  if (all_over != nullptr) surface->LookForRivalsIn(std::move(all_over));
  OverlapTable table(problem, *std::move(surface));
  const planning::CellArrays& cells = table.surface_.cells();
  const double voxel = problem.model().voxel_size();
  for (size_t i = 0; i < cells.size(); ++i) {
    // Half a voxel below the face that the centroid may lie on.
    const Eigen::Vector3d in(cells.x[i] - 1e-3 * voxel * cells.nx[i],
                             cells.y[i] - 1e-3 * voxel * cells.ny[i],
                             cells.z[i] - 1e-3 * voxel * cells.nz[i]);
    const model::VoxelState state = problem.model().State(problem.model().At(in));
    table.known_.push_back(state == model::VoxelState::kTrueSurface ? 1 : 0);
    table.normals_.emplace_back(cells.nx[i], cells.ny[i], cells.nz[i]);
  }
  const planning::CellArrays& all = problem.scoring().cells();
  std::vector<uint32_t> indices;
  std::vector<float> areas;
  for (uint32_t i = 0; i < all.size(); ++i) {
    const planning::DeficientCell& cell = problem.patches().cells[all.cell[i]];
    const bool opening =
        cell.kind == model::SurfaceKind::kOcclusion || cell.kind == model::SurfaceKind::kImage;
    if (!opening || cell.expected || cell.success < 1) continue;
    indices.push_back(i);
    areas.push_back(cell.area);
  }
  // Thinned as the model's surface, and further where there is more of it than that has: at the
  // beginning of a large job hardly anything is measured, and nearly all is false.
  const double left = static_cast<double>(indices.size()) / table.surface_.weight();
  const auto every = static_cast<size_t>(std::ceil(std::max(1.0, left / (kMostFalse - 1))));
  for (size_t k = 0; every > 1 && k * every < indices.size(); ++k) {
    indices[k] = indices[k * every];
    areas[k] = areas[k * every];
  }
  indices.resize((indices.size() + every - 1) / every);
  areas.resize(indices.size());
  table.false_weight_ = static_cast<float>(every);
  table.false_ = table.surface_.Thinned(all, indices, areas);
  for (size_t i = 0; i < table.false_.size(); ++i) {
    table.known_.push_back(0);
    table.normals_.emplace_back(table.false_.nx[i], table.false_.ny[i], table.false_.nz[i]);
  }
  table.least_share_ = registration::AskedShare(problem.scanner(), problem.config().registration);
  return table;
}

std::optional<OverlapTable::Seen> OverlapTable::See(const Candidate& candidate,
                                                    const parallel::Budget& budget,
                                                    uint64_t& rays) const {
  auto sight = surface_.SightFrom(candidate.position, problem_.scene(), budget, candidate.heading);
  if (!sight.has_value()) return std::nullopt;
  rays += sight->rays;
  Seen seen;
  size_t next = 0;
  for (uint32_t i = 0; i < sight->samples.size(); ++i) {
    if (sight->samples[i] <= 0) continue;
    // Elements whose plane a sector's scan would not find count as overlap only, and have no
    // samples.
    while (next < sight->elements.size() && sight->elements[next].samples <= 0) ++next;
    if (next == sight->elements.size()) break;
    seen.at.push_back(i);
    seen.elements.push_back(sight->elements[next++]);
    seen.elements.back().model_samples = std::max<uint32_t>(1, seen.elements.back().model_samples);
  }
  if (false_.size() == 0) return seen;
  const planning::SensingConstraints constraints(AtAnyIncidence(problem_.scanner()));
  const planning::BruteForceScorer scorer(constraints, problem_.scene(),
                                          problem_.model().voxel_size());
  std::vector<float> samples(false_.size());
  const planning::ViewScore score = scorer.ScoreCells(candidate.position, false_, budget, samples);
  rays += score.rays;
  if (!score.finished) return std::nullopt;
  const planning::Sector sector(problem_.scanner(), candidate.heading);
  planning::KeepSector(sector, candidate.position, false_, samples);
  const auto model = static_cast<uint32_t>(surface_.cells().size());
  for (uint32_t i = 0; i < samples.size(); ++i) {
    if (samples[i] <= 0) continue;
    seen.at.push_back(model + i);
    seen.elements.push_back({{false_.x[i], false_.y[i], false_.z[i]},
                             {false_.nx[i], false_.ny[i], false_.nz[i]},
                             false_weight_ * samples[i],
                             1});
  }
  return seen;
}

std::optional<OverlapTable::Sight> OverlapTable::SightFrom(const Candidate& candidate,
                                                           const parallel::Budget& budget,
                                                           uint64_t& rays) const {
  std::optional<Seen> seen = See(candidate, budget, rays);
  if (!seen.has_value()) return std::nullopt;
  Sight sight;
  sight.elements = std::move(seen->at);
  sight.share.reserve(sight.elements.size());
  const double to_share = surface_.weight() / surface_.directions();
  for (const registration::OverlapElement& element : seen->elements) {
    sight.share.push_back(static_cast<float>(to_share * static_cast<double>(element.samples)));
  }
  return sight;
}

bool OverlapTable::MayRegister(const Sight& sight, const std::vector<uint8_t>& seen) const {
  OverlapSum overlap;
  for (size_t k = 0; k < sight.elements.size(); ++k) {
    const uint32_t i = sight.elements[k];
    if (seen[i] != 0) overlap.Add(sight.share[k], normals_[i]);
  }
  return overlap.Suffices(least_share_);
}

bool OverlapTable::AnyKnown() const {
  return std::any_of(known_.begin(), known_.end(), [](uint8_t known) { return known != 0; });
}

bool OverlapTable::MayRegisterToKnown(const Sight& sight) const {
  return MayRegister(sight, known_);
}

bool OverlapTable::Linked(const Sight& a, const Sight& b) const {
  OverlapSum of_a;
  OverlapSum of_b;
  size_t i = 0;
  size_t j = 0;
  const auto known = [&](const Sight& sight, size_t k, OverlapSum& sum) {
    const uint32_t element = sight.elements[k];
    if (element % kEveryNth == 0 && known_[element] != 0) {
      sum.Add(kEveryNth * sight.share[k], normals_[element]);
    }
  };
  while (i < a.elements.size() && j < b.elements.size()) {
    if (a.elements[i] < b.elements[j]) {
      known(a, i++, of_a);
    } else if (b.elements[j] < a.elements[i]) {
      known(b, j++, of_b);
    } else {
      const uint32_t element = a.elements[i];
      if (element % kEveryNth == 0) {
        of_a.Add(kEveryNth * a.share[i], normals_[element]);
        of_b.Add(kEveryNth * b.share[j], normals_[element]);
      }
      ++i;
      ++j;
    }
  }
  for (; i < a.elements.size(); ++i) known(a, i, of_a);
  for (; j < b.elements.size(); ++j) known(b, j, of_b);
  return of_a.Suffices(least_share_) && of_b.Suffices(least_share_);
}

std::optional<registration::RegistrationVerdict> OverlapTable::Judge(
    const Candidate& candidate, const std::vector<uint8_t>& seen, Judging judging,
    const parallel::Budget& budget, uint64_t& rays) const {
  std::optional<Seen> around = See(candidate, budget, rays);
  if (!around.has_value()) return std::nullopt;
  planning::OverlapSurface::Sight overlap;
  for (size_t k = 0; k < around->at.size(); ++k) {
    if (seen[around->at[k]] != 0) overlap.elements.push_back(around->elements[k]);
  }
  if (judging == Judging::kBeforeRivals) {
    return surface_.JudgeSightBeforeRivals(overlap, candidate.position,
                                           problem_.config().registration);
  }
  return surface_.JudgeSight(overlap, candidate.position, problem_.config().registration, {});
}

}  // namespace vantage::tour

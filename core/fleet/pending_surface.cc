#include "core/fleet/pending_surface.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace vantage::fleet {

PendingSurface::PendingSurface(const planning::PlanningProblem& problem,
                               const planning::OverlapSurface& overlap, ExpectedRooms rooms)
    : problem_(problem), overlap_(overlap), rooms_(rooms), at_(problem.patches().cells.size(), 0) {
  const planning::CellArrays& cells = problem.scoring().cells();
  for (uint32_t i = 0; i < cells.size(); ++i) at_[cells.cell[i]] = i;
}

planning::CellArrays PendingSurface::Of(const RemainingGain& remaining,
                                        const std::vector<size_t>& steps) const {
  std::vector<uint32_t> seen;  // often by several steps
  for (const size_t step : steps) {
    seen.insert(seen.end(), remaining.Seen(step).begin(), remaining.Seen(step).end());
  }
  std::sort(seen.begin(), seen.end());
  seen.erase(std::unique(seen.begin(), seen.end()), seen.end());
  std::vector<uint32_t> indices;
  std::vector<float> areas;
  for (const uint32_t i : seen) {
    const planning::DeficientCell& cell = problem_.patches().cells[i];
    const bool opening = cell.expected || cell.kind == model::SurfaceKind::kOcclusion ||
                         cell.kind == model::SurfaceKind::kImage;
    if (!opening || cell.success < 1) continue;
    if (cell.expected && rooms_ == ExpectedRooms::kLeaveOut) continue;
    // What a room is like of which only the doorway was seen is no guess to register by.
    const planning::Expectation* expectation = problem_.expectation();
    if (cell.expected && expectation != nullptr && expectation->OnlyGlimpsed(cell.voxel)) continue;
    indices.push_back(at_[i]);
    areas.push_back(cell.area);
  }
  return overlap_.Thinned(problem_.scoring().cells(), indices, areas);
}

std::optional<PendingSurface::Verdict> PendingSurface::Judge(
    const Eigen::Vector3d& view, const RemainingGain& remaining,
    const registration::RegistrationConfig& config, const parallel::Budget& budget, uint64_t& rays,
    std::span<const double> by_heading, std::optional<double> heading) {
  const bool given = heading.has_value();
  const auto predict = [&](const std::vector<size_t>& steps) {
    const planning::CellArrays expected = Of(remaining, steps);
    auto seen =
        by_heading.size() <= 1 || heading.has_value()
            ? overlap_.Predict(view, problem_.scene(), config, budget, &expected, heading)
            : overlap_.PredictBest(view, by_heading, problem_.scene(), config, budget, &expected);
    if (seen.has_value()) rays += seen->rays;
    return seen;
  };
  auto alone = predict({});
  if (!alone.has_value()) return std::nullopt;
  Verdict judged{std::move(alone->verdict), {}, alone->heading};
  if (judged.verdict.registered() || remaining.steps() == 0) return judged;
  std::vector<size_t> needed(remaining.steps());
  std::iota(needed.begin(), needed.end(), size_t{0});
  auto after = predict(needed);
  if (!after.has_value()) return std::nullopt;
  if (!after->verdict.registered()) return judged;
  judged.verdict = after->verdict;
  judged.heading = after->heading;
  if (by_heading.size() > 1 && !given) {
    heading = problem_.scoring().scorer().headings().Angle(after->heading);
  }
  for (size_t k = remaining.steps(); k-- > 0;) {
    std::vector<size_t> fewer = needed;
    std::erase(fewer, k);
    auto without = predict(fewer);
    if (!without.has_value()) return std::nullopt;
    if (!without->verdict.registered()) continue;
    needed = std::move(fewer);
    judged.verdict = without->verdict;
  }
  judged.waits_for = std::move(needed);
  return judged;
}

}  // namespace vantage::fleet

#include "core/fleet/waiting.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace vantage {

ExpectedSurface::ExpectedSurface(const PatchSet& patches, const Scoring& scoring,
                                 const OverlapSurface& overlap)
    : patches_(patches), scoring_(scoring), overlap_(overlap), at_(patches.cells.size(), 0) {
  const CellArrays& cells = scoring.cells();
  for (uint32_t i = 0; i < cells.size(); ++i) at_[cells.cell[i]] = i;
}

CellArrays ExpectedSurface::Of(const Residual& residual, const std::vector<size_t>& steps) const {
  std::vector<uint32_t> seen;  // by several steps, often
  for (const size_t step : steps) {
    seen.insert(seen.end(), residual.Seen(step).begin(), residual.Seen(step).end());
  }
  std::sort(seen.begin(), seen.end());
  seen.erase(std::unique(seen.begin(), seen.end()), seen.end());
  std::vector<uint32_t> indices;
  std::vector<float> areas;
  for (const uint32_t i : seen) {
    const NeedyCell& cell = patches_.cells[i];
    const bool opening = cell.kind == SurfaceKind::kOcclusion || cell.kind == SurfaceKind::kImage;
    if (!opening || cell.success < 1) continue;
    indices.push_back(at_[i]);
    areas.push_back(cell.area);
  }
  return overlap_.Thinned(scoring_.cells(), indices, areas);
}

std::optional<ExpectedSurface::Verdict> ExpectedSurface::Judge(const Eigen::Vector3d& view,
                                                               const Residual& residual,
                                                               const RegistrationConfig& config,
                                                               const Budget& budget,
                                                               uint64_t& rays) {
  const auto predict = [&](const std::vector<size_t>& steps) {
    const CellArrays expected = Of(residual, steps);
    auto seen = overlap_.Predict(view, scoring_.scene(), config, budget, &expected);
    if (seen.has_value()) rays += seen->rays;
    return seen;
  };
  auto alone = predict({});
  if (!alone.has_value()) return std::nullopt;
  Verdict judged{std::move(alone->verdict), {}};
  if (judged.verdict.registered() || residual.steps() == 0) return judged;
  std::vector<size_t> needed(residual.steps());
  std::iota(needed.begin(), needed.end(), size_t{0});
  auto after = predict(needed);
  if (!after.has_value()) return std::nullopt;
  if (!after->verdict.registered()) return judged;
  judged.verdict = after->verdict;
  for (size_t k = residual.steps(); k-- > 0;) {
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

}  // namespace vantage

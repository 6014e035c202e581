#include "core/planning/evaluation_run.h"

#include <algorithm>
#include <utility>

namespace vantage {
namespace {

// A view is scored in parts, so that a few views keep several threads busy.
constexpr uint32_t kPacketsOfPart = 512;

}  // namespace

std::vector<uint32_t> ByScore(const Evaluation& evaluation) {
  std::vector<uint32_t> order;
  for (uint32_t i = 0; i < evaluation.views.size(); ++i) {
    if (evaluation.views[i].scored) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    return evaluation.views[a].Rank() > evaluation.views[b].Rank();
  });
  return order;
}

EvaluationRun::EvaluationRun(const BruteForceScorer& scorer, const FeasibleViews& views,
                             const CellArrays& cells, double potential, const Budget& budget,
                             Parallel& parallel, std::span<const double> worth)
    : scorer_(scorer),
      views_(views),
      cells_(cells),
      budget_(budget),
      parallel_(parallel),
      worth_(worth) {
  ViewEstimate unknown;
  unknown.upper = potential;
  evaluation_.views.assign(views.cells().size(), unknown);
  uint32_t last = 0;
  for (const uint32_t cell : cells.cell) last = std::max(last, cell + 1);
  seen_ = std::vector<std::atomic<uint8_t>>(last);
}

size_t EvaluationRun::Affordable(const CellArrays& cells, size_t most, const Budget& part) const {
  const uint64_t each = std::max<uint64_t>(1, scorer_.MostRays(cells));
  return static_cast<size_t>(std::clamp<uint64_t>(WorkLeft(part) / each, 1, most));
}

bool EvaluationRun::Score(std::span<const uint32_t> which, const CellArrays& cells,
                          const Budget& part,
                          absl::FunctionRef<void(uint32_t view, double gain)> note) {
  const auto packets = static_cast<uint32_t>(cells.packets());
  const size_t parts = std::max(1u, (packets + kPacketsOfPart - 1) / kPacketsOfPart);
  bool all = true;
  size_t count = 0;
  for (size_t begin = 0; begin < which.size(); begin += count) {
    if (Spent(part)) return false;
    count = Affordable(cells, which.size() - begin, part);
    scores_.assign(count * parts, {});
    parallel_.For(scores_.size(), [&](size_t i) {
      const auto first = static_cast<uint32_t>(i % parts) * kPacketsOfPart;
      const PacketRange range{first, std::min(first + kPacketsOfPart, packets), false};
      scores_[i] = scorer_.ScorePackets(views_.Centre(which[begin + i / parts]), cells, {&range, 1},
                                        part, seen_);
    });
    for (size_t k = 0; k < count; ++k) {
      ViewScore whole;
      whole.finished = true;
      for (size_t i = k * parts; i < (k + 1) * parts; ++i) {
        whole.gain += scores_[i].gain;
        whole.rays += scores_[i].rays;
        whole.finished = whole.finished && scores_[i].finished;
      }
      evaluation_.rays += whole.rays;
      all = all && whole.finished;
      if (whole.finished) note(which[begin + k], whole.gain);
    }
  }
  return all;
}

bool EvaluationRun::ScoreExactly(std::span<const uint32_t> which, const Budget& part) {
  return Score(which, cells_, part, [this](uint32_t i, double gain) { SetExact(i, gain); });
}

void EvaluationRun::SetExact(uint32_t i, double gain) {
  evaluation_.exact += !evaluation_.views[i].exact;
  evaluation_.views[i] = {gain, gain, gain, true, true, 0};
}

Evaluation EvaluationRun::Finish() {
  evaluation_.seen.assign(seen_.begin(), seen_.end());
  return std::move(evaluation_);
}

}  // namespace vantage

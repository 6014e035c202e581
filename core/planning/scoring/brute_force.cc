#include "core/planning/scoring/brute_force.h"

#include <algorithm>
#include <array>
#include <bit>

namespace vantage::planning {
namespace {

constexpr size_t kPacketsBetweenPolls = 1024;
// Of one view on several threads: some tenths of a millisecond.
constexpr size_t kPacketsAtOnce = 1024;

struct Origin {
  Eigen::Vector3f model;  // m
  Eigen::Vector3f scene;
};

// Cells that passed the cheap tests, waiting until they fill a packet of rays.
struct Waiting {
  visibility::TargetPacket targets;
  uint32_t known = 0;  // bit i: visible without a ray
  std::array<float, 8> cell_score;
  std::array<uint32_t, 8> at;
  int count = 0;
};

}  // namespace

template <typename OnScore>
ViewScore BruteForceScorer::Run(const Eigen::Vector3d& view, const CellArrays& cells,
                                std::span<const PacketRange> ranges, const parallel::Budget& budget,
                                OnScore&& on_score) const {
  std::array<Origin, 9> origins;
  const int origin_count = sensitivity_ != nullptr ? 9 : 1;
  for (int i = 0; i < origin_count; ++i) {
    Eigen::Vector3d at = view;
    if (i > 0) {
      for (int a = 0; a < 3; ++a) at[a] += ((i - 1) >> a) & 1 ? reach() : -reach();
    }
    origins[static_cast<size_t>(i)] = {at.cast<float>(), scene_.ToScene(at / voxel_)};
  }

  ViewScore score;
  Waiting waiting;
  const auto trace = [&] {
    uint32_t visible = ((1u << waiting.count) - 1) & ~waiting.known;
    for (int i = 0; i < origin_count && visible != 0; ++i) {
      score.rays += static_cast<uint64_t>(std::popcount(visible));
      visible &= ~scene_.Occluded(origins[static_cast<size_t>(i)].scene, waiting.targets, visible);
    }
    visible |= waiting.known;
    for (; visible != 0; visible &= visible - 1) {
      const auto k = static_cast<size_t>(std::countr_zero(visible));
      if (sensitivity_ != nullptr) {
        waiting.cell_score[k] = sensitivity_->CellScore(view, cells, waiting.at[k]);
        if (waiting.cell_score[k] <= 0) continue;
      }
      score.score += static_cast<double>(waiting.cell_score[k]);
      on_score(waiting.at[k], waiting.cell_score[k]);
    }
    waiting.count = 0;
    waiting.known = 0;
  };

  alignas(32) float cell_scores[8];
  alignas(32) float other[8];
  size_t until_poll = 0;
  for (const PacketRange& range : ranges) {
    for (size_t packet = range.begin; packet < range.end; ++packet) {
      if (until_poll-- == 0) {
        if (budget.Expired()) return score;
        until_poll = kPacketsBetweenPolls;
      }
      uint32_t bits = constraints_.CellScores(origins[0].model, cells, packet, cell_scores);
      for (int i = 1; i < origin_count && bits != 0; ++i) {
        bits &=
            constraints_.CellScores(origins[static_cast<size_t>(i)].model, cells, packet, other);
      }
      for (; bits != 0; bits &= bits - 1) {
        const auto k = static_cast<size_t>(std::countr_zero(bits));
        const size_t at = packet * CellArrays::kPacket + k;
        if (cells.IsDropout(origins[0].model, at)) continue;
        if (cells.PassesIntoSky(origins[0].model, at)) continue;
        const auto slot = static_cast<size_t>(waiting.count);
        waiting.targets.x[slot] = cells.tx[at];
        waiting.targets.y[slot] = cells.ty[at];
        waiting.targets.z[slot] = cells.tz[at];
        waiting.cell_score[slot] = cell_scores[k];
        waiting.at[slot] = static_cast<uint32_t>(at);
        waiting.known |= static_cast<uint32_t>(range.visible) << slot;
        if (++waiting.count == 8) trace();
      }
    }
  }
  if (waiting.count > 0) {
    for (auto slot = static_cast<size_t>(waiting.count); slot < 8; ++slot) {
      waiting.targets.x[slot] = waiting.targets.y[slot] = waiting.targets.z[slot] = 0;
    }
    trace();
  }
  score.finished = true;
  return score;
}

ViewScore BruteForceScorer::Score(const Eigen::Vector3d& view, const CellArrays& cells,
                                  const parallel::Budget& budget,
                                  std::span<std::atomic<uint8_t>> seen) const {
  const PacketRange all{0, static_cast<uint32_t>(cells.packets()), false};
  return ScorePackets(view, cells, {&all, 1}, budget, seen);
}

ViewScore BruteForceScorer::ScorePackets(const Eigen::Vector3d& view, const CellArrays& cells,
                                         std::span<const PacketRange> ranges,
                                         const parallel::Budget& budget,
                                         std::span<std::atomic<uint8_t>> seen) const {
  if (seen.empty()) return Run(view, cells, ranges, budget, [](uint32_t, float) {});
  return Run(view, cells, ranges, budget,
             [&](uint32_t at, float) { MarkSeen(seen, cells.cell[at]); });
}

ViewScore BruteForceScorer::ScoreBins(const Eigen::Vector3d& view, const CellArrays& cells,
                                      std::span<const PacketRange> ranges,
                                      const parallel::Budget& budget,
                                      std::span<std::atomic<uint8_t>> seen,
                                      std::span<double> by_bin) const {
  const Eigen::Vector3f at_view = view.cast<float>();
  return Run(view, cells, ranges, budget, [&](uint32_t at, float score) {
    if (!seen.empty()) MarkSeen(seen, cells.cell[at]);
    by_bin[headings_.BinOf(cells.x[at] - at_view.x(), cells.y[at] - at_view.y())] +=
        static_cast<double>(score);
  });
}

ViewScore BruteForceScorer::ScoreHeadings(const Eigen::Vector3d& view, const CellArrays& cells,
                                          const parallel::Budget& budget,
                                          std::span<double> by_heading) const {
  std::vector<double> by_bin(headings_.bins(), 0);
  const PacketRange all{0, static_cast<uint32_t>(cells.packets()), false};
  ViewScore score = ScoreBins(view, cells, {&all, 1}, budget, {}, by_bin);
  headings_.Sum(by_bin, by_heading);
  const BestHeading best = BestOf(by_heading);
  score.score = best.score;
  score.heading = best.heading;
  return score;
}

ViewScore BruteForceScorer::ScoreCells(const Eigen::Vector3d& view, const CellArrays& cells,
                                       const parallel::Budget& budget,
                                       std::span<float> cell_scores) const {
  std::fill(cell_scores.begin(), cell_scores.end(), 0.0f);
  const PacketRange all{0, static_cast<uint32_t>(cells.packets()), false};
  return Run(view, cells, {&all, 1}, budget,
             [&](uint32_t at, float score) { cell_scores[at] = score; });
}

ViewScore BruteForceScorer::ScoreCells(const Eigen::Vector3d& view, const CellArrays& cells,
                                       const parallel::Budget& budget, parallel::Parallel& parallel,
                                       std::span<float> cell_scores) const {
  std::fill(cell_scores.begin(), cell_scores.end(), 0.0f);
  const size_t packets = cells.packets();
  std::vector<ViewScore> parts((packets + kPacketsAtOnce - 1) / kPacketsAtOnce);
  parallel.For(parts.size(), [&](size_t p) {
    const PacketRange part{static_cast<uint32_t>(p * kPacketsAtOnce),
                           static_cast<uint32_t>(std::min(packets, (p + 1) * kPacketsAtOnce)),
                           false};
    parts[p] = Run(view, cells, {&part, 1}, budget,
                   [&](uint32_t at, float score) { cell_scores[at] = score; });
  });
  ViewScore whole;
  whole.finished = true;
  for (const ViewScore& part : parts) {
    whole.rays += part.rays;
    whole.finished = whole.finished && part.finished;
  }
  // In the order in which one thread adds them.
  for (const float score : cell_scores) whole.score += static_cast<double>(score);
  return whole;
}

std::vector<ViewScore> ScoreEveryView(const BruteForceScorer& scorer,
                                      std::span<const Eigen::Vector3d> views,
                                      const CellArrays& cells, const parallel::Budget& budget,
                                      parallel::Parallel& parallel) {
  std::vector<ViewScore> scores(views.size());
  parallel.For(views.size(), [&](size_t i) { scores[i] = scorer.Score(views[i], cells, budget); });
  return scores;
}

}  // namespace vantage::planning

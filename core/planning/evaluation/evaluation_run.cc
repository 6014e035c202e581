#include "core/planning/evaluation/evaluation_run.h"

#include <algorithm>
#include <utility>

namespace vantage::planning {
namespace {

constexpr uint32_t kPacketsOfPart = 512;
constexpr size_t kSmallSample = 1024;  // cells; for fewer the cache is slower

// The packets of a sample that hold any of a range of all cells' packets.
PacketRange Among(std::span<const uint32_t> of, const PacketRange& range) {
  const auto at = [&](uint32_t packet) {
    const auto cell = static_cast<uint32_t>(packet * CellArrays::kPacket);
    return static_cast<size_t>(std::lower_bound(of.begin(), of.end(), cell) - of.begin());
  };
  constexpr size_t kPacket = CellArrays::kPacket;
  const size_t begin = at(range.begin);
  const size_t end = at(range.end);
  if (begin == end) return {};
  return {static_cast<uint32_t>(begin / kPacket),
          static_cast<uint32_t>((end + kPacket - 1) / kPacket), range.visible};
}

}  // namespace

EvaluationRun::EvaluationRun(const BruteForceScorer& scorer, const FeasibleViews& views,
                             const CellArrays& cells, double potential,
                             const parallel::Budget& budget, parallel::Parallel& parallel,
                             std::span<const double> worth,
                             std::optional<VisibilityCache> visibility_cache)
    : scorer_(scorer),
      views_(views),
      cells_(cells),
      budget_(budget),
      parallel_(parallel),
      worth_(worth),
      visibility_cache_(std::move(visibility_cache)) {
  ViewEstimate unknown;
  unknown.upper = potential;
  evaluation_.views.assign(views.cells().size(), unknown);
  uint32_t last = 0;
  for (const uint32_t cell : cells.cell) last = std::max(last, cell + 1);
  seen_ = std::vector<std::atomic<uint8_t>>(last);
}

size_t EvaluationRun::Affordable(const CellArrays& cells, size_t most,
                                 const parallel::Budget& part) const {
  const uint64_t each = std::max<uint64_t>(1, scorer_.MostRays(cells));
  return static_cast<size_t>(std::clamp<uint64_t>(WorkLeft(part) / each, 1, most));
}

void EvaluationRun::Divide(std::span<const uint32_t> which, const CellSample* sample) {
  const CellArrays& cells = sample != nullptr ? sample->cells : cells_;
  ranges_.clear();
  parts_.clear();
  uint32_t room = 0;  // packets that the last part has room for
  const auto add = [&](PacketRange range) {
    while (range.begin < range.end) {
      if (room == 0) {
        const auto next = static_cast<uint32_t>(ranges_.size());
        parts_.push_back({parts_.back().view, next, next});
        room = kPacketsOfPart;
      }
      const uint32_t end = range.begin + std::min(room, range.end - range.begin);
      ranges_.push_back({range.begin, end, range.visible});
      parts_.back().end = static_cast<uint32_t>(ranges_.size());
      room -= end - range.begin;
      range.begin = end;
    }
  };
  for (uint32_t k = 0; k < which.size(); ++k) {
    const auto next = static_cast<uint32_t>(ranges_.size());
    parts_.push_back({k, next, next});
    room = kPacketsOfPart;
    const std::vector<PacketRange>* potentially_visible =
        visibility_cache_.has_value() && cells.size() >= kSmallSample
            ? visibility_cache_->PotentiallyVisibleFrom(which[k])
            : nullptr;
    if (potentially_visible == nullptr) {
      add({0, static_cast<uint32_t>(cells.packets()), false});
    } else if (sample == nullptr) {
      for (const PacketRange& range : *potentially_visible) add(range);
    } else {
      uint32_t done = 0;  // two ranges may share a packet of the sample
      for (const PacketRange& range : *potentially_visible) {
        PacketRange part = Among(sample->of, range);
        part.begin = std::max(part.begin, done);
        add(part);
        done = std::max(done, part.end);
      }
    }
  }
}

bool EvaluationRun::Score(std::span<const uint32_t> which, const CellSample* sample,
                          const parallel::Budget& part, NoteScores note) {
  const CellArrays& cells = sample != nullptr ? sample->cells : cells_;
  const Headings& headings = scorer_.headings();
  std::vector<double> by_bin(headings.bins());
  std::vector<double> by_heading(headings.size());
  bool all = true;
  size_t count = 0;
  for (size_t begin = 0; begin < which.size(); begin += count) {
    if (Spent(part)) return false;
    count = Affordable(cells, which.size() - begin, part);
    const std::span<const uint32_t> batch = which.subspan(begin, count);
    if (visibility_cache_.has_value()) {
      visibility_cache_->Prepare(batch, cells.size(), part, parallel_);
    }
    Divide(batch, sample);
    scores_.assign(parts_.size(), {});
    ScoreParts(batch, cells, part);
    for (size_t i = 0; i < parts_.size();) {
      const uint32_t k = parts_[i].view;
      ViewScore whole;
      whole.finished = true;
      std::fill(by_bin.begin(), by_bin.end(), 0);
      for (; i < parts_.size() && parts_[i].view == k; ++i) {
        whole.score += scores_[i].score;
        whole.rays += scores_[i].rays;
        whole.finished = whole.finished && scores_[i].finished;
        if (headings.all_around()) continue;
        for (size_t b = 0; b < by_bin.size(); ++b) by_bin[b] += bins_[i * by_bin.size() + b];
      }
      evaluation_.rays += whole.rays;
      all = all && whole.finished;
      if (!whole.finished) continue;
      if (headings.all_around()) {
        by_heading[0] = whole.score;
      } else {
        headings.Sum(by_bin, by_heading);
      }
      note(batch[k], by_heading);
    }
  }
  return all;
}

void EvaluationRun::ScoreParts(std::span<const uint32_t> batch, const CellArrays& cells,
                               const parallel::Budget& part) {
  const std::span<const PacketRange> ranges = ranges_;
  const Headings& headings = scorer_.headings();
  if (!headings.all_around()) bins_.assign(parts_.size() * headings.bins(), 0);
  parallel_.For(parts_.size(), [&](size_t i) {
    const Part& own = parts_[i];
    const Eigen::Vector3d view = views_.Centre(batch[own.view]);
    const std::span<const PacketRange> its = ranges.subspan(own.begin, own.end - own.begin);
    if (headings.all_around()) {
      scores_[i] = scorer_.ScorePackets(view, cells, its, part, seen_);
    } else {
      scores_[i] =
          scorer_.ScoreBins(view, cells, its, part, seen_,
                            std::span(bins_).subspan(i * headings.bins(), headings.bins()));
    }
  });
}

bool EvaluationRun::ScoreExactly(std::span<const uint32_t> which, const parallel::Budget& part) {
  return Score(which, nullptr, part, [this](uint32_t i, std::span<const double> by_heading) {
    const BestHeading best = BestOf(by_heading);
    SetExact(i, best.score, best.heading);
  });
}

void EvaluationRun::SetExact(uint32_t i, double score, size_t heading) {
  evaluation_.exact += !evaluation_.views[i].exact;
  evaluation_.views[i] = {score, score, score, true, true, 0, heading};
}

Evaluation EvaluationRun::Finish() {
  evaluation_.seen.assign(seen_.begin(), seen_.end());
  return std::move(evaluation_);
}

}  // namespace vantage::planning

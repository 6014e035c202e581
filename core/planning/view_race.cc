#include "core/planning/view_race.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

namespace vantage {
namespace {

constexpr int kCoarsest = 6;                         // lattice level
constexpr uint64_t kLeastBatch = uint64_t{1} << 13;  // pairs of view and cell
constexpr uint64_t kMostBatch = uint64_t{1} << 21;
constexpr size_t kLeastViews = 4;

// Where the lattice lies depends on the seed: what it happens to hit is luck otherwise.
Eigen::Vector3i LatticeOrigin(uint64_t seed) {
  const auto draw = [seed](uint64_t axis) {
    return static_cast<int>(HashToUnit(seed, ~uint64_t{1}, axis) * (1 << kCoarsest));
  };
  return {draw(0), draw(1), draw(2)};
}

// `cell`: from the lattice's origin.
int LatticeLevel(const Eigen::Vector3i& cell) {
  return std::min(std::countr_zero(static_cast<uint32_t>(cell.x() | cell.y() | cell.z())),
                  kCoarsest);
}

}  // namespace

std::vector<uint32_t> CoarseFirst(std::span<const Eigen::Vector3i> cells, uint64_t seed) {
  std::array<std::vector<std::pair<double, uint32_t>>, kCoarsest + 1> levels;
  const Eigen::Vector3i origin = LatticeOrigin(seed);
  for (uint32_t i = 0; i < cells.size(); ++i) {
    levels[static_cast<size_t>(kCoarsest - LatticeLevel(cells[i] - origin))].emplace_back(
        HashToUnit(seed, ~uint64_t{0}, i), i);
  }
  std::vector<uint32_t> order;
  order.reserve(cells.size());
  for (auto& level : levels) {
    std::sort(level.begin(), level.end());
    for (const auto& [key, i] : level) order.push_back(i);
  }
  return order;
}

ViewRace::ViewRace(EvaluationRun& run, const CellSampler& sampler, const RaceOptions& options,
                   double confidence, uint64_t seed)
    : run_(run),
      sampler_(sampler),
      options_(options),
      seed_(seed),
      origin_(LatticeOrigin(seed)),
      rung_of_(run.size(), kOutside),
      drawn_gain_(run.size(), 0),
      lattice_(CoarseFirst(run.views().cells(), seed)) {
  // A sample of a third of the cells costs nearly what they all do.
  size_t total = 0;
  for (size_t draws = options.first_draws; draws * 3 <= run.cells().size();
       draws *= options.growth) {
    Rung& rung = rungs_.emplace_back();
    rung.draws = draws - total;
    rung.total = total = draws;
  }
  rungs_.emplace_back().draws = run.cells().size();
  const auto bounds = 2.0 * static_cast<double>(rungs_.size() * std::max<size_t>(1, run.size()));
  log_inverse_error_ = std::log(bounds / (1 - confidence));
}

void ViewRace::Run(const Budget& part) {
  while (!run_.Spent(part) && Step(part)) {
  }
}

bool ViewRace::Widen() {
  if (options_.promotion / 2 < options_.widest) return false;
  options_.promotion /= 2;
  return true;
}

void ViewRace::Tighten(size_t rung, const Budget& part) {
  double best = 0;
  for (uint32_t i = 0; i < run_.size(); ++i) best = std::max(best, run_.view(i).lower);
  std::vector<uint32_t> contenders;
  std::erase_if(rungs_[rung - 1].waiting, [&](uint32_t i) {
    const bool contends = !run_.view(i).exact && run_.view(i).upper > best;
    if (contends) contenders.push_back(i);
    return contends;
  });
  std::sort(contenders.begin(), contenders.end(), [this](uint32_t a, uint32_t b) {
    const double x = run_.view(a).upper;
    const double y = run_.view(b).upper;
    return x != y ? x > y : a < b;
  });
  size_t count = 0;
  for (size_t begin = 0; begin < contenders.size(); begin += count) {
    count = std::min(BatchOn(rung), contenders.size() - begin);
    if (!ScoreOn(rung, {contenders.data() + begin, count}, part)) return;
  }
}

bool ViewRace::Step(const Budget& part) {
  // The highest first: who is far ahead is decided on before others enter.
  for (size_t rung = rungs_.size() - 1; rung > 0; --rung) {
    const size_t due = rungs_[rung - 1].reached / options_.promotion;
    if (rungs_[rung].reached < due) return GoUp(rung, due - rungs_[rung].reached, part);
  }
  return Enter(part);
}

size_t ViewRace::BatchOn(size_t rung) const {
  const uint64_t pairs = std::clamp(pairs_ / 8, kLeastBatch, kMostBatch);
  return std::max<size_t>(kLeastViews, pairs / std::max<size_t>(1, rungs_[rung].draws));
}

bool ViewRace::GoUp(size_t rung, size_t count, const Budget& part) {
  std::vector<uint32_t>& waiting = rungs_[rung - 1].waiting;
  count = std::min({count, BatchOn(rung), waiting.size()});
  const auto middle = waiting.begin() + static_cast<ptrdiff_t>(count);
  const auto better = [this](uint32_t a, uint32_t b) {
    const double x = run_.view(a).score;
    const double y = run_.view(b).score;
    return x != y ? x > y : a < b;
  };
  std::nth_element(waiting.begin(), middle, waiting.end(), better);
  std::vector<uint32_t> best(waiting.begin(), middle);
  waiting.erase(waiting.begin(), middle);
  std::sort(best.begin(), best.end());
  // Those decided on in the meantime go up without a sample.
  const auto known = [this](uint32_t i) { return run_.view(i).exact; };
  for (const uint32_t i : best) {
    if (known(i)) Arrive(i, rung);
  }
  std::erase_if(best, known);
  return ScoreOn(rung, best, part);
}

bool ViewRace::Enter(const Budget& part) {
  const size_t count = BatchOn(0);
  std::vector<uint32_t> entering;
  while (entering.size() < count / 2 && !proposers_.empty()) {
    const Proposer of = proposers_.top();
    proposers_.pop();
    const double rank = run_.view(of.view).Rank();
    if (rank < of.rank) {  // it looked better when it was listed
      proposers_.push({rank, of.view, of.step});
    } else {
      ListNeighbours(of.view, of.step, entering);
      if (of.step > 1) proposers_.push({rank, of.view, of.step / 2});
    }
  }
  for (; entering.size() < count && next_ < lattice_.size(); ++next_) {
    const uint32_t i = lattice_[next_];
    if (rung_of_[i] != kOutside) continue;
    rung_of_[i] = 0;
    entering.push_back(i);
  }
  return !entering.empty() && ScoreOn(0, entering, part);
}

void ViewRace::ListNeighbours(uint32_t of, int step, std::vector<uint32_t>& entering) {
  const Eigen::Vector3i cell = run_.views().cells()[of];
  for (int k = 0; k < 27; ++k) {
    const Eigen::Vector3i to = cell + step * Eigen::Vector3i(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
    const int i = run_.views().IndexOf(to);
    if (i < 0 || rung_of_[static_cast<size_t>(i)] != kOutside) continue;
    rung_of_[static_cast<size_t>(i)] = 0;
    entering.push_back(static_cast<uint32_t>(i));
  }
}

const CellArrays& ViewRace::CellsOf(size_t rung) {
  if (IsLast(rung)) return run_.cells();
  Rung& own = rungs_[rung];
  if (own.bounds.empty()) {
    own.sample = sampler_.Draw(own.draws, seed_, rung);
    own.bounds.emplace_back(own.total, log_inverse_error_);
  }
  return own.sample;
}

bool ViewRace::ScoreOn(size_t rung, std::span<const uint32_t> which, const Budget& part) {
  const bool all = run_.Score(which, CellsOf(rung), part,
                              [&](uint32_t view, double gain) { Note(view, rung, gain); });
  pairs_ += which.size() * rungs_[rung].draws;
  return all;
}

void ViewRace::Arrive(uint32_t i, size_t rung) {
  rung_of_[i] = static_cast<uint8_t>(rung);
  ++rungs_[rung].reached;
  if (!IsLast(rung)) rungs_[rung].waiting.push_back(i);
}

void ViewRace::Note(uint32_t i, size_t rung, double gain) {
  Rung& own = rungs_[rung];
  Arrive(i, rung);
  if (IsLast(rung)) {
    run_.SetExact(i, gain);
  } else {
    // Draws of all rungs so far: independent, none chosen by what others found.
    drawn_gain_[i] += static_cast<float>(gain);
    const auto draws = static_cast<double>(own.total);
    const double average = std::clamp(static_cast<double>(drawn_gain_[i]) / draws, 0.0, 1.0);
    const double potential = sampler_.potential();
    MeanBounds& bounds = own.bounds.front();
    ViewEstimate& view = run_.view(i);
    view.scored = true;
    view.upper = std::min(view.upper, std::min(1.0, bounds.Upper(average) + kRounding) * potential);
    view.lower = std::max(view.lower, std::max(0.0, bounds.Lower(average) - kRounding) * potential);
    view.lower = std::min(view.lower, view.upper);
    view.score = std::clamp(average * potential, view.lower, view.upper);
    // As if there were a draw more of either kind: no gain seen does not mean none.
    const double mean = (average * draws + 1) / (draws + 2);
    view.error = potential * std::sqrt(mean * (1 - mean) / draws);
  }
  if (rung == 0) {
    const int step = std::max(1, (1 << LatticeLevel(run_.views().cells()[i] - origin_)) / 2);
    proposers_.push({run_.view(i).Rank(), i, step});
  }
}

}  // namespace vantage

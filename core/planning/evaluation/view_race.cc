#include "core/planning/evaluation/view_race.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace vantage::planning {
namespace {

constexpr uint64_t kLeastBatch = uint64_t{1} << 13;  // pairs of view and cell
constexpr uint64_t kMostBatch = uint64_t{1} << 21;
constexpr size_t kLeastViews = 4;
constexpr int kRegionBits = 2;      // regions are 4 viewcells wide
constexpr double kQuickLook = 1e5;  // pairs: some milliseconds of one core
// Pairs: two thousand views on the smallest sample, the best of them on larger ones.
constexpr uint64_t kFirstLook = uint64_t{1} << 19;
constexpr size_t kTurns = 3;         // one of these is that of the best view of all
constexpr size_t kMostGenerous = 2;  // one in this many goes up from the first rung at the end

Eigen::Vector3i RegionCell(const Eigen::Vector3i& viewcell) {
  return {viewcell.x() >> kRegionBits, viewcell.y() >> kRegionBits, viewcell.z() >> kRegionBits};
}

}  // namespace

ViewRace::ViewRace(EvaluationRun& run, const CellSampler& sampler, const RaceOptions& options,
                   double confidence, uint64_t seed)
    : run_(run),
      sampler_(sampler),
      options_(options),
      seed_(seed),
      rung_of_(run.size(), kOutside),
      drawn_score_(run.size(), 0),
      proposes_(run.size(), kAllProposed),
      lattice_(run.views().cells(), seed) {
  Eigen::Vector3i last = Eigen::Vector3i::Constant(std::numeric_limits<int>::min());
  first_region_.setConstant(std::numeric_limits<int>::max());
  for (const Eigen::Vector3i& cell : run.views().cells()) {
    const Eigen::Vector3i region = RegionCell(cell);
    first_region_ = first_region_.cwiseMin(region);
    last = last.cwiseMax(region);
  }
  if (run.size() > 0) regions_ = last - first_region_ + Eigen::Vector3i::Ones();
  // A sample of more than a third of the cells costs nearly as much as all cells.
  size_t total = 0;
  for (size_t draws = options.first_draws; draws * 3 <= run.cells().size();
       draws *= options.growth) {
    Rung& rung = rungs_.emplace_back();
    rung.draws = draws - total;
    rung.total = total = draws;
  }
  rungs_.emplace_back().draws = run.cells().size();
  for (Rung& rung : rungs_) rung.revisions.resize(static_cast<size_t>(regions_.prod()));
  // Each heading of a view has its own bounds, so that those of the best one, which may have been
  // lucky with the sample, hold as well.
  const auto bounds = 2.0 * static_cast<double>(rungs_.size() * std::max<size_t>(1, run.size()) *
                                                run.scorer().headings().size());
  log_inverse_error_ = std::log(bounds / (1 - confidence));
}

void ViewRace::Run(const parallel::Budget& part) {
  while (!run_.Spent(part) && Step(part)) {
  }
}

void ViewRace::Look(const parallel::Budget& part) {
  while (pairs_ < kFirstLook && !run_.Spent(part) && Step(part)) {
  }
}

bool ViewRace::Widen() {
  if (options_.promotion / 2 < options_.widest) return false;
  options_.promotion /= 2;
  return true;
}

void ViewRace::Tighten(size_t rung, const parallel::Budget& part) {
  double best = 0;
  for (uint32_t i = 0; i < run_.size(); ++i) {
    best = std::max(best, run_.Worth(i) * run_.view(i).lower);
  }
  std::vector<uint32_t> contenders;
  std::erase_if(rungs_[rung - 1].waiting, [&](uint32_t i) {
    const bool contends = !run_.view(i).exact && run_.Worth(i) * run_.view(i).upper > best;
    if (contends) contenders.push_back(i);
    return contends;
  });
  std::sort(contenders.begin(), contenders.end(), [this](uint32_t a, uint32_t b) {
    const double x = run_.Worth(a) * run_.view(a).upper;
    const double y = run_.Worth(b) * run_.view(b).upper;
    return x != y ? x > y : a < b;
  });
  size_t count = 0;
  for (size_t begin = 0; begin < contenders.size(); begin += count) {
    count = std::min(BatchOn(rung), contenders.size() - begin);
    if (!ScoreOn(rung, {contenders.data() + begin, count}, part)) return;
  }
}

bool ViewRace::Step(const parallel::Budget& part) {
  // The highest rung comes first, so that views far ahead are settled before others enter.
  for (size_t rung = rungs_.size() - 1; rung > 0; --rung) {
    const size_t due = rungs_[rung - 1].reached / Promotion(rung);
    if (rungs_[rung].reached < due) return GoUp(rung, due - rungs_[rung].reached, part);
  }
  return Enter(part);
}

size_t ViewRace::BatchOn(size_t rung) const {
  const uint64_t pairs = std::clamp(pairs_ / 8, kLeastBatch, kMostBatch);
  return std::max<size_t>(kLeastViews, pairs / std::max<size_t>(1, rungs_[rung].draws));
}

size_t ViewRace::Promotion(size_t rung) const {
  // A quick look costs more on a rung of larger samples.
  const auto growth = static_cast<double>(options_.growth);
  const double look = kQuickLook * std::pow(growth, static_cast<double>(rung - 1));
  const double looks = static_cast<double>(pairs_) / look;
  if (looks <= 1) return options_.promotion;
  const size_t most_generous = rung == 1 ? kMostGenerous : options_.growth;
  return std::max(std::min(most_generous, options_.promotion),
                  static_cast<size_t>(static_cast<double>(options_.promotion) / looks));
}

uint32_t ViewRace::RegionOf(uint32_t view) const {
  const Eigen::Vector3i at = RegionCell(run_.views().cells()[view]) - first_region_;
  return static_cast<uint32_t>(at.x() + regions_.x() * (at.y() + regions_.y() * at.z()));
}

double ViewRace::RevisedScore(uint32_t view, size_t rung) const {
  const Revision& revision = rungs_[rung].revisions[RegionOf(view)];
  // One more view without a change is counted, since a single view tells little of its neighbours.
  return run_.view(view).score + static_cast<double>(revision.sum / (revision.views + 1));
}

bool ViewRace::GoUp(size_t rung, size_t count, const parallel::Budget& part) {
  std::vector<uint32_t>& waiting = rungs_[rung - 1].waiting;
  count = std::min({count, BatchOn(rung), waiting.size()});
  std::vector<std::pair<double, uint32_t>> order;
  order.reserve(waiting.size());
  for (const uint32_t i : waiting) {
    order.emplace_back(-run_.Worth(i) * RevisedScore(i, rung - 1), i);
  }
  std::nth_element(order.begin(), order.begin() + static_cast<ptrdiff_t>(count), order.end());
  std::vector<uint32_t> best;
  waiting.clear();
  for (size_t k = 0; k < order.size(); ++k) {
    (k < count ? best : waiting).push_back(order[k].second);
  }
  std::sort(best.begin(), best.end());
  ArriveExact(best, rung);
  return ScoreOn(rung, best, part);
}

std::optional<size_t> ViewRace::NextToPropose() {
  std::optional<size_t> next;
  if (++turns_ % kTurns == 0) {  // the turn of the best view of all
    for (size_t k = 0; k < proposers_.size(); ++k) {
      if (proposers_[k].empty()) continue;
      if (!next.has_value() || proposers_[*next].top() < proposers_[k].top()) next = k;
    }
    return next;
  }
  for (size_t k = 0; k < proposers_.size() && !next.has_value(); ++k) {
    level_ = (level_ + 1) % proposers_.size();
    if (!proposers_[level_].empty()) next = level_;
  }
  return next;
}

bool ViewRace::Enter(const parallel::Budget& part) {
  const size_t count = BatchOn(0);
  std::vector<uint32_t> entering;
  while (entering.size() < count / 2) {
    const std::optional<size_t> level = NextToPropose();
    if (!level.has_value()) break;
    const Proposer of = proposers_[*level].top();
    proposers_[*level].pop();
    if (proposes_[of.view] != *level) continue;  // listed twice: it has proposed these
    const double rank = run_.Rank(of.view);
    if (rank < of.rank) {  // its rank has fallen since it was listed
      proposers_[*level].push({rank, of.view});
    } else {
      ListNeighbours(of.view, 1 << *level, entering);
      proposes_[of.view] = kAllProposed;
      if (*level > 0) Propose(of.view, *level - 1);
    }
  }
  while (entering.size() < count) {
    const std::optional<uint32_t> i = lattice_.Next();
    if (!i.has_value()) break;
    if (rung_of_[*i] != kOutside) continue;
    rung_of_[*i] = 0;
    entering.push_back(*i);
  }
  if (entering.empty()) return false;
  for (const uint32_t i : ArriveExact(entering, 0)) ProposeFirst(i);
  return ScoreOn(0, entering, part);
}

void ViewRace::Propose(uint32_t view, size_t level) {
  proposes_[view] = static_cast<uint8_t>(level);
  proposers_[level].push({run_.Rank(view), view});
}

void ViewRace::ProposeFirst(uint32_t view) {
  const int level = lattice_.Level(run_.views().cells()[view]);
  Propose(view, static_cast<size_t>(std::max(0, level - 1)));
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

const CellSample* ViewRace::SampleOf(size_t rung) {
  if (IsLast(rung)) return nullptr;
  Rung& own = rungs_[rung];
  if (own.bounds.empty()) {
    own.sample = sampler_.Draw(own.draws, seed_, rung);
    own.bounds.emplace_back(DrawsOf(own), log_inverse_error_);
  }
  return &own.sample;
}

bool ViewRace::ScoreOn(size_t rung, std::span<const uint32_t> which, const parallel::Budget& part) {
  // Drawing a sample of millions takes long, so none is drawn that nobody will be scored on.
  const bool all = which.empty() || (!run_.Spent(part) &&
                                     run_.Score(which, SampleOf(rung), part,
                                                [&](uint32_t view, std::span<const double> scores) {
                                                  Note(view, rung, scores);
                                                }));
  pairs_ += which.size() * rungs_[rung].draws;
  return all;
}

std::vector<uint32_t> ViewRace::ArriveExact(std::vector<uint32_t>& views, size_t rung) {
  std::vector<uint32_t> exact;
  std::erase_if(views, [&](uint32_t i) {
    if (!run_.view(i).exact) return false;
    exact.push_back(i);
    return true;
  });
  for (const uint32_t i : exact) Arrive(i, rung);
  return exact;
}

void ViewRace::Arrive(uint32_t i, size_t rung) {
  rung_of_[i] = static_cast<uint8_t>(rung);
  ++rungs_[rung].reached;
  if (!IsLast(rung)) rungs_[rung].waiting.push_back(i);
}

size_t ViewRace::DrawsOf(const Rung& rung) const {
  return run_.scorer().headings().all_around() ? rung.total : rung.draws;
}

void ViewRace::Note(uint32_t i, size_t rung, std::span<const double> by_heading) {
  Rung& own = rungs_[rung];
  const double before = run_.view(i).score;
  const BestHeading best = BestOf(by_heading);
  Arrive(i, rung);
  if (IsLast(rung)) {
    run_.SetExact(i, best.score, best.heading);
  } else {
    // Draws of all rungs so far count. They are independent, since none was chosen by the result of
    // another. Of a scanner that sees a sector only those of this rung do, three quarters of them:
    // to add them up, each heading of each view would have to be kept.
    const bool all_around = by_heading.size() == 1;
    drawn_score_[i] = static_cast<float>(best.score) + (all_around ? drawn_score_[i] : 0);
    const auto draws = static_cast<double>(DrawsOf(own));
    const double average = std::clamp(static_cast<double>(drawn_score_[i]) / draws, 0.0, 1.0);
    const double potential = sampler_.potential();
    MeanBounds& bounds = own.bounds.front();
    ViewEstimate& view = run_.view(i);
    view.scored = true;
    view.heading = best.heading;
    view.upper = std::min(view.upper, std::min(1.0, bounds.Upper(average) + kRounding) * potential);
    view.lower = std::max(view.lower, std::max(0.0, bounds.Lower(average) - kRounding) * potential);
    view.lower = std::min(view.lower, view.upper);
    view.score = std::clamp(average * potential, view.lower, view.upper);
    // One more draw of either kind is counted, since a view that gained nothing on a sample may
    // still gain something.
    const double mean = (average * draws + 1) / (draws + 2);
    view.error = potential * std::sqrt(mean * (1 - mean) / draws);
  }
  if (rung == 0) {
    ProposeFirst(i);
  } else {
    // A larger sample has a smaller error, so the view may rank better now than when it was listed.
    if (proposes_[i] != kAllProposed) Propose(i, proposes_[i]);
    Revision& revision = rungs_[rung - 1].revisions[RegionOf(i)];
    revision.sum += static_cast<float>(run_.view(i).score - before);
    revision.views += 1;
  }
}

}  // namespace vantage::planning

#include "client/study/best_cover.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/library/error.h"
#include "client/study/cover_program.h"
#include "core/cover/choose_stations.h"
#include "core/simulation/random_sequence.h"

namespace vantage::study {
namespace {

using Clock = std::chrono::steady_clock;

constexpr size_t kFirstSample = 1000;
constexpr double kShareOfSearch = 0.25;  // of the time, at most kMostSearch
constexpr double kMostSearch = 10;       // s
constexpr double kShareOfPolish = 0.2;   // of what is left, after each solution of the solver
constexpr uint64_t kOrderStream = 310;

size_t CoveredBy(const VisibilityTable& table, const std::vector<size_t>& route) {
  simulation::SampleSet all((table.samples + 63) / 64, 0);
  for (const size_t i : route) AddTo(all, table.sees[i]);
  return CountOf(all);
}

std::vector<std::vector<uint32_t>> LinksOf(const VisibilityTable& table, double overlap) {
  const size_t count = table.candidates.size();
  std::vector<size_t> sizes;
  for (const simulation::SampleSet& set : table.sees) sizes.push_back(CountOf(set));
  std::vector<std::vector<uint32_t>> links(count);
  for (uint32_t i = 0; i < count; ++i) {
    for (uint32_t j = i + 1; j < count; ++j) {
      const size_t shared = sizes[i] - CountWithout(table.sees[i], table.sees[j]);
      if (static_cast<double>(shared) < overlap * static_cast<double>(std::max(sizes[i], sizes[j])))
        continue;
      links[i].push_back(j);
      links[j].push_back(i);
    }
  }
  for (std::vector<uint32_t>& of_one : links) std::sort(of_one.begin(), of_one.end());
  return links;
}

// One search for one table, within one span of time.
class Search {
 public:
  Search(const VisibilityTable& table, const CoverSettings& settings)
      : table_(table), settings_(settings), problem_(ProblemOf(table, settings)) {
    order_.resize(table.samples);
    std::iota(order_.begin(), order_.end(), 0);
    for (size_t k = order_.size(); k > 1; --k) {
      std::swap(order_[k - 1], order_[simulation::RandomBits(1, k, kOrderStream) % k]);
    }
    all_ = table.samples;
    goal_ = static_cast<size_t>(std::ceil(settings.goal * static_cast<double>(all_) - 1e-9));
    from_start_ = table.start ? CountOf(table.sees[*table.start]) : 0;
  }

  absl::StatusOr<BestCoverResult> Run() {
    if (goal_ <= from_start_) {
      Take({});
      best_.greedy = best_.least = best_.route.size();
      best_.proven = true;
      best_.how = "the start covers the goal";
      return std::move(best_);
    }
    if (absl::Status searched = SearchFirst(); !searched.ok()) return searched;
    if (!best_.proven && !FindCoverSolver().empty()) {
      if (absl::Status solved = SolveOnSamples(); !solved.ok()) return solved;
    }
    best_.how = absl::StrCat(
        "by ", how_, "; ",
        best_.proven
            ? "no choice has fewer"
            : absl::StrFormat("at least %d are needed, for all that is proven", best_.least));
    return std::move(best_);
  }

 private:
  double Left() const {
    return settings_.seconds - std::chrono::duration<double>(Clock::now() - begun_).count();
  }
  size_t of_start() const { return table_.start ? 1 : 0; }

  // Stations besides the start, of the problem.
  void Take(const std::vector<uint32_t>& stations) {
    best_.route.clear();
    if (table_.start) best_.route.push_back(*table_.start);
    best_.route.insert(best_.route.end(), stations.begin(), stations.end());
    best_.covered = static_cast<double>(CoveredBy(table_, best_.route)) / static_cast<double>(all_);
    best_.proven = best_.route.size() <= best_.least;
  }

  absl::StatusOr<cover::FewestStations> Choose(const parallel::Budget& budget,
                                               const std::vector<uint32_t>& known) const {
    return cover::ChooseFewest(problem_, static_cast<double>(goal_ - from_start_), budget, known);
  }

  absl::Status SearchFirst() {
    parallel::Budget at_once;
    at_once.work_limit = 0;
    const auto greedy = Choose(at_once, {});
    if (!greedy.ok()) return greedy.status();
    best_.greedy = greedy->cover.stations.size() + of_start();
    const auto found = Choose(
        parallel::Budget::Seconds(std::min(kMostSearch, kShareOfSearch * settings_.seconds)), {});
    if (!found.ok()) return found.status();
    if (!found->complete) {
      return client::WithFix(
          absl::FailedPreconditionError(absl::StrFormat(
              "all candidates that hang together cover %.1f %% of the samples, and %.1f %% are "
              "asked for",
              100 * (found->cover.weight + static_cast<double>(from_start_)) /
                  static_cast<double>(all_),
              100 * settings_.goal)),
          "lower --goal or --overlap, or take a finer --lattice");
    }
    best_.least = found->least + of_start();
    Take(found->cover.stations);
    how_ = "local search over all samples";
    return absl::OkStatus();
  }

  // The program on the first `count` samples of the order.
  CoverProblem Sampled(size_t count) const {
    CoverProblem sampled;
    sampled.start = table_.start;
    for (const simulation::SampleSet& set : table_.sees) {
      simulation::SampleSet few((count + 63) / 64, 0);
      for (size_t k = 0; k < count; ++k) {
        few[k / 64] |= (set[order_[k] / 64] >> (order_[k] % 64) & 1) << (k % 64);
      }
      sampled.sets.push_back(std::move(few));
    }
    sampled.neighbours.resize(table_.candidates.size());
    for (size_t i = 0; i < problem_.links.size(); ++i) {
      sampled.neighbours[i].assign(problem_.links[i].begin(), problem_.links[i].end());
    }
    sampled.goal =
        static_cast<size_t>(std::ceil(settings_.goal * static_cast<double>(count) - 1e-9));
    return sampled;
  }

  absl::Status SolveOnSamples() {
    std::string proven_on;
    for (size_t count = std::min(kFirstSample, table_.samples); Left() > 1; count *= 2) {
      count = std::min(count, table_.samples);
      const auto answer = SolveCover(Sampled(count), (1 - kShareOfPolish) * Left(), best_.route);
      // A sample that none covers, or that the time does not suffice for, proves nothing.
      if (absl::IsDeadlineExceeded(answer.status()) ||
          absl::IsFailedPrecondition(answer.status())) {
        break;
      }
      if (!answer.ok()) return answer.status();
      const bool enough = CoveredBy(table_, answer->route) >= goal_;
      std::vector<uint32_t> known;
      for (const size_t i : answer->route) {
        if (i != table_.start) known.push_back(static_cast<uint32_t>(i));
      }
      const auto polished =
          Choose(parallel::Budget::Seconds(enough ? 0 : kShareOfPolish * Left()), known);
      if (!polished.ok()) return polished.status();
      if (polished->cover.stations.size() + of_start() < best_.route.size()) {
        Take(polished->cover.stations);
        how_ = absl::StrFormat("an integer programme on %d samples%s", count,
                               enough ? "" : ", completed and polished on the others");
      }
      if (answer->proven && count == table_.samples) {
        best_.least = std::max(best_.least, answer->route.size());
        best_.proven = true;
        return absl::OkStatus();
      }
      if (answer->proven) {
        proven_on = absl::StrFormat("; on %d of %d samples none has fewer than %d", count,
                                    table_.samples, answer->route.size());
      }
      // A sample's optimum is no proof for all; while it comes in time, a larger sample is tried.
      if (enough && !answer->proven) break;
    }
    absl::StrAppend(&how_, proven_on);
    return absl::OkStatus();
  }

  const VisibilityTable& table_;
  const CoverSettings& settings_;
  const Clock::time_point begun_ = Clock::now();
  const cover::CoverProblem problem_;
  std::vector<size_t> order_;  // of samples, at random, so that a sample is the first of them
  size_t all_ = 0;
  size_t goal_ = 0;
  size_t from_start_ = 0;
  BestCoverResult best_;
  std::string how_;
};

}  // namespace

cover::CoverProblem ProblemOf(const VisibilityTable& table, const CoverSettings& settings) {
  cover::CoverProblem problem;
  problem.covers = table.sees;
  problem.weights.assign(table.samples, 1.0);
  problem.links = LinksOf(table, settings.overlap);
  if (table.start) {
    problem.anchored = problem.links[*table.start];
    const simulation::SampleSet seen = table.sees[*table.start];
    for (simulation::SampleSet& set : problem.covers) {
      for (size_t word = 0; word < set.size(); ++word) set[word] &= ~seen[word];
    }
    // A start that nothing is linked with is no free choice: it anchors itself, and adds nothing.
    if (problem.anchored.empty()) {
      problem.anchored.push_back(static_cast<uint32_t>(*table.start));
    }
  }
  return problem;
}

absl::StatusOr<BestCoverResult> BestCover(const VisibilityTable& table,
                                          const CoverSettings& settings) {
  return Search(table, settings).Run();
}

absl::StatusOr<StationScore> ScoreStations(const VisibilityTable& table,
                                           const CoverSettings& settings,
                                           const std::vector<Eigen::Vector3d>& stations,
                                           double tolerance) {
  StationScore score;
  score.stations = stations.size();
  std::vector<size_t> route;
  const auto all = static_cast<double>(table.samples);
  for (size_t k = 0; k < stations.size(); ++k) {
    size_t nearest = 0;
    for (size_t i = 1; i < table.candidates.size(); ++i) {
      if ((table.candidates[i] - stations[k]).squaredNorm() <
          (table.candidates[nearest] - stations[k]).squaredNorm()) {
        nearest = i;
      }
    }
    const double away = (table.candidates[nearest] - stations[k]).norm();
    if (away > tolerance) {
      return client::WithFix(
          absl::InvalidArgumentError(absl::StrFormat(
              "--stations: station %d at (%.2f, %.2f, %.2f) has no candidate within %.2f m; the "
              "nearest is %.2f m away",
              k + 1, stations[k].x(), stations[k].y(), stations[k].z(), tolerance, away)),
          "give places where a scanner can stand, in metres of the scene's frame, or a finer "
          "--lattice");
    }
    score.farthest = std::max(score.farthest, away);
    route.push_back(nearest);
    score.by_step.push_back(static_cast<double>(CoveredBy(table, route)) / all);
  }
  score.covered = score.by_step.empty() ? 0 : score.by_step.back();
  const std::vector<std::vector<uint32_t>> links = LinksOf(table, settings.overlap);
  std::vector<uint8_t> met(route.size(), 0);
  std::vector<size_t> reached;
  if (!route.empty()) {
    reached.push_back(0);
    met[0] = 1;
  }
  for (size_t head = 0; head < reached.size(); ++head) {
    const size_t from = route[reached[head]];
    for (size_t k = 0; k < route.size(); ++k) {
      const bool linked =
          route[k] == from || std::binary_search(links[from].begin(), links[from].end(), route[k]);
      if (met[k] != 0 || !linked) continue;
      met[k] = 1;
      reached.push_back(k);
    }
  }
  score.linked = reached.size();
  return score;
}

}  // namespace vantage::study

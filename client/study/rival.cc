#include "client/study/rival.h"

#include <algorithm>
#include <utility>

#include "absl/status/statusor.h"
#include "core/planning/plan/plan.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/planner.h"
#include "core/planning/scoring/scoring.h"
#include "core/simulation/random_sequence.h"

namespace vantage::study {
namespace {

constexpr uint64_t kRandomStream = 300;

class Random final : public Rival {
 public:
  Proposal Propose(const PlanningSituation& s) override {
    const size_t count = s.problem.feasible().cells().size();
    if (count == 0) return {std::nullopt, std::nullopt, "no place is feasible"};
    // A refused place is no longer feasible, so a repeated question gets another answer.
    const uint64_t draw =
        simulation::RandomBits(s.seed, static_cast<uint64_t>(s.number),
                               kRandomStream + s.problem.config().rejected.size());
    return {s.problem.feasible().Centre(draw % count), std::nullopt, ""};
  }
};

class Frontier final : public Rival {
 public:
  Proposal Propose(const PlanningSituation& s) override {
    constexpr double kLeastArea = 0.5;  // m^2 of frontier to be seen
    constexpr double kLeastStep = 1.0;  // m from every former station
    constexpr double kSpacing = 0.3;    // m between the places asked
    planning::PlanningConfig config = s.problem.config();
    config.weights = {0, 1, 1, 1};
    const auto frontier = planning::PlanningProblem::Prepare(
        {s.problem.model(), s.problem.scanner(), config, &s.problem}, s.parallel);
    if (!frontier.ok()) return {std::nullopt, std::nullopt, frontier.status().ToString()};
    const planning::Scoring& scoring = (*frontier)->scoring();

    std::vector<std::pair<double, size_t>> places;
    for (size_t i = 0; i < s.problem.feasible().cells().size(); ++i) {
      const planning::FeasibleViews::CellIndex& cell = s.problem.feasible().cells()[i];
      const int step =
          std::max(1, static_cast<int>(kSpacing / s.problem.feasible().cell_size() + 0.5));
      if (((cell.array() - (cell.array() / step) * step) != 0).any()) continue;
      const Eigen::Vector3d at = s.problem.feasible().Centre(i);
      const bool near = std::any_of(s.stations.begin(), s.stations.end(), [&](const auto& station) {
        return (station - at).template head<2>().norm() < kLeastStep;
      });
      if (near) continue;
      const double way = s.problem.feasible().reach().Travel(at).value_or(
          s.stations.empty() ? 0 : 2 * (s.stations.back() - at).norm());
      places.emplace_back(way, i);
    }
    std::sort(places.begin(), places.end());
    std::vector<float> gains(scoring.cells().size());
    for (const auto& [way, i] : places) {
      scoring.scorer().ScoreCells(s.problem.feasible().Centre(i), scoring.cells(),
                                  parallel::Budget::Unlimited(), gains);
      double area = 0;
      for (size_t k = 0; k < gains.size(); ++k) {
        if (gains[k] > 0) area += scoring.cells().factor[k];
      }
      if (area >= kLeastArea) return {s.problem.feasible().Centre(i), std::nullopt, ""};
    }
    return {std::nullopt, std::nullopt, "no frontier is visible from any place"};
  }
};

class FeasibleOracle final : public Rival {
 public:
  FeasibleOracle(const StudyScene& scene, planning::StationBasis basis)
      : scene_(scene), basis_(basis), truth_(scene.truth()) {}
  Proposal Propose(const PlanningSituation& s) override {
    constexpr int kStride = 3;  // of viewcells, per axis
    for (; seen_ < s.stations.size(); ++seen_) {
      truth_.AddScan(s.T_scene_world * s.stations[seen_], s.parallel);
    }
    planning::PlanningConfig config = s.problem.config();
    config.station_basis = basis_;
    const auto problem = planning::PlanningProblem::Prepare(
        {s.problem.model(), s.problem.scanner(), config, &s.problem}, s.parallel);
    if (!problem.ok()) return {std::nullopt, std::nullopt, problem.status().ToString()};
    const planning::FeasibleViews& feasible = (*problem)->feasible();
    std::vector<Eigen::Vector3d> places;
    for (size_t i = 0; i < feasible.cells().size(); ++i) {
      const planning::FeasibleViews::CellIndex& cell = feasible.cells()[i];
      if (!(cell.array() - (cell.array() / kStride) * kStride).isZero(0)) continue;
      const Eigen::Vector3d place = s.T_scene_world * feasible.Centre(i);
      // Whoever goes there sees whether there is room.
      const double clearance = s.problem.scanner().clearance;
      if (basis_ == planning::StationBasis::kExpected &&
          scene_.scanner().Clearance(place, clearance) < clearance) {
        continue;
      }
      places.push_back(place);
    }
    const std::vector<double> gains = truth_.GainAtDensity(places, s.parallel);
    const std::optional<size_t> best = BestThatRegisters(**problem, places, gains, s);
    if (!best.has_value()) {
      return {std::nullopt, std::nullopt, "no feasible place gains anything"};
    }
    return {s.T_scene_world.inverse() * places[*best], gains[*best], ""};
  }

 private:
  // Where none of those that gain something registers, the nearest to a station; nothing where none
  // gains.
  static std::optional<size_t> BestThatRegisters(const planning::PlanningProblem& problem,
                                                 const std::vector<Eigen::Vector3d>& places,
                                                 const std::vector<double>& gains,
                                                 const PlanningSituation& s) {
    std::vector<size_t> order;
    for (size_t i = 0; i < places.size(); ++i) {
      if (gains[i] > 0) order.push_back(i);
    }
    std::stable_sort(order.begin(), order.end(),
                     [&](size_t a, size_t b) { return gains[a] > gains[b]; });
    std::optional<size_t> nearest;
    double least = 0;
    for (const size_t i : order) {
      const Eigen::Vector3d at = s.T_scene_world.inverse() * places[i];
      const auto seen = problem.overlap().Predict(
          at, problem.scene(), problem.config().registration, parallel::Budget::Unlimited());
      if (seen.has_value() && seen->verdict.registered()) return i;
      for (const Eigen::Vector3d& station : s.stations) {
        const double distance = (station - at).norm();
        if (nearest.has_value() && distance >= least) continue;
        nearest = i;
        least = distance;
      }
    }
    return nearest;
  }

  const StudyScene& scene_;
  const planning::StationBasis basis_;
  simulation::GroundTruth truth_;
  size_t seen_ = 0;  // stations that the truth has heard of
};

class Route final : public Rival {
 public:
  explicit Route(std::vector<Eigen::Vector3d> route) : route_(std::move(route)) {}
  Proposal Propose(const PlanningSituation& s) override {
    if (next_ == route_.size()) return {std::nullopt, std::nullopt, "all places were scanned from"};
    return {s.T_scene_world.inverse() * route_[next_++], std::nullopt, ""};
  }

 private:
  std::vector<Eigen::Vector3d> route_;
  size_t next_ = 0;
};

class BruteForce final : public Rival {
 public:
  Proposal Propose(const PlanningSituation& s) override {
    const planning::Plan plan = planning::MakePlan(s.problem, parallel::Budget::Unlimited(),
                                                   s.parallel, [](const planning::Plan&) {});
    if (plan.views.empty()) return {std::nullopt, std::nullopt, plan.message};
    return {plan.views[0].position, plan.views[0].model_gain, ""};
  }
};

}  // namespace

void Rival::SeeScan(const sensor::RangeImage& /*image*/,
                    const Eigen::Isometry3d& /*T_world_scan*/) {}

std::unique_ptr<Rival> RandomRival() { return std::make_unique<Random>(); }
std::unique_ptr<Rival> FrontierRival() { return std::make_unique<Frontier>(); }
std::unique_ptr<Rival> RouteRival(std::vector<Eigen::Vector3d> route) {
  return std::make_unique<Route>(std::move(route));
}
std::unique_ptr<Rival> FeasibleOracleRival(const StudyScene& scene, planning::StationBasis basis) {
  return std::make_unique<FeasibleOracle>(scene, basis);
}
std::unique_ptr<Rival> BruteForceRival() { return std::make_unique<BruteForce>(); }

}  // namespace vantage::study

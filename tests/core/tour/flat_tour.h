// A furnished flat after some scans, and tours of what is left.
#ifndef VANTAGE_TESTS_CORE_TOUR_FLAT_TOUR_H_
#define VANTAGE_TESTS_CORE_TOUR_FLAT_TOUR_H_

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "core/planning/evaluate_view.h"
#include "core/planning/problem/planning_problem.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/simulated_scanner.h"
#include "core/tour/make_tour.h"

namespace vantage::tour {

class FlatTour {
 public:
  explicit FlatTour(uint64_t seed) : scene_(simulation::FurnishedFlat(seed)) {
    scanner_.azimuth_step = scanner_.elevation_step = sensor::Radians(0.4);
    config_.station_basis = planning::StationBasis::kExpected;
    config_.viewcell_size = 0.3;
    config_.required_density = 1000;
    model_ = model::PartialModel::Create({}).value();
    request_.scanners.resize(1);
    request_.scanners.front().model = scanner_;
    request_.most_candidates = 120;
    ScanFrom(scene_.starts[0]);
  }
  void ScanFrom(const Eigen::Vector3d& position) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(position);
    sensor::Scan scan;
    scan.scanner = scanner_;
    scan.image = tracer_.Scan(scanner_, pose, simulation::ScanFaults{}, 1 + scans_, pool_);
    ASSERT_TRUE(model_->Insert("scan" + std::to_string(scans_++), scan, pose, pool_).ok());
    view_ = model_->Publish();
    Prepare();
  }
  void Prepare() {
    problem_ = planning::PlanningProblem::Prepare({*view_, scanner_, config_}, pool_).value();
  }
  absl::StatusOr<Tour> Make(const parallel::Budget& budget, parallel::Parallel& parallel) {
    shown_.clear();
    return MakeTour(*problem_, request_, budget, parallel,
                    [&](const Tour& tour) { shown_.push_back(tour); });
  }
  // With a work limit, so that it is the same on any machine.
  Tour Make() {
    parallel::Budget budget;
    budget.work_limit = 30'000'000;
    auto tour = Make(budget, pool_);
    EXPECT_TRUE(tour.ok()) << tour.status();
    return tour.ok() ? *std::move(tour) : Tour{};
  }
  // What a plan says of a place, which knows nothing of tours.
  planning::ViewEvaluation Evaluate(const Eigen::Vector3d& position,
                                    std::optional<double> heading = std::nullopt) {
    return planning::EvaluateView(*problem_, position, heading).value();
  }
  // Tours are then for a scanner that sees `span` (rad); the scans so far stay.
  void UseSector(double span) {
    sensor::ScannerModel sector = scanner_;
    sector.azimuth_span = span;
    UseScanner(sector);
  }

  // Of another setting or preset; the scans so far stay.
  void UseScanner(const sensor::ScannerModel& scanner) {
    scanner_ = scanner;
    request_.scanners.front().model = scanner_;
    Prepare();
  }

  TourRequest& request() { return request_; }
  planning::PlanningConfig& config() { return config_; }
  const planning::PlanningProblem& problem() const { return *problem_; }
  const std::vector<Tour>& shown() const { return shown_; }
  parallel::ThreadPool& pool() { return pool_; }
  const sensor::ScannerModel& scanner() const { return scanner_; }

 private:
  const simulation::Scene scene_;
  const simulation::SimulatedScanner tracer_{scene_.mesh};
  sensor::ScannerModel scanner_;
  planning::PlanningConfig config_;
  parallel::ThreadPool pool_{2};
  std::unique_ptr<model::PartialModel> model_;
  std::shared_ptr<const model::PlanningView> view_;
  std::shared_ptr<const planning::PlanningProblem> problem_;
  TourRequest request_;
  std::vector<Tour> shown_;
  size_t scans_ = 0;
};

}  // namespace vantage::tour

#endif  // VANTAGE_TESTS_CORE_TOUR_FLAT_TOUR_H_

// A job in a furnished flat, one scan after the other.
#ifndef VANTAGE_TESTS_CORE_FLEET_FLAT_JOB_H_
#define VANTAGE_TESTS_CORE_FLEET_FLAT_JOB_H_

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/fleet/joint_plan.h"
#include "core/fleet/look_ahead.h"
#include "core/fleet/pending_stations.h"
#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "core/planning/evaluate_view.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::fleet {

class FlatJob {
 public:
  explicit FlatJob(uint64_t seed) : scene_(simulation::FurnishedFlat(seed)) {
    scanner_.azimuth_step = scanner_.elevation_step = sensor::Radians(0.4);
    config_.station_basis = planning::StationBasis::kExpected;
    config_.viewcell_size = 0.3;
    budget_.work_limit = 6'000'000;
    model_ = model::PartialModel::Create({}).value();
  }
  const std::vector<Eigen::Vector3d>& starts() const { return scene_.starts; }
  void ScanFrom(const Eigen::Vector3d& position) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(position);
    sensor::Scan scan;
    scan.scanner = scanner_;
    scan.image = tracer_.Scan(scanner_, pose, simulation::ScanFaults{}, 1 + scans_, pool_);
    ASSERT_TRUE(model_->Insert("scan" + std::to_string(scans_++), scan, pose, pool_).ok());
    view_ = model_->Publish();
  }
  planning::Plan LookingAhead(parallel::Parallel& parallel) const {
    const auto problem =
        planning::PlanningProblem::Prepare({*view_, scanner_, config_}, parallel).value();
    return MakePlanLookingAhead(*problem, budget_, parallel, [](const planning::Plan&) {});
  }
  void LookAheadIn(planning::Plan& plan) {
    const auto problem =
        planning::PlanningProblem::Prepare({*view_, scanner_, config_}, pool_).value();
    LookAhead(*problem, parallel::Budget::Unlimited(), pool_, plan);
  }
  planning::Plan ByScore(parallel::Parallel& parallel) const {
    return planning::MakePlan(*view_, scanner_, config_, budget_, parallel,
                              [](const planning::Plan&) {})
        .value();
  }
  // Of one scanner, where scans were made that have not come.
  JointPlan Beside(const std::vector<PledgedView>& pending) {
    FleetRequest request;
    request.scanners.resize(1);
    request.scanners.front().model = scanner_;
    request.pledged = pending;
    return MakeJointPlan(*view_, request, config_, budget_, pool_, [](const planning::Plan&) {})
        .value();
  }
  // The prediction of a scan from there.
  registration::RegistrationVerdict Verdict(const Eigen::Vector3d& position) {
    return planning::EvaluateView(*view_, scanner_, config_, position, pool_).value().view.verdict;
  }
  StationForecast Forecast(const Eigen::Vector3d& position) {
    return ForecastStation(*view_, scanner_, config_, position, {}, {}, pool_).value();
  }
  const sensor::ScannerModel& scanner() const { return scanner_; }
  parallel::ThreadPool& pool() { return pool_; }

 private:
  const simulation::Scene scene_;
  const simulation::SimulatedScanner tracer_{scene_.mesh};
  sensor::ScannerModel scanner_;
  planning::PlanningConfig config_;
  parallel::Budget budget_;
  parallel::ThreadPool pool_{2};
  std::unique_ptr<model::PartialModel> model_;
  std::shared_ptr<const model::PlanningView> view_;
  size_t scans_ = 0;
};

}  // namespace vantage::fleet

#endif  // VANTAGE_TESTS_CORE_FLEET_FLAT_JOB_H_

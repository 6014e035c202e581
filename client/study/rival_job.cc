#include "client/study/rival_job.h"

#include <chrono>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/simulated_job/placement.h"
#include "core/model/partial_model.h"
#include "core/planning/feasibility/feasible_views.h"
#include "core/registration/levelling.h"
#include "core/registration/registration.h"

namespace vantage::study {
namespace {

constexpr int kMostRefusals = 5;        // places in a row where nobody can stand
constexpr double kBlockedRadius = 0.3;  // m around such a place
constexpr double kLostRadius = 0.4;     // m around a place whose scan was lost

// Does what the server does in a job through the service.
class Workbench {
 public:
  static absl::StatusOr<Workbench> Create(const StudyScene& scene, parallel::Parallel& parallel) {
    auto model = model::PartialModel::Create({});
    if (!model.ok()) return model.status();
    return Workbench(scene, *std::move(model), parallel);
  }

  // Levels and merges the first scan. The map from world to scene is then known.
  absl::Status Begin(const simulated_job::Placement& placement, sensor::Scan& scan) {
    const auto levelling = registration::LevelFirstScan(scan);
    if (!levelling.ok()) return levelling.status();
    T_scene_world_ = placement.T_scene_scan * levelling->T_world_scan.inverse();
    return Merge(1, scan, levelling->T_world_scan);
  }

  // Aligns a scan and merges it if it registers: from the planned position, then from a measured
  // one.
  absl::Status Join(const simulated_job::Placement& placement, int number,
                    const simulated_job::PlacementErrors& errors, sensor::Scan& scan,
                    ScanMade& made) {
    for (const bool measured : {false, true}) {
      scan.prior =
          measured ? simulated_job::MeasuredPrior(placement, number, errors) : placement.prior;
      const auto result =
          registration::Register(*view_, scan, *scan.prior, config_.registration, parallel_);
      if (!result.ok()) return result.status();
      made.second_prior = measured;
      if (!result->verdict.registered()) {
        made.notes.push_back(result->verdict.reason);
        continue;
      }
      made.merged = true;
      made.off = (placement.T_world_scan.inverse() * result->T_world_scan).translation().norm();
      return Merge(number, scan, result->T_world_scan);
    }
    return absl::OkStatus();
  }

  void Refuse(const Eigen::Vector3d& place, double radius) {
    config_.rejected.push_back({place, radius});
  }

  Proposal Ask(Rival& rival, int number, uint64_t seed) const {
    const auto problem =
        planning::PlanningProblem::Prepare({*view_, scene_.settings().scanner, config_}, parallel_);
    if (!problem.ok()) return {std::nullopt, std::nullopt, problem.status().ToString()};
    return rival.Propose({**problem, stations_, number, seed, T_scene_world_, parallel_});
  }

  const Eigen::Isometry3d& T_scene_world() const { return T_scene_world_; }
  const Eigen::Isometry3d& last_pose() const { return last_pose_; }

 private:
  Workbench(const StudyScene& scene, std::unique_ptr<model::PartialModel> model,
            parallel::Parallel& parallel)
      : scene_(scene), parallel_(parallel), model_(std::move(model)) {
    config_.required_density = scene.settings().required_density;
  }

  absl::Status Merge(int number, const sensor::Scan& scan, const Eigen::Isometry3d& T_world_scan) {
    const auto merged = model_->Insert(absl::StrCat("scan", number), scan, T_world_scan, parallel_);
    if (!merged.ok()) return merged.status();
    view_ = model_->Publish();
    stations_.push_back(T_world_scan.translation());
    last_pose_ = T_world_scan;
    return absl::OkStatus();
  }

  const StudyScene& scene_;
  parallel::Parallel& parallel_;
  std::unique_ptr<model::PartialModel> model_;
  std::shared_ptr<const model::PlanningView> view_;
  planning::PlanningConfig config_;
  std::vector<Eigen::Vector3d> stations_;
  Eigen::Isometry3d T_scene_world_ = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d last_pose_ = Eigen::Isometry3d::Identity();
};

}  // namespace

absl::Status RunRivalJob(const StudyScene& scene, uint64_t seed, Rival& rival,
                         parallel::Parallel& parallel, JobDiary& diary) {
  const StudySettings& settings = scene.settings();
  const simulated_job::PlacementErrors errors = scene.ErrorsFor(seed);
  auto bench = Workbench::Create(scene, parallel);
  if (!bench.ok()) return bench.status();
  simulated_job::Placement placement = simulated_job::FirstPlacement(scene.StartFor(seed), errors);
  ScanMade made;
  made.position = scene.StartFor(seed);
  for (int number = 1;; ++number) {
    sensor::Scan scan;
    scan.scanner = settings.scanner;
    scan.image = scene.scanner().Scan(settings.scanner, placement.T_scene_scan, settings.faults,
                                      seed * 1000 + static_cast<uint64_t>(number), parallel,
                                      settings.preview);
    made.at = placement.T_scene_scan.translation();
    if (number == 1) {
      if (absl::Status begun = bench->Begin(placement, scan); !begun.ok()) return begun;
      made.merged = true;
    } else if (absl::Status joined = bench->Join(placement, number, errors, scan, made);
               !joined.ok()) {
      return joined;
    }
    if (made.merged) {
      rival.SeeScan(scan.image, bench->last_pose());
    } else {
      bench->Refuse(placement.planned, kLostRadius);
    }
    diary.Add(made);
    if (diary.Over()) {
      diary.record().set_ended("enough is covered, or as many scans made as allowed");
      return absl::OkStatus();
    }

    made = {};
    const auto begun = std::chrono::steady_clock::now();
    for (int refusals = 0;; ++refusals) {
      const Proposal proposal = bench->Ask(rival, number + 1, seed);
      if (!proposal.position || refusals > kMostRefusals) {
        diary.record().set_ended(proposal.position ? "nobody can stand where it wants to"
                                                   : proposal.why);
        return absl::OkStatus();
      }
      placement = simulated_job::PlacementAt(*proposal.position, number + 1, bench->T_scene_world(),
                                             errors);
      if (proposal.expected.has_value()) {
        placement = simulated_job::NearestFree(scene.scanner(), placement, *proposal.expected,
                                               number + 1, bench->T_scene_world(), errors);
      }
      made.position = bench->T_scene_world() * placement.planned;
      made.predicted = proposal.predicted;
      if (simulated_job::CanStand(scene.scanner(), placement)) break;
      made.notes.push_back(absl::StrFormat("nobody can stand at (%.2f, %.2f, %.2f)",
                                           made.position.x(), made.position.y(),
                                           made.position.z()));
      bench->Refuse(*proposal.position, kBlockedRadius);
    }
    made.plan_seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  }
}

}  // namespace vantage::study

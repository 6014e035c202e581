#include "client/study/rival_job.h"

#include <chrono>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/simulation/placement.h"
#include "core/model/partial_model.h"
#include "core/planning/feasible_views.h"
#include "core/registration/registration.h"

namespace vantage {
namespace {

constexpr int kMostRefusals = 5;        // places in a row where nobody can stand
constexpr double kBlockedRadius = 0.3;  // m around such a place
constexpr double kLostRadius = 0.4;     // m around a place whose scan was lost

// What the server does in a job through the service.
class Workbench {
 public:
  static absl::StatusOr<Workbench> Create(const StudyScene& scene, Parallel& parallel) {
    auto model = PartialModel::Create({});
    if (!model.ok()) return model.status();
    return Workbench(scene, *std::move(model), parallel);
  }

  // Levels and merges the first scan. The map from world to scene is then known.
  absl::Status Begin(const Placement& placement, Scan& scan) {
    const auto levelling = LevelFirstScan(scan);
    if (!levelling.ok()) return levelling.status();
    T_scene_world_ = placement.T_scene_scan * levelling->T_world_scan.inverse();
    return Merge(1, scan, levelling->T_world_scan);
  }

  // Aligns a scan and merges it if it registers: from the planned position, then from a measured
  // one.
  absl::Status Join(const Placement& placement, int number, const PlacementErrors& errors,
                    Scan& scan, ScanMade& made) {
    for (const bool measured : {false, true}) {
      scan.prior = measured ? MeasuredPrior(placement, number, errors) : placement.prior;
      const auto result = Register(*view_, scan, *scan.prior, config_.registration, parallel_);
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
    const OpaqueGrid grid(*view_);
    const FeasibleViews feasible = FeasibleViews::Find(*view_, grid, scene_.settings().scanner,
                                                       config_, Budget::Unlimited(), parallel_);
    return rival.Propose({*view_, grid, feasible, scene_.settings().scanner, config_, stands_,
                          number, seed, T_scene_world_, parallel_});
  }

  const Eigen::Isometry3d& T_scene_world() const { return T_scene_world_; }
  const Eigen::Isometry3d& last_pose() const { return last_pose_; }

 private:
  Workbench(const StudyScene& scene, std::unique_ptr<PartialModel> model, Parallel& parallel)
      : scene_(scene), parallel_(parallel), model_(std::move(model)) {
    config_.required_density = scene.settings().required_density;
  }

  absl::Status Merge(int number, const Scan& scan, const Eigen::Isometry3d& T_world_scan) {
    const auto merged = model_->Insert(absl::StrCat("scan", number), scan, T_world_scan, parallel_);
    if (!merged.ok()) return merged.status();
    view_ = model_->Publish();
    stands_.push_back(T_world_scan.translation());
    last_pose_ = T_world_scan;
    return absl::OkStatus();
  }

  const StudyScene& scene_;
  Parallel& parallel_;
  std::unique_ptr<PartialModel> model_;
  std::shared_ptr<const PlanningView> view_;
  PlanningConfig config_;
  std::vector<Eigen::Vector3d> stands_;
  Eigen::Isometry3d T_scene_world_ = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d last_pose_ = Eigen::Isometry3d::Identity();
};

}  // namespace

absl::Status RunRivalJob(const StudyScene& scene, uint64_t seed, Rival& rival, Parallel& parallel,
                         JobDiary& diary) {
  const StudySettings& settings = scene.settings();
  const PlacementErrors errors = scene.ErrorsFor(seed);
  auto bench = Workbench::Create(scene, parallel);
  if (!bench.ok()) return bench.status();
  Placement placement = FirstPlacement(scene.StartFor(seed), errors);
  ScanMade made;
  made.position = scene.StartFor(seed);
  for (int number = 1;; ++number) {
    Scan scan;
    scan.scanner = settings.scanner;
    scan.image = scene.scanner().Scan(settings.scanner, placement.T_scene_scan, settings.faults,
                                      seed * 1000 + static_cast<uint64_t>(number), parallel);
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
      placement = PlacementAt(*proposal.position, number + 1, bench->T_scene_world(), errors);
      made.position = bench->T_scene_world() * *proposal.position;
      made.predicted = proposal.predicted;
      if (CanStand(scene.scanner(), placement)) break;
      made.notes.push_back(absl::StrFormat("nobody can stand at (%.2f, %.2f, %.2f)",
                                           made.position.x(), made.position.y(),
                                           made.position.z()));
      bench->Refuse(*proposal.position, kBlockedRadius);
    }
    made.plan_seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  }
}

}  // namespace vantage

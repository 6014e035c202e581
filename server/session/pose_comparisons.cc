#include "server/session/pose_comparisons.h"

#include <memory>
#include <utility>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "server/contract/error.h"
#include "server/conversion/from_proto.h"
#include "server/conversion/pose_comparison_proto.h"
#include "server/conversion/to_proto.h"
#include "server/session/asked_evaluation.h"
#include "server/session/stored_scans.h"

namespace vantage::session {
namespace {

constexpr absl::Duration kRetryComparisonAfter = absl::Seconds(1);

// What a comparison is made of, at one moment.
struct Compared {
  v1::Scan scan;
  bool in_model = false;
  registration::RegistrationConfig config;
  ModelSnapshot model;
  std::vector<conversion::PoseOfScan> poses;
};

absl::StatusOr<Compared> ReadCompared(SessionContext& context, ModelMemory& model,
                                      const std::string& name) {
  Compared compared;
  bool known = false;
  v1::PlanningConfig config;
  double voxel_size = 0;
  context.journal().Read([&](const SessionState& state) {
    const auto it = state.scans.find(name);
    known = it != state.scans.end();
    if (!known) return;
    compared.scan = it->second.scan;
    compared.in_model = it->second.in_model;
    config = state.session.planning_config();
    voxel_size = state.session.model_config().voxel_size_m();
  });
  const v1::Scan& scan = compared.scan;
  if (!known) return contract::ResourceNotFound("vantage/Scan", name);
  if (scan.state() == v1::SCAN_STATE_WITHDRAWN || !scan.has_registration()) {
    return contract::ErrorWithReason(
        absl::StatusCode::kFailedPrecondition, "SCAN_STATE",
        absl::StrCat(name, " is ", v1::ScanState_Name(scan.state()),
                     "; only a scan that was aligned and not withdrawn has poses to compare"),
        {{"state", v1::ScanState_Name(scan.state())}});
  }
  contract::Violations violations;
  compared.config = conversion::ReadPlanningConfig(config, {}, context.origin(), voxel_size,
                                                   "planning_config", "", violations)
                        .registration;
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return valid;
  compared.poses = conversion::PosesOf(scan, context.origin());
  compared.model = model.Current();
  if (compared.model.view == nullptr) return model.WhyNone();
  model.Touch();
  // Of a prior in another frame there is nothing to compare, and its coordinates may be too large
  // for the model's.
  const model::PlanningView& view = *compared.model.view;
  const Eigen::AlignedBox3d box(view.bounds().min.cast<double>() * view.voxel_size(),
                                view.bounds().max.cast<double>() * view.voxel_size());
  std::erase_if(compared.poses, [&](const conversion::PoseOfScan& pose) {
    return pose.kind == v1::COMPARED_POSE_KIND_PRIOR &&
           box.exteriorDistance(pose.T_model_scan.translation()) >
               scan.scanner_model().max_range_m();
  });
  return compared;
}

}  // namespace

PoseComparisons::PoseComparisons(SessionContext& context, ModelMemory& model)
    : context_(context),
      journal_(context.journal()),
      dependencies_(context.dependencies()),
      model_(model) {}

void PoseComparisons::Compare(
    const v1::CompareScanPosesRequest& request,
    std::function<void(absl::StatusOr<v1::CompareScanPosesResponse>)> done) {
  absl::StatusOr<Compared> compared = ReadCompared(context_, model_, request.name());
  if (!compared.ok()) return done(compared.status());
  absl::StatusOr<MemoryAccount::Reservation> room =
      model_.Reserve(ModelMemory::EstimateAlignment(compared->scan));
  if (!room.ok()) return done(room.status());
  std::shared_ptr<Evaluation> evaluation = model_.BeginEvaluation();
  if (evaluation == nullptr) {
    return done(contract::Retryable(absl::StatusCode::kResourceExhausted, "TOO_MANY_EVALUATIONS",
                                    "too many scans and positions of this session are being "
                                    "evaluated",
                                    kRetryComparisonAfter));
  }
  registration::ComparisonSize size;
  if (request.max_sample_count() > 0) {
    size.samples = static_cast<size_t>(request.max_sample_count());
  }
  if (request.max_surface_count() > 0) {
    size.surface = static_cast<size_t>(request.max_surface_count());
  }
  // A job may be copied, which a reservation may not.
  const auto held = std::make_shared<MemoryAccount::Reservation>(*std::move(room));
  const auto compare =
      [this, held, size, in = *std::move(compared)](
          parallel::Parallel& parallel) -> absl::StatusOr<v1::CompareScanPosesResponse> {
    // Who is answered finds its memory given back.
    const absl::Cleanup given_back = [&held] { held->Release(); };
    const absl::Time started = absl::Now();
    std::vector<Eigen::Isometry3d> poses;
    poses.reserve(in.poses.size());
    for (const conversion::PoseOfScan& pose : in.poses) poses.push_back(pose.T_model_scan);
    const absl::StatusOr<sensor::Scan> data = LoadScan(context_, in.scan);
    if (!data.ok()) return data.status();
    const absl::StatusOr<registration::PoseComparison> comparison =
        dependencies_.algorithms.compare_poses(*in.model.view, *data, poses, in.config, size,
                                               parallel);
    if (!comparison.ok()) return comparison.status();
    v1::CompareScanPosesResponse response;
    v1::PoseComparison& to = *response.mutable_comparison();
    to = conversion::WritePoseComparison(*comparison, in.poses, context_.origin());
    to.set_model_version(in.model.version);
    to.set_in_model(in.in_model);
    *to.mutable_duration() =
        conversion::WriteDuration(absl::ToDoubleSeconds(absl::Now() - started));
    return response;
  };
  RunAsked<v1::CompareScanPosesResponse>(context_, std::move(evaluation), std::move(done), compare);
}

}  // namespace vantage::session

#include "server/session/to_proto.h"

#include <algorithm>

namespace vantage {
namespace {

v1::RegistrationOutcome WriteOutcome(RegistrationOutcome outcome) {
  switch (outcome) {
    case RegistrationOutcome::kRegistered:
      return v1::REGISTRATION_OUTCOME_REGISTERED;
    case RegistrationOutcome::kDoubtful:
      return v1::REGISTRATION_OUTCOME_DOUBTFUL;
    case RegistrationOutcome::kFailed:
      return v1::REGISTRATION_OUTCOME_FAILED;
  }
  return v1::REGISTRATION_OUTCOME_UNSPECIFIED;
}

v1::PlanOutcome WriteOutcome(PlanOutcome outcome) {
  switch (outcome) {
    case PlanOutcome::kViews:
      return v1::PLAN_OUTCOME_VIEWS;
    case PlanOutcome::kNoFeasibleView:
      return v1::PLAN_OUTCOME_NO_FEASIBLE_VIEW;
    case PlanOutcome::kNoRegistrableView:
      return v1::PLAN_OUTCOME_NO_REGISTRABLE_VIEW;
    case PlanOutcome::kNothingToGain:
      return v1::PLAN_OUTCOME_NOTHING_TO_GAIN;
    case PlanOutcome::kBudgetTooSmall:
      return v1::PLAN_OUTCOME_BUDGET_TOO_SMALL;
    case PlanOutcome::kCancelled:
      return v1::PLAN_OUTCOME_CANCELLED;
  }
  return v1::PLAN_OUTCOME_UNSPECIFIED;
}

v1::SurfaceKind WriteKind(SurfaceKind kind) {
  switch (kind) {
    case SurfaceKind::kTrue:
      return v1::SURFACE_KIND_TRUE;
    case SurfaceKind::kOcclusion:
      return v1::SURFACE_KIND_OCCLUSION;
    case SurfaceKind::kHole:
      return v1::SURFACE_KIND_HOLE_BOUNDARY;
    case SurfaceKind::kImage:
      return v1::SURFACE_KIND_IMAGE_BOUNDARY;
  }
  return v1::SURFACE_KIND_UNSPECIFIED;
}

v1::BySurfaceKind WriteByKind(const std::array<double, kSurfaceKinds>& values) {
  v1::BySurfaceKind out;
  out.set_true_surface(values[0]);
  out.set_occlusion(values[1]);
  out.set_hole_boundary(values[2]);
  out.set_image_boundary(values[3]);
  return out;
}

void WriteCovariance(const Matrix6d& covariance, google::protobuf::RepeatedField<double>& numbers) {
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) numbers.Add(covariance(row, column));
  }
}

void WriteScoreMap(const Plan& plan, double cell_size, const Eigen::Vector3d& origin,
                   v1::ScoreMap& map) {
  *map.mutable_origin() = WriteVector(origin);
  map.set_cell_size(cell_size);
  map.set_total_cells(static_cast<int64_t>(plan.score_map.size()));
  for (const ScoredCell& cell : plan.score_map) {
    map.add_x(cell.centre.x());
    map.add_y(cell.centre.y());
    map.add_z(cell.centre.z());
    map.add_score(cell.score);
    map.add_lower(cell.lower);
    map.add_upper(cell.upper);
  }
}

}  // namespace

google::protobuf::Timestamp WriteTime(absl::Time time) {
  google::protobuf::Timestamp out;
  const int64_t nanos = absl::ToUnixNanos(time);
  out.set_seconds(nanos / 1'000'000'000);
  out.set_nanos(static_cast<int32_t>(nanos % 1'000'000'000));
  return out;
}

absl::Time ReadTime(const google::protobuf::Timestamp& time) {
  return absl::FromUnixSeconds(time.seconds()) + absl::Nanoseconds(time.nanos());
}

v1::Vector3 WriteVector(const Eigen::Vector3d& vector) {
  v1::Vector3 out;
  out.set_x(vector.x());
  out.set_y(vector.y());
  out.set_z(vector.z());
  return out;
}

v1::Pose WritePose(const Eigen::Isometry3d& T_model_scan, const Eigen::Vector3d& origin) {
  v1::Pose out;
  const Eigen::Quaterniond rotation(T_model_scan.linear());
  out.mutable_rotation()->set_w(rotation.w());
  out.mutable_rotation()->set_x(rotation.x());
  out.mutable_rotation()->set_y(rotation.y());
  out.mutable_rotation()->set_z(rotation.z());
  *out.mutable_translation() = WriteVector(T_model_scan.translation() + origin);
  return out;
}

Eigen::Isometry3d ReadOwnPose(const v1::Pose& pose, const Eigen::Vector3d& origin) {
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  const v1::Quaternion& q = pose.rotation();
  out.linear() = Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z()).normalized().toRotationMatrix();
  out.translation() =
      Eigen::Vector3d(pose.translation().x(), pose.translation().y(), pose.translation().z()) -
      origin;
  return out;
}

v1::RegistrationVerdict WriteVerdict(const RegistrationVerdict& verdict) {
  v1::RegistrationVerdict out;
  out.set_outcome(WriteOutcome(verdict.outcome));
  out.set_overlap_share(verdict.overlap_share);
  out.set_error_bound(verdict.error_bound);
  out.set_rigorous_bound(verdict.rigorous_bound);
  out.set_strength(verdict.strength);
  *out.mutable_weakest_rotation() = WriteVector(verdict.weakest.head<3>());
  *out.mutable_weakest_translation() = WriteVector(verdict.weakest.tail<3>());
  out.set_weakest_words(verdict.weakest_words);
  out.set_decided_by(verdict.decided_by);
  out.set_reason(verdict.reason);
  out.set_remedy(verdict.remedy);
  return out;
}

v1::Registration WriteRegistration(const RegistrationResult& result, uint64_t model_version,
                                   const Eigen::Vector3d& origin) {
  v1::Registration out;
  *out.mutable_pose() = WritePose(result.T_world_scan, origin);
  out.set_converged(result.converged);
  out.set_iterations(result.iterations);
  out.set_correspondences(static_cast<int64_t>(result.correspondences));
  out.set_rms_residual(result.rms_residual);
  out.set_expected_residual(result.expected_residual);
  out.set_contradiction_share(result.contradiction_share);
  WriteCovariance(result.covariance, *out.mutable_covariance());
  *out.mutable_centroid() = WriteVector(result.centroid + origin);
  out.set_seconds(result.seconds);
  *out.mutable_verdict() = WriteVerdict(result.verdict);
  out.set_model_version(model_version);
  return out;
}

v1::Levelling WriteLevelling(const Levelling& levelling, const Eigen::Vector3d& origin) {
  v1::Levelling out;
  *out.mutable_pose() = WritePose(levelling.T_world_scan, origin);
  out.set_tilt(levelling.tilt);
  out.set_from_inclinometer(levelling.from_inclinometer);
  out.set_found_floor(levelling.found_floor);
  return out;
}

v1::MergeReport WriteMergeReport(const MergeReport& report) {
  v1::MergeReport out;
  out.set_model_version(report.version);
  out.set_samples(static_cast<int64_t>(report.samples));
  out.set_empty_voxels(static_cast<int64_t>(report.empty_voxels));
  out.set_surface_voxels(static_cast<int64_t>(report.surface_voxels));
  out.set_changed_bricks(static_cast<int64_t>(report.changed_bricks));
  out.set_carve_seconds(report.carve_seconds);
  out.set_merge_seconds(report.merge_seconds);
  return out;
}

v1::Coverage WriteCoverage(const Coverage& coverage, double required_density) {
  v1::Coverage out;
  *out.mutable_area() = WriteByKind(coverage.area);
  out.set_area_at_density(coverage.area_at_density);
  out.set_area_given_up(coverage.area_given_up);
  out.set_estimated_coverage(coverage.estimated_coverage);
  out.set_required_density(required_density);
  return out;
}

v1::Patch WritePatch(const Patch& patch, const Eigen::Vector3d& origin) {
  v1::Patch out;
  out.set_kind(WriteKind(patch.kind));
  *out.mutable_centre() = WriteVector(patch.centre + origin);
  *out.mutable_normal() = WriteVector(patch.normal);
  *out.mutable_axis_u() = WriteVector(patch.axis_u);
  out.set_length_u(patch.length_u);
  out.set_length_v(patch.length_v);
  out.set_area(patch.area);
  out.set_mean_density(patch.mean_density);
  out.set_deficit(patch.deficit);
  out.set_importance(patch.importance);
  return out;
}

v1::RankedView WriteView(const RankedView& view, const std::vector<Patch>& patches, double density,
                         const Eigen::Vector3d& origin) {
  v1::RankedView out;
  *out.mutable_position() = WriteVector(view.position + origin);
  out.set_score(view.score);
  out.set_lower(view.lower);
  out.set_upper(view.upper);
  out.set_exact(view.exact);
  out.set_area(view.score / density);
  out.set_area_lower(view.lower / density);
  out.set_area_upper(view.upper / density);
  *out.mutable_gain_by_kind() = WriteByKind(view.gain_by_kind);
  out.set_height_over_floor(view.height_over_floor);
  out.set_clearance(view.clearance);
  if (view.travel.has_value()) {
    out.set_travel(*view.travel);
  } else {
    out.set_unreachable("no free path from the last stand is known");
  }
  for (const PatchGain& gain : view.patches) {
    v1::PatchGain& written = *out.add_patches();
    written.set_patch(gain.patch);
    written.set_gain(gain.gain);
    if (gain.patch >= 0 && static_cast<size_t>(gain.patch) < patches.size()) {
      const Patch& patch = patches[static_cast<size_t>(gain.patch)];
      *written.mutable_centre() = WriteVector(patch.centre + origin);
      written.set_kind(WriteKind(patch.kind));
    }
  }
  v1::Findable& where = *out.mutable_where();
  for (const WallOffset& wall : view.where.walls) {
    v1::WallOffset& written = *where.add_walls();
    *written.mutable_wall_point() = WriteVector(wall.wall_point + origin);
    *written.mutable_wall_normal() = WriteVector(wall.wall_normal);
    written.set_distance(wall.distance);
  }
  where.set_last_stand_distance(view.where.last_stand_distance);
  where.set_last_stand_bearing(view.where.last_stand_bearing);
  where.set_words(view.where.words);
  if (!view.region.box.isEmpty()) {
    v1::GoodRegion& region = *out.mutable_region();
    *region.mutable_box()->mutable_min() = WriteVector(view.region.box.min() + origin);
    *region.mutable_box()->mutable_max() = WriteVector(view.region.box.max() + origin);
    region.set_volume(view.region.volume);
    region.set_cells(view.region.cells);
  }
  *out.mutable_verdict() = WriteVerdict(view.verdict);
  return out;
}

v1::PlanResult WritePlanResult(const Plan& plan, const v1::PlanningConfig& config, bool full,
                               const Eigen::Vector3d& origin) {
  const double density = config.required_density();
  v1::PlanResult out;
  out.set_outcome(WriteOutcome(plan.outcome));
  out.set_message(plan.message);
  out.set_model_version(plan.model_version);
  for (const RankedView& view : plan.views) {
    *out.add_views() = WriteView(view, plan.patches, density, origin);
  }
  for (const RankedView& view : plan.refused) {
    *out.add_refused() = WriteView(view, plan.patches, density, origin);
  }
  out.set_optimality_gap(plan.optimality_gap);
  out.set_confidence(plan.confidence);
  out.set_complete(plan.complete);
  v1::Termination& termination = *out.mutable_termination();
  termination.set_suggested(plan.termination.suggested);
  termination.set_reason(plan.termination.reason);
  termination.set_best_upper(plan.termination.best_upper);
  termination.set_best_upper_area(plan.termination.best_upper / density);
  termination.set_largest_patch_area(plan.termination.largest_patch_area);
  if (plan.termination.unseeable_known) {
    termination.set_unseeable_area(plan.termination.unseeable_area);
  }
  *out.mutable_coverage() = WriteCoverage(plan.coverage, density);
  out.set_feasible_cells(static_cast<int64_t>(plan.feasible_cells));
  out.set_needy_cells(static_cast<int64_t>(plan.needy_cells));
  out.set_needy_area(plan.needy_area);
  out.set_rays(plan.rays);
  out.set_seed(plan.seed);
  for (int stage = 0; stage < kPlanStages; ++stage) {
    v1::StageSeconds& seconds = *out.add_stages();
    seconds.set_stage(kPlanStageNames[static_cast<size_t>(stage)]);
    seconds.set_seconds(plan.seconds[static_cast<size_t>(stage)]);
  }
  *out.mutable_config() = config;
  out.set_patch_count(static_cast<int64_t>(plan.patches.size()));
  if (!full) return out;
  const size_t patches = std::min<size_t>(plan.patches.size(), kMaxPatches);
  for (size_t i = 0; i < patches; ++i) *out.add_patches() = WritePatch(plan.patches[i], origin);
  WriteScoreMap(plan, config.viewcell_size(), origin, *out.mutable_score_map());
  return out;
}

void StripToBasic(v1::PlanResult& result) {
  result.clear_patches();
  result.clear_score_map();
}

v1::EvaluateViewResponse WriteEvaluation(const ViewEvaluation& evaluation, double density,
                                         const Eigen::Vector3d& origin) {
  v1::EvaluateViewResponse out;
  out.set_feasible(evaluation.feasible);
  out.set_why_not(evaluation.why_not);
  *out.mutable_view() = WriteView(evaluation.view, evaluation.patches, density, origin);
  const size_t patches = std::min<size_t>(evaluation.patches.size(), kMaxPatches);
  for (size_t i = 0; i < patches; ++i) {
    *out.add_patches() = WritePatch(evaluation.patches[i], origin);
  }
  return out;
}

}  // namespace vantage

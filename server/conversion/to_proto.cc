#include "server/conversion/to_proto.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "absl/strings/str_replace.h"
#include "google/protobuf/util/time_util.h"

namespace vantage::conversion {
namespace {

v1::RegistrationOutcome WriteOutcome(registration::RegistrationOutcome outcome) {
  switch (outcome) {
    case registration::RegistrationOutcome::kRegistered:
      return v1::REGISTRATION_OUTCOME_REGISTERED;
    case registration::RegistrationOutcome::kDoubtful:
      return v1::REGISTRATION_OUTCOME_DOUBTFUL;
    case registration::RegistrationOutcome::kFailed:
      return v1::REGISTRATION_OUTCOME_FAILED;
  }
  return v1::REGISTRATION_OUTCOME_UNSPECIFIED;
}

v1::PlanOutcome WriteOutcome(planning::PlanOutcome outcome) {
  switch (outcome) {
    case planning::PlanOutcome::kViews:
      return v1::PLAN_OUTCOME_VIEWS;
    case planning::PlanOutcome::kNoFeasibleView:
      return v1::PLAN_OUTCOME_NO_FEASIBLE_VIEW;
    case planning::PlanOutcome::kNoRegistrableView:
      return v1::PLAN_OUTCOME_NO_REGISTRABLE_VIEW;
    case planning::PlanOutcome::kNothingToGain:
      return v1::PLAN_OUTCOME_NOTHING_TO_GAIN;
    case planning::PlanOutcome::kSearchUnfinished:
      return v1::PLAN_OUTCOME_SEARCH_UNFINISHED;
    case planning::PlanOutcome::kCancelled:
      return v1::PLAN_OUTCOME_CANCELLED;
  }
  return v1::PLAN_OUTCOME_UNSPECIFIED;
}

v1::PlanStage WriteStage(planning::PlanStage stage) {
  switch (stage) {
    case planning::PlanStage::kFeasible:
      return v1::PLAN_STAGE_FEASIBLE_VIEWS;
    case planning::PlanStage::kPatches:
      return v1::PLAN_STAGE_EXTRACT_PATCHES;
    case planning::PlanStage::kRankPatches:
      return v1::PLAN_STAGE_RANK_PATCHES;
    case planning::PlanStage::kEvaluate:
      return v1::PLAN_STAGE_EVALUATE_VIEWS;
    case planning::PlanStage::kRankViews:
      return v1::PLAN_STAGE_RANK_VIEWS;
    case planning::PlanStage::kCheck:
      return v1::PLAN_STAGE_REGISTRATION_CHECK;
  }
  return v1::PLAN_STAGE_UNSPECIFIED;
}

v1::RegistrationBasis WriteBasis(registration::RegistrationBasis basis) {
  switch (basis) {
    case registration::RegistrationBasis::kScanGeometry:
      return v1::REGISTRATION_BASIS_SCAN_GEOMETRY;
    case registration::RegistrationBasis::kLevelling:
      return v1::REGISTRATION_BASIS_LEVELLING;
    case registration::RegistrationBasis::kTargets:
      return v1::REGISTRATION_BASIS_TARGETS;
    case registration::RegistrationBasis::kTrustedPose:
      return v1::REGISTRATION_BASIS_TRUSTED_POSE;
    case registration::RegistrationBasis::kOverlap:
      return v1::REGISTRATION_BASIS_OVERLAP;
    case registration::RegistrationBasis::kNoPosePrior:
      return v1::REGISTRATION_BASIS_NO_POSE_PRIOR;
    case registration::RegistrationBasis::kResiduals:
      return v1::REGISTRATION_BASIS_RESIDUALS;
    case registration::RegistrationBasis::kContradiction:
      return v1::REGISTRATION_BASIS_CONTRADICTION;
    case registration::RegistrationBasis::kRivalPose:
      return v1::REGISTRATION_BASIS_RIVAL_POSE;
    case registration::RegistrationBasis::kNotConverged:
      return v1::REGISTRATION_BASIS_NOT_CONVERGED;
  }
  return v1::REGISTRATION_BASIS_UNSPECIFIED;
}

v1::BySurfaceKind WriteByKind(const std::array<double, model::kSurfaceKinds>& values) {
  v1::BySurfaceKind out;
  out.set_true_surface(values[0]);
  out.set_occlusion(values[1]);
  out.set_hole_boundary(values[2]);
  out.set_image_boundary(values[3]);
  return out;
}

void WriteCovariance(const sensor::Matrix6d& covariance,
                     google::protobuf::RepeatedField<double>& numbers) {
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) numbers.Add(covariance(row, column));
  }
}

void WriteScoreMap(const planning::Plan& plan, double cell_size, const Eigen::Vector3d& origin,
                   v1::ScoreMap& map) {
  *map.mutable_origin() = WriteVector(origin);
  map.set_viewcell_size_m(cell_size);
  map.set_total_viewcell_count(static_cast<int64_t>(plan.score_map.size()));
  for (const planning::ScoredCell& cell : plan.score_map) {
    map.add_x(cell.centre.x());
    map.add_y(cell.centre.y());
    map.add_z(cell.centre.z());
    map.add_score(cell.score);
    map.add_score_lower(cell.lower);
    map.add_score_upper(cell.upper);
  }
}

}  // namespace

v1::SurfaceKind WriteKind(model::SurfaceKind kind) {
  switch (kind) {
    case model::SurfaceKind::kTrue:
      return v1::SURFACE_KIND_TRUE;
    case model::SurfaceKind::kOcclusion:
      return v1::SURFACE_KIND_OCCLUSION;
    case model::SurfaceKind::kHole:
      return v1::SURFACE_KIND_HOLE_BOUNDARY;
    case model::SurfaceKind::kImage:
      return v1::SURFACE_KIND_IMAGE_BOUNDARY;
  }
  return v1::SURFACE_KIND_UNSPECIFIED;
}

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

google::protobuf::Duration WriteDuration(double seconds) {
  const double nanos = seconds * 1e9;
  if (!(nanos >= 0 && nanos < 9.2e18)) return {};
  return google::protobuf::util::TimeUtil::NanosecondsToDuration(std::llround(nanos));
}

double ReadDuration(const google::protobuf::Duration& duration) {
  return static_cast<double>(duration.seconds()) + duration.nanos() / 1e9;
}

v1::Vector3 WriteVector(const Eigen::Vector3d& vector) {
  v1::Vector3 out;
  out.set_x(vector.x());
  out.set_y(vector.y());
  out.set_z(vector.z());
  return out;
}

Eigen::Vector3d ReadOwnVector(const v1::Vector3& vector) {
  return {vector.x(), vector.y(), vector.z()};
}

v1::PosePrior WriteStatedPose(const Eigen::Isometry3d& T_world_scan) {
  v1::PosePrior out;
  Eigen::Quaterniond rotation(T_world_scan.linear());
  rotation.normalize();
  if (rotation.w() < 0) rotation.coeffs() = -rotation.coeffs();
  v1::Quaternion& q = *out.mutable_pose()->mutable_rotation();
  q.set_w(rotation.w());
  q.set_x(rotation.x());
  q.set_y(rotation.y());
  q.set_z(rotation.z());
  *out.mutable_pose()->mutable_translation() =
      WriteVector(Eigen::Vector3d(T_world_scan.translation()));
  out.set_source(v1::POSE_PRIOR_SOURCE_FILE_HEADER);
  return out;
}

v1::ScannerModel WriteScannerModel(const sensor::ScannerModel& scanner, const std::string& id) {
  v1::ScannerModel out;
  out.set_id(id);
  out.set_azimuth_span_rad(scanner.azimuth_span);
  out.set_min_elevation_rad(scanner.elevation_min);
  out.set_max_elevation_rad(scanner.elevation_max);
  out.set_azimuth_step_rad(scanner.azimuth_step);
  out.set_elevation_step_rad(scanner.elevation_step);
  out.set_min_range_m(scanner.range_min);
  out.set_max_range_m(scanner.range_max);
  out.set_range_noise_m(scanner.range_noise);
  out.set_range_noise_ppm(scanner.range_noise_ppm);
  out.set_max_incidence_rad(scanner.max_incidence);
  out.set_clearance_m(scanner.clearance);
  out.set_positioning_error_m(scanner.positioning_error);
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
  out.translation() = ReadOwnVector(pose.translation()) - origin;
  return out;
}

v1::RegistrationVerdict WriteVerdict(const registration::RegistrationVerdict& verdict) {
  v1::RegistrationVerdict out;
  out.set_outcome(WriteOutcome(verdict.outcome));
  out.set_overlap_share(verdict.overlap_share);
  out.set_error_bound_m(verdict.error_bound);
  out.set_rigorous_bound_m(verdict.rigorous_bound);
  out.set_strength(verdict.strength);
  *out.mutable_weakest_rotation() = WriteVector(verdict.weakest.head<3>());
  *out.mutable_weakest_translation() = WriteVector(verdict.weakest.tail<3>());
  out.set_weakest_description(verdict.weakest_words);
  if (verdict.bases.size() == 1) {
    out.set_basis(WriteBasis(verdict.bases.front()));
  } else if (!verdict.bases.empty()) {
    out.set_basis(v1::REGISTRATION_BASIS_COMBINED);
    for (const registration::RegistrationBasis basis : verdict.bases) {
      out.add_combined_bases(WriteBasis(basis));
    }
  }
  out.set_message(verdict.reason);
  out.set_remedy(verdict.remedy);
  if (verdict.attainable_accuracy.has_value()) {
    out.set_attainable_accuracy_m(*verdict.attainable_accuracy);
  }
  return out;
}

v1::Registration WriteRegistration(const registration::RegistrationResult& result,
                                   uint64_t model_version, const Eigen::Vector3d& origin) {
  v1::Registration out;
  *out.mutable_pose() = WritePose(result.T_world_scan, origin);
  out.set_converged(result.converged);
  out.set_iteration_count(result.iterations);
  out.set_correspondence_count(static_cast<int64_t>(result.correspondences));
  out.set_rms_residual_m(result.rms_residual);
  out.set_expected_residual_m(result.expected_residual);
  out.set_contradiction_share(result.contradiction_share);
  if (result.moved_area.has_value()) out.set_moved_area_m2(*result.moved_area);
  WriteCovariance(result.covariance, *out.mutable_covariance());
  *out.mutable_centroid() = WriteVector(result.centroid + origin);
  *out.mutable_duration() = WriteDuration(result.seconds);
  *out.mutable_verdict() = WriteVerdict(result.verdict);
  out.set_model_version(model_version);
  for (const registration::RivalPose& rival : result.rival_poses) {
    v1::RivalPose& to = *out.add_rival_poses();
    *to.mutable_pose() = WritePose(rival.T_world_scan, origin);
    to.set_fit_share(rival.fit_share);
    to.set_distance_m(rival.distance);
  }
  for (size_t k = 0; result.residuals.has_value() && k < registration::kResidualClasses; ++k) {
    const registration::ClassResiduals& of = (*result.residuals)[k];
    if (of == registration::ClassResiduals()) continue;
    v1::ClassResiduals& to = *out.add_class_residuals();
    to.set_class_index(static_cast<int32_t>(k));
    to.set_block_count(static_cast<int64_t>(of.blocks));
    to.set_shared_m2(of.shared);
    to.set_freedom_count(static_cast<int64_t>(of.freedom));
    to.set_scatter_m2(of.scatter);
    to.set_expected_scatter_m2(of.expected);
  }
  return out;
}

registration::PairResiduals ReadOwnResiduals(const v1::Registration& registration) {
  registration::PairResiduals residuals{};
  for (const v1::ClassResiduals& of : registration.class_residuals()) {
    const auto k = static_cast<size_t>(of.class_index());
    if (k >= residuals.size()) continue;
    residuals[k] = {static_cast<double>(of.block_count()), of.shared_m2(),
                    static_cast<double>(of.freedom_count()), of.scatter_m2(),
                    of.expected_scatter_m2()};
  }
  return residuals;
}

v1::Levelling WriteLevelling(const registration::Levelling& levelling,
                             const Eigen::Vector3d& origin) {
  v1::Levelling out;
  *out.mutable_pose() = WritePose(levelling.T_world_scan, origin);
  out.set_tilt_rad(levelling.tilt);
  out.set_from_inclinometer(levelling.from_inclinometer);
  out.set_found_floor(levelling.found_floor);
  out.set_message(levelling.message);
  return out;
}

v1::MergeReport WriteMergeReport(const model::MergeReport& report, const Eigen::Vector3d& origin) {
  v1::MergeReport out;
  out.set_model_version(report.version);
  out.set_sample_count(static_cast<int64_t>(report.samples));
  out.set_beyond_range_count(static_cast<int64_t>(report.beyond_range));
  out.set_beyond_site_count(static_cast<int64_t>(report.beyond_site));
  out.set_sky_ray_count(static_cast<int64_t>(report.sky_rays));
  out.set_empty_voxel_count(static_cast<int64_t>(report.empty_voxels));
  out.set_surface_voxel_count(static_cast<int64_t>(report.surface_voxels));
  out.set_changed_brick_count(static_cast<int64_t>(report.changed_bricks));
  *out.mutable_carve_duration() = WriteDuration(report.carve_seconds);
  *out.mutable_merge_duration() = WriteDuration(report.merge_seconds);
  for (const model::SiteChange& change : report.changes) {
    v1::SiteChange& to = *out.add_changes();
    to.set_kind(change.kind == model::SiteChange::Kind::kCame ? v1::SITE_CHANGE_KIND_CAME
                                                              : v1::SITE_CHANGE_KIND_GONE);
    to.set_since(change.since);
    *to.mutable_centre() = WriteVector(change.centre + origin);
    *to.mutable_box()->mutable_min() = WriteVector(change.box.min() + origin);
    *to.mutable_box()->mutable_max() = WriteVector(change.box.max() + origin);
    to.set_area_m2(change.area);
  }
  return out;
}

v1::Opening WriteOpening(const planning::Openings& openings, const planning::Opening& opening,
                         const Eigen::Vector3d& origin) {
  v1::Opening out;
  *out.mutable_centre() = WriteVector(opening.centre + origin);
  *out.mutable_direction() = WriteVector(opening.direction);
  out.set_width_m(opening.width);
  out.set_height_m(opening.height());
  out.set_sill_m(opening.sill);
  out.set_doorway(opening.doorway());
  out.set_storey_index(opening.storey);
  *out.mutable_standing() = WriteVector(opening.standing + origin);
  out.set_space_index(opening.behind);
  const planning::Space& behind = openings.Behind(opening);
  out.set_free_area_behind_m2(behind.free_area);
  out.set_frontier_area_behind_m2(behind.frontier_area);
  out.set_entered(behind.entered);
  return out;
}

v1::Coverage WriteCoverage(const planning::Coverage& coverage, double required_density,
                           const Eigen::Vector3d& origin) {
  v1::Coverage out;
  *out.mutable_area_by_kind_m2() = WriteByKind(coverage.area);
  out.set_area_at_density_m2(coverage.area_at_density);
  out.set_area_given_up_m2(coverage.area_given_up);
  out.set_area_out_of_reach_m2(coverage.area_out_of_reach);
  if (coverage.estimated_coverage.has_value()) {
    out.set_estimated_coverage(*coverage.estimated_coverage);
  }
  out.set_required_density_per_m2(required_density);
  for (const planning::RegionCoverage& region : coverage.regions) {
    v1::RegionCoverage& written = *out.add_regions();
    written.set_name(region.name);
    written.set_required_density_per_m2(region.required_density);
    *written.mutable_area_by_kind_m2() = WriteByKind(region.area);
    written.set_area_at_density_m2(region.area_at_density);
    written.set_area_given_up_m2(region.area_given_up);
    written.set_area_out_of_reach_m2(region.area_out_of_reach);
    if (region.estimated_coverage.has_value()) {
      written.set_estimated_coverage(*region.estimated_coverage);
    }
  }
  out.set_rooms_not_entered_count(coverage.openings.RoomsNotEntered());
  const size_t count = std::min<size_t>(coverage.openings.openings.size(), kMaxOpenings);
  for (size_t i = 0; i < count; ++i) {
    *out.add_openings() = WriteOpening(coverage.openings, coverage.openings.openings[i], origin);
  }
  return out;
}

v1::Storey WriteStorey(const planning::Storey& storey, const Eigen::Vector3d& origin) {
  v1::Storey out;
  out.set_number(storey.number);
  if (storey.floor_z.has_value()) out.set_floor_z_m(*storey.floor_z + origin.z());
  out.set_name(storey.name);
  return out;
}

v1::Patch WritePatch(const planning::Patch& patch, const Eigen::Vector3d& origin) {
  v1::Patch out;
  out.set_kind(WriteKind(patch.kind));
  *out.mutable_centre() = WriteVector(patch.centre + origin);
  *out.mutable_normal() = WriteVector(patch.normal);
  *out.mutable_axis_u() = WriteVector(patch.axis_u);
  out.set_length_u_m(patch.length_u);
  out.set_length_v_m(patch.length_v);
  out.set_area_m2(patch.area);
  out.set_mean_density_per_m2(patch.mean_density);
  out.set_deficit(patch.deficit);
  out.set_importance(patch.importance);
  return out;
}

v1::TargetAdvice WriteTargetAdvice(const planning::TargetAdvice& advice,
                                   const Eigen::Vector3d& origin) {
  v1::TargetAdvice out;
  for (const planning::TargetPlace& place : advice.places) {
    v1::TargetPlace& to = *out.add_places();
    *to.mutable_position() = WriteVector(place.position + origin);
    if (place.normal.has_value()) *to.mutable_normal() = WriteVector(*place.normal);
    to.set_target(place.target);
    to.set_distance_m(place.distance);
  }
  out.set_error_bound_m(advice.error_bound);
  if (advice.first_view.has_value()) {
    out.set_first_view_index(static_cast<int32_t>(*advice.first_view));
  }
  for (const std::string& scan : advice.seen_from) out.add_seen_from_scans(scan);
  out.set_message(planning::TargetAdviceWords(advice, origin));
  return out;
}

v1::RankedView WriteView(const planning::RankedView& view, std::span<const planning::Patch> patches,
                         const Eigen::Vector3d& origin) {
  v1::RankedView out;
  *out.mutable_position() = WriteVector(view.position + origin);
  if (view.heading.has_value()) {
    out.set_heading_rad(*view.heading);
    out.mutable_orientation()->set_w(std::cos(*view.heading / 2));
    out.mutable_orientation()->set_z(std::sin(*view.heading / 2));
  }
  for (const float score : view.score_by_heading) out.add_score_by_heading(score);
  out.set_setting(view.setting);
  if (view.scan_minutes.has_value()) {
    *out.mutable_scan_duration() = WriteDuration(60 * *view.scan_minutes);
  }
  if (view.score_per_minute.has_value()) out.set_score_per_minute(*view.score_per_minute);
  out.set_score(view.score);
  out.set_score_lower(view.lower);
  out.set_score_upper(view.upper);
  out.set_exact(view.exact);
  if (view.model_gain.has_value()) out.set_model_gain_m2(*view.model_gain);
  out.set_expected_gain_m2(view.expected_gain.value_or(0));
  if (view.model_gain.has_value()) {
    *out.mutable_model_gain_by_kind_m2() = WriteByKind(view.gain_by_kind);
    out.set_expected_surface_gain_m2(view.gain_without_hidden.value_or(0) - *view.model_gain);
  }
  out.set_expected_gain_lower_m2(view.expected_gain_lower.value_or(0));
  out.set_expected_gain_upper_m2(view.expected_gain_upper.value_or(0));
  out.set_model_gain_lower_m2(view.model_gain.value_or(0));
  out.set_model_gain_upper_m2(view.model_gain_upper);
  *out.mutable_score_by_kind() = WriteByKind(view.score_by_kind);
  out.set_height_over_floor_m(view.height_over_floor);
  if (view.storey.has_value()) {
    *out.mutable_storey() = WriteStorey(*view.storey, origin);
    out.set_floor_measured(view.floor_measured);
  }
  if (view.expected.has_value()) {
    v1::ExpectedStation& expected = *out.mutable_expected_station();
    expected.set_by_site_prior(view.expected->by_site_prior);
    if (view.expected->doorway.has_value()) {
      *expected.mutable_doorway() = WriteVector(*view.expected->doorway + origin);
    }
    expected.set_radius_m(view.expected->radius);
    expected.set_chance(view.expected->chance);
    if (view.expected->fallback.has_value()) {
      expected.set_fallback_view_index(static_cast<int32_t>(*view.expected->fallback));
    }
    expected.set_message(planning::ExpectedStationWords(*view.expected, origin));
  }
  if (view.enables.has_value()) out.set_enabled_view_index(static_cast<int32_t>(*view.enables));
  out.set_clearance_m(view.clearance);
  if (view.travel.has_value()) {
    out.set_travel_distance_m(*view.travel);
  } else {
    out.set_unreachable_message("no free path from the last station is known");
  }
  for (const planning::PatchScore& score : view.patch_scores) {
    v1::PatchScore& written = *out.add_patch_scores();
    written.set_patch_index(score.patch);
    written.set_score(score.score);
    if (score.patch >= 0 && static_cast<size_t>(score.patch) < patches.size()) {
      const planning::Patch& patch = patches[static_cast<size_t>(score.patch)];
      *written.mutable_centre() = WriteVector(patch.centre + origin);
      written.set_kind(WriteKind(patch.kind));
    }
  }
  if (!view.checked) return out;
  v1::LocationDescription& location = *out.mutable_location();
  for (const planning::WallOffset& wall : view.location.walls) {
    v1::WallOffset& written = *location.add_walls();
    *written.mutable_wall_point() = WriteVector(wall.wall_point + origin);
    *written.mutable_wall_normal() = WriteVector(wall.wall_normal);
    written.set_distance_m(wall.distance);
  }
  if (view.location.last_station_distance.has_value()) {
    location.set_last_station_distance_m(*view.location.last_station_distance);
  }
  if (view.location.last_station_bearing.has_value()) {
    location.set_last_station_bearing_rad(*view.location.last_station_bearing);
  }
  location.set_description(view.location.description);
  if (!view.region.box.isEmpty()) {
    v1::EquivalentRegion& region = *out.mutable_region();
    *region.mutable_box()->mutable_min() = WriteVector(view.region.box.min() + origin);
    *region.mutable_box()->mutable_max() = WriteVector(view.region.box.max() + origin);
    region.set_volume_m3(view.region.volume);
    region.set_viewcell_count(view.region.viewcell_count);
  }
  *out.mutable_verdict() = WriteVerdict(view.verdict);
  if (view.targets.has_value()) {
    *out.mutable_target_advice() = WriteTargetAdvice(*view.targets, origin);
  }
  for (const planning::OpenDoor& door : view.doors) {
    v1::OpenDoor& written = *out.add_open_doors();
    *written.mutable_centre() = WriteVector(door.centre + origin);
    written.set_width_m(door.width);
    written.set_overlap_share(door.overlap_share);
  }
  return out;
}

v1::NarrowWay WriteNarrowWay(const planning::NarrowWay& way, const Eigen::Vector3d& origin) {
  v1::NarrowWay out;
  *out.mutable_narrowest() = WriteVector(way.narrowest + origin);
  out.set_width_m(way.width);
  *out.mutable_position() = WriteVector(way.place + origin);
  out.set_model_gain_m2(way.model_gain);
  out.set_expected_gain_m2(way.gain_without_hidden);
  out.set_message(planning::NarrowWayWords(way, origin));
  return out;
}

v1::PlanResult WritePlanResult(const planning::Plan& plan, const v1::PlanningConfig& config,
                               bool full, const Eigen::Vector3d& origin) {
  const double density = config.required_density_per_m2();
  v1::PlanResult out;
  out.set_outcome(WriteOutcome(plan.outcome));
  out.set_message(plan.message);
  out.set_model_version(plan.model_version);
  for (const planning::RankedView& view : plan.views) {
    *out.add_views() = WriteView(view, plan.patches, origin);
  }
  for (const planning::RankedView& view : plan.refused) {
    *out.add_refused() = WriteView(view, plan.patches, origin);
  }
  out.set_optimality_gap(plan.optimality_gap);
  out.set_confidence(plan.confidence);
  out.set_complete(plan.complete);
  v1::Termination& termination = *out.mutable_termination();
  termination.set_suggested(plan.termination.suggested);
  termination.set_message(plan.termination.reason);
  if (plan.termination.best_upper.has_value()) {
    termination.set_best_score_upper(*plan.termination.best_upper);
  }
  termination.set_largest_patch_area_m2(plan.termination.largest_patch_area);
  if (plan.termination.best_model_gain.has_value()) {
    termination.set_best_model_gain_lower_m2(*plan.termination.best_model_gain);
  }
  if (plan.termination.best_gain_without_hidden.has_value()) {
    termination.set_best_expected_gain_lower_m2(*plan.termination.best_gain_without_hidden);
  }
  if (plan.termination.best_gain_without_hidden_upper.has_value()) {
    termination.set_best_expected_gain_upper_m2(*plan.termination.best_gain_without_hidden_upper);
    // No model gain is larger than the expected gain of its view.
    termination.set_best_model_gain_upper_m2(*plan.termination.best_gain_without_hidden_upper);
  }
  if (plan.termination.unobservable_known) {
    termination.set_unobservable_area_m2(plan.termination.unobservable_area);
  }
  for (const planning::NarrowWay& way : plan.narrow_ways) {
    *out.add_narrow_ways() = WriteNarrowWay(way, origin);
  }
  if (plan.followed_tour.has_value()) {
    v1::FollowedTour& followed = *out.mutable_followed_tour();
    followed.set_message(plan.followed_tour->message);
    if (plan.followed_tour->station.has_value()) {
      followed.set_station_index(static_cast<int32_t>(*plan.followed_tour->station));
    }
    if (plan.followed_tour->otherwise.has_value()) {
      followed.set_otherwise_view_index(static_cast<int32_t>(*plan.followed_tour->otherwise));
    }
  }
  if (plan.coverage.has_value()) {
    *out.mutable_coverage() = WriteCoverage(*plan.coverage, density, origin);
  }
  for (const planning::Storey& storey : plan.storeys) {
    *out.add_storeys() = WriteStorey(storey, origin);
  }
  if (plan.attainable_accuracy.has_value()) {
    out.set_attainable_accuracy_m(*plan.attainable_accuracy);
  }
  out.set_feasible_viewcell_count(static_cast<int64_t>(plan.feasible_cells));
  out.set_deficient_voxel_count(static_cast<int64_t>(plan.deficient_cells));
  out.set_surface_cube_voxels(plan.surface_cube);
  out.set_deficient_area_m2(plan.deficient_area);
  out.set_ray_count(plan.rays);
  out.set_seed(plan.seed);
  for (int stage = 0; stage < planning::kPlanStages; ++stage) {
    v1::StageDuration& written = *out.add_stage_durations();
    written.set_stage(WriteStage(static_cast<planning::PlanStage>(stage)));
    *written.mutable_duration() = WriteDuration(plan.seconds[static_cast<size_t>(stage)]);
  }
  *out.mutable_config() = config;
  out.set_patch_count(static_cast<int64_t>(plan.patches.size()));
  if (!full) return out;
  const size_t patches = std::min<size_t>(plan.patches.size(), kMaxPatches);
  for (size_t i = 0; i < patches; ++i) *out.add_patches() = WritePatch(plan.patches[i], origin);
  WriteScoreMap(plan, config.viewcell_size_m(), origin, *out.mutable_score_map());
  return out;
}

void StripToBasic(v1::PlanResult& result) {
  result.clear_patches();
  result.clear_score_map();
}

v1::EvaluateViewResponse WriteEvaluation(const planning::ViewEvaluation& evaluation,
                                         const Eigen::Vector3d& origin) {
  v1::EvaluateViewResponse out;
  out.set_feasible(evaluation.feasible);
  out.set_infeasible_message(evaluation.infeasible_message);
  *out.mutable_view() = WriteView(evaluation.view, evaluation.patches, origin);
  const size_t patches = std::min<size_t>(evaluation.patches.size(), kMaxPatches);
  for (size_t i = 0; i < patches; ++i) {
    *out.add_patches() = WritePatch(evaluation.patches[i], origin);
  }
  return out;
}

void NameLastStation(const std::string& scan, v1::RankedView& view) {
  if (scan.empty() || !view.has_location()) return;
  std::string& description = *view.mutable_location()->mutable_description();
  description = absl::StrReplaceAll(description, {{planning::kLastStation, scan}});
}

void NameLastStation(const std::string& scan, v1::PlanResult& result) {
  for (v1::RankedView& view : *result.mutable_views()) NameLastStation(scan, view);
  for (v1::RankedView& view : *result.mutable_refused()) NameLastStation(scan, view);
}

}  // namespace vantage::conversion

#include "tests/server/session/describe_state.h"

#include <cmath>
#include <limits>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/planning/plan/plan.h"
#include "server/conversion/fleet_proto.h"
#include "server/conversion/to_proto.h"
#include "server/store/upgrade.h"

namespace vantage::session {
namespace {

// What is absent is no zero: 'nan' among numbers, -1 among counts.
double Given(bool given, double value) {
  return given ? value : std::numeric_limits<double>::quiet_NaN();
}
int64_t Counted(bool given, int64_t count) { return given ? count : -1; }

// Times as whole microseconds: seconds in a double and durations say the same.
int64_t Microseconds(const google::protobuf::Duration& duration) {
  return std::llround(conversion::ReadDuration(duration) * 1e6);
}

void Time(absl::string_view label, const google::protobuf::Timestamp& time,
          test_support::GoldenText& out) {
  out.Counts(label, {time.seconds(), time.nanos()});
}

void Vector(absl::string_view label, const v1::Vector3& v, test_support::GoldenText& out) {
  out.Numbers(label, {v.x(), v.y(), v.z()});
}

void Box(absl::string_view label, const v1::Box& box, test_support::GoldenText& out) {
  out.Numbers(label, {box.min().x(), box.min().y(), box.min().z(), box.max().x(), box.max().y(),
                      box.max().z()});
}

void Pose(absl::string_view label, const v1::Pose& pose, test_support::GoldenText& out) {
  out.Numbers(label,
              {pose.rotation().w(), pose.rotation().x(), pose.rotation().y(), pose.rotation().z(),
               pose.translation().x(), pose.translation().y(), pose.translation().z()});
}

void Kinds(absl::string_view label, const v1::BySurfaceKind& kinds, test_support::GoldenText& out) {
  out.Numbers(label, {kinds.true_surface(), kinds.occlusion(), kinds.hole_boundary(),
                      kinds.image_boundary()});
}

template <typename Repeated>
std::vector<double> All(const Repeated& values) {
  return {values.begin(), values.end()};
}

void Describe(const v1::PosePrior& prior, test_support::GoldenText& out) {
  Pose("  prior", prior.pose(), out);
  out.Numbers("  prior covariance", All(prior.covariance()));
  if (prior.has_levelled_sigma_rad()) out.Numbers("  prior levelled", {prior.levelled_sigma_rad()});
  out.Counts("  prior trusted", {prior.trusted()});
}

void Describe(const v1::ScannerModel& model, test_support::GoldenText& out) {
  out.Word("scanner model", model.id());
  out.Numbers("  span, elevations, steps",
              {Given(model.has_azimuth_span_rad(), model.azimuth_span_rad()),
               Given(model.has_min_elevation_rad(), model.min_elevation_rad()),
               Given(model.has_max_elevation_rad(), model.max_elevation_rad()),
               Given(model.has_azimuth_step_rad(), model.azimuth_step_rad()),
               Given(model.has_elevation_step_rad(), model.elevation_step_rad())});
  out.Numbers("  ranges, noise, noise ppm, incidence, clearance, positioning",
              {Given(model.has_min_range_m(), model.min_range_m()),
               Given(model.has_max_range_m(), model.max_range_m()),
               Given(model.has_range_noise_m(), model.range_noise_m()),
               Given(model.has_range_noise_ppm(), model.range_noise_ppm()),
               Given(model.has_max_incidence_rad(), model.max_incidence_rad()),
               Given(model.has_clearance_m(), model.clearance_m()),
               Given(model.has_positioning_error_m(), model.positioning_error_m())});
}

void Describe(const v1::PlanningConfig& c, test_support::GoldenText& out) {
  out.Numbers("  required density, viewcell, density tolerance",
              {Given(c.has_required_density_per_m2(), c.required_density_per_m2()),
               Given(c.has_viewcell_size_m(), c.viewcell_size_m()),
               Given(c.has_density_tolerance(), c.density_tolerance())});
  out.Numbers("  heights, width, height of the scanner",
              {Given(c.has_min_viewpoint_height_m(), c.min_viewpoint_height_m()),
               Given(c.has_max_viewpoint_height_m(), c.max_viewpoint_height_m()),
               Given(c.has_scanner_width_m(), c.scanner_width_m()),
               Given(c.has_scanner_height_m(), c.scanner_height_m())});
  if (c.has_floor_z_m()) out.Numbers("  floor", {c.floor_z_m()});
  out.Counts("  reachable, pose sensitivity, density on false surface, order",
             {Counted(c.has_require_reachable(), c.require_reachable()),
              Counted(c.has_pose_sensitivity(), c.pose_sensitivity()),
              Counted(c.has_density_on_false_surface(), c.density_on_false_surface()),
              c.evaluation_order()});
  out.Numbers("  weights", {Given(c.weights().has_true_surface(), c.weights().true_surface()),
                            Given(c.weights().has_occlusion(), c.weights().occlusion()),
                            Given(c.weights().has_hole_boundary(), c.weights().hole_boundary()),
                            Given(c.weights().has_image_boundary(), c.weights().image_boundary())});
  out.Numbers("  least deficit, counts from, depth behind",
              {Given(c.has_min_deficit_share(), c.min_deficit_share()),
               Given(c.has_min_counted_density_share(), c.min_counted_density_share()),
               Given(c.has_unknown_depth_m(), c.unknown_depth_m())});
  out.Numbers("  separation, terminate below, least patch, confidence",
              {Given(c.has_candidate_separation_m(), c.candidate_separation_m()),
               Given(c.has_terminate_below_m2(), c.terminate_below_m2()),
               Given(c.has_min_patch_area_m2(), c.min_patch_area_m2()),
               Given(c.has_confidence(), c.confidence())});
  out.Counts("  candidates, most checked",
             {Counted(c.has_max_view_count(), c.max_view_count()),
              Counted(c.has_max_checked_view_count(), c.max_checked_view_count())});
  const v1::RegistrationConfig& r = c.registration();
  out.Numbers("  accuracy, overlap, correlation length and sigma",
              {Given(r.has_required_accuracy_m(), r.required_accuracy_m()),
               Given(r.has_min_overlap(), r.min_overlap()),
               Given(r.has_correlation_length_m(), r.correlation_length_m()),
               Given(r.has_correlated_sigma_m(), r.correlated_sigma_m())});
  out.Numbers("  normal sigma, spacing, correspondence",
              {Given(r.has_normal_sigma_rad(), r.normal_sigma_rad()),
               Given(r.has_sample_spacing_m(), r.sample_spacing_m()),
               Given(r.has_max_correspondence_distance_m(), r.max_correspondence_distance_m())});
  out.Counts("  draws, seed",
             {Counted(r.has_draw_count(), r.draw_count()), Counted(r.has_seed(), r.seed())});
}

// As it was called when it was a text.
const char* Words(v1::RegistrationBasis basis) {
  switch (basis) {
    case v1::REGISTRATION_BASIS_SCAN_GEOMETRY:
      return "scan geometry";
    case v1::REGISTRATION_BASIS_LEVELLING:
      return "levelling";
    case v1::REGISTRATION_BASIS_TARGETS:
      return "targets";
    case v1::REGISTRATION_BASIS_TRUSTED_POSE:
      return "trusted pose";
    case v1::REGISTRATION_BASIS_OVERLAP:
      return "overlap";
    case v1::REGISTRATION_BASIS_NO_POSE_PRIOR:
      return "no pose prior";
    case v1::REGISTRATION_BASIS_RESIDUALS:
      return "residuals";
    case v1::REGISTRATION_BASIS_CONTRADICTION:
      return "contradiction";
    case v1::REGISTRATION_BASIS_RIVAL_POSE:
      return "rival pose";
    case v1::REGISTRATION_BASIS_NOT_CONVERGED:
      return "convergence";
    default:
      return "";
  }
}

std::string DecidedBy(const v1::RegistrationVerdict& verdict) {
  if (verdict.basis() != v1::REGISTRATION_BASIS_COMBINED) return Words(verdict.basis());
  std::string words;
  for (const int basis : verdict.combined_bases()) {
    absl::StrAppend(&words, words.empty() ? "" : " and ",
                    Words(static_cast<v1::RegistrationBasis>(basis)));
  }
  return words.empty() ? "combined" : words;
}

void Describe(const v1::RegistrationVerdict& verdict, test_support::GoldenText& out) {
  out.Counts("  verdict", {verdict.outcome()});
  out.Numbers("  overlap, error bound, rigorous bound, strength",
              {verdict.overlap_share(), verdict.error_bound_m(), verdict.rigorous_bound_m(),
               verdict.strength()});
  Vector("  weakest rotation", verdict.weakest_rotation(), out);
  Vector("  weakest translation", verdict.weakest_translation(), out);
  out.Text("weakest", verdict.weakest_description());
  out.Text("decided by", DecidedBy(verdict));
  out.Text("reason", verdict.message());
  out.Text("remedy", verdict.remedy());
}

void Describe(const v1::TargetSighting& target, test_support::GoldenText& out) {
  out.Word("  target", target.name());
  Vector("    in the scan", target.in_scan(), out);
  if (target.has_in_world()) Vector("    in the world", target.in_world(), out);
  if (target.has_sigma_m()) out.Numbers("    sigma", {target.sigma_m()});
}

void Describe(const ScanRecord& record, test_support::GoldenText& out) {
  const v1::Scan& scan = record.scan;
  out.Word("scan", scan.name());
  out.Word("  display name", scan.display_name());
  out.Counts("  state, pose source, in the model",
             {scan.state(), scan.pose_source(), record.in_model});
  out.Text("state", scan.state_message());
  Describe(scan.scanner_model(), out);
  if (scan.has_prior()) Describe(scan.prior(), out);
  if (scan.has_pose()) Pose("  pose", scan.pose(), out);
  if (scan.has_registration()) {
    const v1::Registration& r = scan.registration();
    Pose("  aligned", r.pose(), out);
    out.Counts("  converged, iterations, correspondences, model version",
               {r.converged(), r.iteration_count(), r.correspondence_count(),
                static_cast<int64_t>(r.model_version())});
    out.Numbers("  residual, expected, contradicting",
                {r.rms_residual_m(), r.expected_residual_m(), r.contradiction_share()});
    out.Numbers("  covariance", All(r.covariance()));
    Vector("  centroid", r.centroid(), out);
    out.Counts("  microseconds", {Microseconds(r.duration())});
    Describe(r.verdict(), out);
  }
  if (scan.has_levelling()) {
    Pose("  levelled", scan.levelling().pose(), out);
    out.Numbers("  tilt", {scan.levelling().tilt_rad()});
    out.Counts("  by inclinometer, floor found",
               {scan.levelling().from_inclinometer(), scan.levelling().found_floor()});
  }
  out.Counts("  columns, rows, samples, bytes", {scan.column_count(), scan.row_count(),
                                                 scan.sample_count(), scan.encoded_size_bytes()});
  out.Bytes("  sha256", scan.sha256());
  out.Bytes("  blob", record.blob);
  if (scan.has_merge()) {
    const v1::MergeReport& merge = scan.merge();
    out.Counts(
        "  merged: version, samples, empty, surface, bricks",
        {static_cast<int64_t>(merge.model_version()), merge.sample_count(),
         merge.empty_voxel_count(), merge.surface_voxel_count(), merge.changed_brick_count()});
    out.Counts("  microseconds",
               {Microseconds(merge.carve_duration()), Microseconds(merge.merge_duration())});
  }
  Time("  created", scan.create_time(), out);
  Time("  updated", scan.update_time(), out);
  out.Word("  upload", scan.upload());
  out.Word("  scanner", scan.scanner());
  for (const v1::TargetSighting& target : scan.targets()) Describe(target, out);
}

void Describe(const v1::Upload& upload, test_support::GoldenText& out) {
  out.Word("upload", upload.name());
  out.Word("  display name", upload.display_name());
  out.Word("  scanner model", upload.scanner_model_id());
  if (upload.has_scanner_model()) Describe(upload.scanner_model(), out);
  if (upload.has_prior()) Describe(upload.prior(), out);
  out.Counts("  state, announced bytes", {upload.state(), upload.total().encoded_size_bytes()});
  out.Bytes("  sha256", upload.total().sha256());
  out.Text("state", upload.state_message());
  out.Counts("  next piece, offset, credit, largest piece",
             {upload.next_sequence(), upload.next_offset(), upload.credit_offset(),
              upload.max_piece_size_bytes()});
  out.Word("  scan", upload.scan());
  Time("  created", upload.create_time(), out);
  Time("  expires", upload.expire_time(), out);
  out.Word("  scanner", upload.scanner());
  for (const v1::TargetSighting& target : upload.targets()) Describe(target, out);
}

void Describe(const v1::RankedView& view, test_support::GoldenText& out) {
  Vector("view", view.position(), out);
  out.Numbers("  score, lower, upper", {view.score(), view.score_lower(), view.score_upper()});
  out.Numbers("  area, lower, upper",
              {view.model_gain_m2(), view.model_gain_lower_m2(), view.model_gain_upper_m2()});
  out.Counts("  exact, oriented", {view.exact(), view.has_orientation()});
  Kinds("  by kind", view.score_by_kind(), out);
  out.Numbers("  height, clearance", {view.height_over_floor_m(), view.clearance_m()});
  if (view.has_storey()) {
    out.Counts("  storey, floor measured", {view.storey().number(), view.floor_measured()});
    out.Numbers("  storey's floor", {view.storey().floor_z_m()});
  }
  if (view.has_travel_distance_m()) out.Numbers("  travel", {view.travel_distance_m()});
  out.Text("unreachable", view.unreachable_message());
  for (const v1::PatchScore& gain : view.patch_scores()) {
    out.Counts("  patch, kind", {gain.patch_index(), gain.kind()});
    out.Numbers("    gain", {gain.score()});
    Vector("    centre", gain.centre(), out);
  }
  for (const v1::WallOffset& wall : view.location().walls()) {
    Vector("  wall", wall.wall_point(), out);
    Vector("    normal", wall.wall_normal(), out);
    out.Numbers("    distance", {wall.distance_m()});
  }
  out.Numbers("  from the last station: distance, bearing",
              {Given(view.location().has_last_station_distance_m(),
                     view.location().last_station_distance_m()),
               Given(view.location().has_last_station_bearing_rad(),
                     view.location().last_station_bearing_rad())});
  out.Text("where", view.location().description());
  Box("  good region", view.region().box(), out);
  out.Numbers("  good volume", {view.region().volume_m3()});
  out.Counts("  good cells", {view.region().viewcell_count()});
  Describe(view.verdict(), out);
  if (view.has_total_duration()) {
    out.Counts("  microseconds", {Microseconds(view.total_duration())});
  }
  if (view.has_score_per_minute()) out.Numbers("  gain a minute", {view.score_per_minute()});
}

void Describe(const v1::JointPlan& joint, test_support::GoldenText& out) {
  for (const v1::Assignment& assignment : joint.assignments()) {
    out.Word("assigned", assignment.scanner());
    out.Counts("  view", {assignment.has_view_index() ? assignment.view_index() : -1});
    out.Text("reason", assignment.message());
    for (const int other : assignment.waits_for_indices()) out.Counts("  waits for", {other});
    for (const std::string& claim : assignment.waits_for_claims()) {
      out.Word("  waits for claim", claim);
    }
  }
  out.Numbers("joint score, area", {joint.score(), joint.model_gain_m2()});
  if (joint.has_guarantee()) out.Numbers("guarantee", {joint.guarantee()});
  out.Text("guarantee", joint.guarantee_message());
  for (const std::string& claim : joint.claims()) out.Word("claim", claim);
}

void Describe(const v1::PlanResult& result, test_support::GoldenText& out) {
  out.Counts("outcome", {result.outcome()});
  out.Text("message", result.message());
  out.Counts("model version, seed, rays",
             {static_cast<int64_t>(result.model_version()), static_cast<int64_t>(result.seed()),
              static_cast<int64_t>(result.ray_count())});
  out.Numbers("optimality gap, confidence", {result.optimality_gap(), result.confidence()});
  out.Counts("complete, feasible, deficient, patches",
             {result.complete(), result.feasible_viewcell_count(), result.deficient_voxel_count(),
              result.patch_count()});
  out.Numbers("deficient area", {result.deficient_area_m2()});
  const v1::Termination& end = result.termination();
  out.Counts("termination: suggested", {end.suggested()});
  out.Numbers("termination: best upper, its area, largest patch",
              {Given(end.has_best_score_upper(), end.best_score_upper()),
               Given(end.has_best_model_gain_upper_m2(), end.best_model_gain_upper_m2()),
               end.largest_patch_area_m2()});
  if (end.has_unobservable_area_m2())
    out.Numbers("termination: unseeable", {end.unobservable_area_m2()});
  out.Text("termination", end.message());
  const v1::Coverage& coverage = result.coverage();
  Kinds("coverage: area by kind", coverage.area_by_kind_m2(), out);
  out.Numbers("coverage: at density, given up, share, density",
              {coverage.area_at_density_m2(), coverage.area_given_up_m2(),
               Given(coverage.has_estimated_coverage(), coverage.estimated_coverage()),
               coverage.required_density_per_m2()});
  for (const v1::StageDuration& stage : result.stage_durations()) {
    out.Text("stage", planning::kPlanStageNames.at(static_cast<size_t>(stage.stage()) - 1));
    out.Counts("microseconds", {Microseconds(stage.duration())});
  }
  if (result.has_config()) Describe(result.config(), out);
  out.Counts("views", {result.views_size()});
  for (const v1::RankedView& view : result.views()) Describe(view, out);
  out.Counts("refused", {result.refused_size()});
  for (const v1::RankedView& view : result.refused()) Describe(view, out);
  if (result.has_joint()) Describe(result.joint(), out);
  test_support::GoldenText patches;
  for (const v1::Patch& patch : result.patches()) {
    patches.Counts("patch", {patch.kind()});
    Vector("centre", patch.centre(), patches);
    Vector("normal", patch.normal(), patches);
    Vector("long axis", patch.axis_u(), patches);
    patches.Numbers("sides, area, mean density, deficit, importance",
                    {patch.length_u_m(), patch.length_v_m(), patch.area_m2(),
                     patch.mean_density_per_m2(), patch.deficit(), patch.importance()});
  }
  out.Lines("listed patches", patches);
  const v1::ScoreMap& map = result.score_map();
  test_support::GoldenText cells;
  Vector("origin", map.origin(), cells);
  cells.Numbers("cell size", {map.viewcell_size_m()});
  cells.Counts("cells", {map.total_viewcell_count()});
  for (const auto* column :
       {&map.x(), &map.y(), &map.z(), &map.score(), &map.score_lower(), &map.score_upper()}) {
    cells.Numbers("column", All(*column));
  }
  out.Lines("score map", cells);
}

void Describe(const PlanRecord& record, const store::Store& store, test_support::GoldenText& out) {
  const v1::Plan& plan = record.plan;
  out.Word("plan", plan.name());
  out.Word("  scanner model", plan.scanner_model_id());
  out.Counts("  budget: microseconds, work",
             {plan.time_budget().seconds() * 1'000'000 + plan.time_budget().nanos() / 1000,
              static_cast<int64_t>(plan.work_limit_rays())});
  if (plan.has_seed()) out.Counts("  seed", {static_cast<int64_t>(plan.seed())});
  if (plan.has_config_overrides()) Describe(plan.config_overrides(), out);
  out.Counts("  state, revision, ranking",
             {plan.state(), static_cast<int64_t>(plan.revision()), plan.ranking()});
  out.Text("state", plan.state_message());
  Time("  created", plan.create_time(), out);
  Time("  started", plan.start_time(), out);
  Time("  ended", plan.end_time(), out);
  for (const std::string& scanner : plan.scanners()) out.Word("  for", scanner);
  test_support::GoldenText basic;
  Describe(plan.result(), basic);
  if (record.blob.empty()) {
    out.Append(basic);
    return;
  }
  // The same and more.
  out.Lines("  in the log", basic);
  v1::PlanResult whole;
  const bool parsed = whole.ParseFromString(store.GetBlob(record.blob).value());
  store::Upgrade(whole);
  out.Counts("  whole result", {parsed});
  Describe(whole, out);
}

void Describe(const v1::Rejection& rejection, test_support::GoldenText& out) {
  out.Word("rejection", rejection.name());
  Vector("  position", rejection.position(), out);
  out.Numbers("  radius", {rejection.radius_m()});
  out.Word("  reason", rejection.reason());
  Time("  created", rejection.create_time(), out);
  if (rejection.has_expire_time()) Time("  expires", rejection.expire_time(), out);
}

void Describe(const v1::Scanner& scanner, test_support::GoldenText& out) {
  out.Word("scanner", scanner.name());
  out.Word("  display name", scanner.display_name());
  out.Word("  model", scanner.scanner_model_id());
  out.Word("  operator", scanner.operator_());
  if (scanner.has_last_pose()) Pose("  last pose", scanner.last_pose(), out);
  for (const v1::Box& box : scanner.reach()) Box("  reach", box, out);
  out.Numbers("  speed", {Given(scanner.has_speed_m_per_s(), scanner.speed_m_per_s())});
  out.Counts("  microseconds to scan", {Microseconds(scanner.scan_duration())});
  Time("  created", scanner.create_time(), out);
}

void Describe(const ClaimRecord& record, test_support::GoldenText& out) {
  const v1::Claim& claim = record.claim;
  out.Word("claim", claim.name());
  out.Word("  scanner", claim.scanner());
  Vector("  position", claim.position(), out);
  out.Word("  plan", claim.plan());
  Time("  created", claim.create_time(), out);
  Time("  expires", claim.expire_time(), out);
  out.Counts("  held", {record.held()});
  out.Text("ended", record.held() ? "" : conversion::Words(record.end_reason));
}

void Describe(const v1::Session& session, test_support::GoldenText& out) {
  out.Word("session", session.name());
  out.Word("display name", session.display_name());
  for (const v1::ScannerModel& model : session.scanner_models()) Describe(model, out);
  out.Numbers(
      "voxel, discontinuity angle",
      {Given(session.model_config().has_voxel_size_m(), session.model_config().voxel_size_m()),
       Given(session.model_config().has_discontinuity_angle_rad(),
             session.model_config().discontinuity_angle_rad())});
  Vector("half extent", session.model_config().max_half_extent(), out);
  Describe(session.planning_config(), out);
  if (session.site_rules().has_region_of_interest()) {
    Box("region of interest", session.site_rules().region_of_interest(), out);
  }
  for (const v1::Box& box : session.site_rules().keep_out()) Box("keep out", box, out);
  Vector("origin", session.origin(), out);
  Time("created", session.create_time(), out);
  Time("updated", session.update_time(), out);
}

}  // namespace

void Describe(const SessionState& state, const store::Store& store, test_support::GoldenText& out) {
  out.Word("tenant", state.tenant);
  Describe(state.session, out);
  out.Counts(
      "events, model version, uploads ever, rejections ever",
      {static_cast<int64_t>(state.last_sequence), static_cast<int64_t>(state.model_version),
       static_cast<int64_t>(state.upload_count), static_cast<int64_t>(state.rejection_count)});
  out.Word("last changed", state.last_resource);
  for (const std::string& name : state.scan_order) {
    Describe(state.scans.at(name), out);
    const std::string& blob = state.scans.at(name).blob;
    if (!blob.empty()) out.Bytes("  range image", store.GetBlob(blob).value());
  }
  for (const auto& [name, upload] : state.uploads) Describe(upload, out);
  for (const std::string& name : state.plan_order) Describe(state.plans.at(name), store, out);
  for (const v1::Rejection& rejection : state.rejections) Describe(rejection, out);
  for (const std::string& name : state.scanner_order) Describe(state.scanners.at(name), out);
  for (const auto& [name, claim] : state.claims) Describe(claim, out);
  for (const std::string& name : state.held_claims) out.Word("held claim", name);
  for (const auto& [id, request] : state.requests) {
    out.Word("request", id);
    out.Word("  method", request.method);
    out.Bytes("  fingerprint", request.fingerprint);
    out.Word("  made", request.resource);
  }
}

void DescribeSpools(const store::Store& store, test_support::GoldenText& out) {
  const std::vector<std::string> spools = store.Spools().value();
  for (const std::string& name : spools) {
    out.Section("what an upload brought");
    const absl::Status read = store.ReadSpool(name, [&](absl::string_view bytes) -> absl::Status {
      storage::v1::SpoolRecord record;
      if (!record.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
        return absl::DataLossError("no record");
      }
      if (record.has_piece()) {
        out.Bytes("piece", record.piece().data());
        out.Bits("  crc32c", record.piece().crc32c());
        out.Counts("  compression, size",
                   {record.piece().compression(), record.piece().uncompressed_size_bytes()});
      }
      if (record.has_total()) {
        out.Counts("total", {record.total().encoded_size_bytes()});
        out.Bytes("  sha256", record.total().sha256());
      }
      return absl::OkStatus();
    });
    out.Counts("read", {read.ok()});
  }
}

}  // namespace vantage::session

#include "tests/server/session/describe_state.h"

#include <cmath>
#include <vector>

#include "absl/strings/str_cat.h"

namespace vantage {
namespace {

// Times as whole microseconds: seconds in a double and durations say the same.
int64_t Microseconds(double seconds) { return std::llround(seconds * 1e6); }

void Time(absl::string_view label, const google::protobuf::Timestamp& time, GoldenText& out) {
  out.Counts(label, {time.seconds(), time.nanos()});
}

void Vector(absl::string_view label, const v1::Vector3& v, GoldenText& out) {
  out.Numbers(label, {v.x(), v.y(), v.z()});
}

void Box(absl::string_view label, const v1::Box& box, GoldenText& out) {
  out.Numbers(label, {box.min().x(), box.min().y(), box.min().z(), box.max().x(), box.max().y(),
                      box.max().z()});
}

void Pose(absl::string_view label, const v1::Pose& pose, GoldenText& out) {
  out.Numbers(label,
              {pose.rotation().w(), pose.rotation().x(), pose.rotation().y(), pose.rotation().z(),
               pose.translation().x(), pose.translation().y(), pose.translation().z()});
}

void Kinds(absl::string_view label, const v1::BySurfaceKind& kinds, GoldenText& out) {
  out.Numbers(label, {kinds.true_surface(), kinds.occlusion(), kinds.hole_boundary(),
                      kinds.image_boundary()});
}

template <typename Repeated>
std::vector<double> All(const Repeated& values) {
  return {values.begin(), values.end()};
}

void Describe(const v1::PosePrior& prior, GoldenText& out) {
  Pose("  prior", prior.pose(), out);
  out.Numbers("  prior covariance", All(prior.covariance()));
  if (prior.has_levelled_sigma()) out.Numbers("  prior levelled", {prior.levelled_sigma()});
  out.Counts("  prior trusted", {prior.trusted()});
}

void Describe(const v1::ScannerModel& model, GoldenText& out) {
  out.Word("scanner model", model.id());
  out.Numbers("  span, elevations, steps",
              {model.azimuth_span(), model.elevation_min(), model.elevation_max(),
               model.azimuth_step(), model.elevation_step()});
  out.Numbers("  ranges, noise, noise ppm, incidence, clearance, positioning",
              {model.range_min(), model.range_max(), model.range_noise(), model.range_noise_ppm(),
               model.max_incidence(), model.clearance(), model.positioning_error()});
}

void Describe(const v1::PlanningConfig& c, GoldenText& out) {
  out.Numbers("  required density, viewcell, density tolerance",
              {c.required_density(), c.viewcell_size(), c.density_tolerance()});
  out.Numbers("  heights, width, height of the scanner",
              {c.min_height(), c.max_height(), c.scanner_width(), c.scanner_height()});
  if (c.has_floor_height()) out.Numbers("  floor", {c.floor_height()});
  out.Counts("  reachable, pose sensitivity, density on false surface, order",
             {c.require_reachable(), c.pose_sensitivity(), c.density_on_false_surface(),
              c.evaluation_order()});
  out.Numbers("  weights", {c.weights().true_surface(), c.weights().occlusion(),
                            c.weights().hole_boundary(), c.weights().image_boundary()});
  out.Numbers("  least deficit, counts from, depth behind",
              {c.least_deficit(), c.counts_from(), c.depth_behind()});
  out.Numbers("  separation, terminate below, least patch, confidence",
              {c.separation(), c.terminate_below(), c.min_patch_area(), c.confidence()});
  out.Counts("  candidates, most checked", {c.candidates(), c.max_checked()});
  const v1::RegistrationConfig& r = c.registration();
  out.Numbers(
      "  accuracy, overlap, correlation length and sigma",
      {r.required_accuracy(), r.minimum_overlap(), r.correlation_length(), r.correlated_sigma()});
  out.Numbers("  normal sigma, spacing, correspondence",
              {r.normal_sigma(), r.sample_spacing(), r.max_correspondence()});
  out.Counts("  draws, seed", {r.draws(), r.seed()});
}

void Describe(const v1::RegistrationVerdict& verdict, GoldenText& out) {
  out.Counts("  verdict", {verdict.outcome()});
  out.Numbers("  overlap, error bound, rigorous bound, strength",
              {verdict.overlap_share(), verdict.error_bound(), verdict.rigorous_bound(),
               verdict.strength()});
  Vector("  weakest rotation", verdict.weakest_rotation(), out);
  Vector("  weakest translation", verdict.weakest_translation(), out);
  out.Text("weakest", verdict.weakest_words());
  out.Text("decided by", verdict.decided_by());
  out.Text("reason", verdict.reason());
  out.Text("remedy", verdict.remedy());
}

void Describe(const v1::TargetSighting& target, GoldenText& out) {
  out.Word("  target", target.name());
  Vector("    in the scan", target.in_scan(), out);
  if (target.has_in_world()) Vector("    in the world", target.in_world(), out);
  if (target.has_sigma()) out.Numbers("    sigma", {target.sigma()});
}

void Describe(const ScanRecord& record, GoldenText& out) {
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
               {r.converged(), r.iterations(), r.correspondences(),
                static_cast<int64_t>(r.model_version())});
    out.Numbers("  residual, expected, contradicting",
                {r.rms_residual(), r.expected_residual(), r.contradiction_share()});
    out.Numbers("  covariance", All(r.covariance()));
    Vector("  centroid", r.centroid(), out);
    out.Counts("  microseconds", {Microseconds(r.seconds())});
    Describe(r.verdict(), out);
  }
  if (scan.has_levelling()) {
    Pose("  levelled", scan.levelling().pose(), out);
    out.Numbers("  tilt", {scan.levelling().tilt()});
    out.Counts("  by inclinometer, floor found",
               {scan.levelling().from_inclinometer(), scan.levelling().found_floor()});
  }
  out.Counts("  columns, rows, samples, bytes",
             {scan.columns(), scan.rows(), scan.samples(), scan.encoded_size()});
  out.Bytes("  sha256", scan.sha256());
  out.Bytes("  blob", record.blob);
  if (scan.has_merge()) {
    const v1::MergeReport& merge = scan.merge();
    out.Counts("  merged: version, samples, empty, surface, bricks",
               {static_cast<int64_t>(merge.model_version()), merge.samples(), merge.empty_voxels(),
                merge.surface_voxels(), merge.changed_bricks()});
    out.Counts("  microseconds",
               {Microseconds(merge.carve_seconds()), Microseconds(merge.merge_seconds())});
  }
  Time("  created", scan.create_time(), out);
  Time("  updated", scan.update_time(), out);
  out.Word("  upload", scan.upload());
  out.Word("  scanner", scan.scanner());
  for (const v1::TargetSighting& target : scan.targets()) Describe(target, out);
}

void Describe(const v1::Upload& upload, GoldenText& out) {
  out.Word("upload", upload.name());
  out.Word("  display name", upload.display_name());
  out.Word("  scanner model", upload.scanner_model_id());
  if (upload.has_scanner_model()) Describe(upload.scanner_model(), out);
  if (upload.has_prior()) Describe(upload.prior(), out);
  out.Counts("  state, announced bytes", {upload.state(), upload.total().encoded_size()});
  out.Bytes("  sha256", upload.total().sha256());
  out.Text("state", upload.state_message());
  out.Counts("  next piece, offset, credit, largest piece",
             {upload.next_sequence(), upload.next_offset(), upload.credit_offset(),
              upload.max_piece_size()});
  out.Word("  scan", upload.scan());
  Time("  created", upload.create_time(), out);
  Time("  expires", upload.expire_time(), out);
  out.Word("  scanner", upload.scanner());
  for (const v1::TargetSighting& target : upload.targets()) Describe(target, out);
}

void Describe(const v1::RankedView& view, GoldenText& out) {
  Vector("view", view.position(), out);
  out.Numbers("  score, lower, upper", {view.score(), view.lower(), view.upper()});
  out.Numbers("  area, lower, upper", {view.area(), view.area_lower(), view.area_upper()});
  out.Counts("  exact, oriented", {view.exact(), view.has_orientation()});
  Kinds("  by kind", view.gain_by_kind(), out);
  out.Numbers("  height, clearance", {view.height_over_floor(), view.clearance()});
  if (view.has_travel()) out.Numbers("  travel", {view.travel()});
  out.Text("unreachable", view.unreachable());
  for (const v1::PatchGain& gain : view.patches()) {
    out.Counts("  patch, kind", {gain.patch(), gain.kind()});
    out.Numbers("    gain", {gain.gain()});
    Vector("    centre", gain.centre(), out);
  }
  for (const v1::WallOffset& wall : view.where().walls()) {
    Vector("  wall", wall.wall_point(), out);
    Vector("    normal", wall.wall_normal(), out);
    out.Numbers("    distance", {wall.distance()});
  }
  out.Numbers("  from the last station: distance, bearing",
              {view.where().last_stand_distance(), view.where().last_stand_bearing()});
  out.Text("where", view.where().words());
  Box("  good region", view.region().box(), out);
  out.Numbers("  good volume", {view.region().volume()});
  out.Counts("  good cells", {view.region().cells()});
  Describe(view.verdict(), out);
  if (view.has_minutes()) out.Counts("  microseconds", {Microseconds(view.minutes() * 60)});
  if (view.has_gain_per_minute()) out.Numbers("  gain a minute", {view.gain_per_minute()});
}

void Describe(const v1::JointPlan& joint, GoldenText& out) {
  for (const v1::Assignment& assignment : joint.assignments()) {
    out.Word("assigned", assignment.scanner());
    out.Counts("  view", {assignment.has_view() ? assignment.view() : -1});
    out.Text("reason", assignment.reason());
    for (const int other : assignment.waits_for()) out.Counts("  waits for", {other});
    for (const std::string& claim : assignment.waits_for_claims()) {
      out.Word("  waits for claim", claim);
    }
  }
  out.Numbers("joint score, area", {joint.score(), joint.area()});
  if (joint.has_guarantee()) out.Numbers("guarantee", {joint.guarantee()});
  out.Text("guarantee", joint.guarantee_reason());
  for (const std::string& claim : joint.claims()) out.Word("claim", claim);
}

void Describe(const v1::PlanResult& result, GoldenText& out) {
  out.Counts("outcome", {result.outcome()});
  out.Text("message", result.message());
  out.Counts("model version, seed, rays",
             {static_cast<int64_t>(result.model_version()), static_cast<int64_t>(result.seed()),
              static_cast<int64_t>(result.rays())});
  out.Numbers("optimality gap, confidence", {result.optimality_gap(), result.confidence()});
  out.Counts(
      "complete, feasible, deficient, patches",
      {result.complete(), result.feasible_cells(), result.needy_cells(), result.patch_count()});
  out.Numbers("deficient area", {result.needy_area()});
  const v1::Termination& end = result.termination();
  out.Counts("termination: suggested", {end.suggested()});
  out.Numbers("termination: best upper, its area, largest patch",
              {end.best_upper(), end.best_upper_area(), end.largest_patch_area()});
  if (end.has_unseeable_area()) out.Numbers("termination: unseeable", {end.unseeable_area()});
  out.Text("termination", end.reason());
  const v1::Coverage& coverage = result.coverage();
  Kinds("coverage: area by kind", coverage.area(), out);
  out.Numbers("coverage: at density, given up, share, density",
              {coverage.area_at_density(), coverage.area_given_up(), coverage.estimated_coverage(),
               coverage.required_density()});
  for (const v1::StageSeconds& stage : result.stages()) {
    out.Text("stage", stage.stage());
    out.Counts("microseconds", {Microseconds(stage.seconds())});
  }
  if (result.has_config()) Describe(result.config(), out);
  out.Counts("views", {result.views_size()});
  for (const v1::RankedView& view : result.views()) Describe(view, out);
  out.Counts("refused", {result.refused_size()});
  for (const v1::RankedView& view : result.refused()) Describe(view, out);
  if (result.has_joint()) Describe(result.joint(), out);
  GoldenText patches;
  for (const v1::Patch& patch : result.patches()) {
    patches.Counts("patch", {patch.kind()});
    Vector("centre", patch.centre(), patches);
    Vector("normal", patch.normal(), patches);
    Vector("long axis", patch.axis_u(), patches);
    patches.Numbers("sides, area, mean density, deficit, importance",
                    {patch.length_u(), patch.length_v(), patch.area(), patch.mean_density(),
                     patch.deficit(), patch.importance()});
  }
  out.Lines("listed patches", patches);
  const v1::ScoreMap& map = result.score_map();
  GoldenText cells;
  Vector("origin", map.origin(), cells);
  cells.Numbers("cell size", {map.cell_size()});
  cells.Counts("cells", {map.total_cells()});
  for (const auto* column :
       {&map.x(), &map.y(), &map.z(), &map.score(), &map.lower(), &map.upper()}) {
    cells.Numbers("column", All(*column));
  }
  out.Lines("score map", cells);
}

void Describe(const PlanRecord& record, const Store& store, GoldenText& out) {
  const v1::Plan& plan = record.plan;
  out.Word("plan", plan.name());
  out.Word("  scanner model", plan.scanner_model_id());
  out.Counts("  budget: microseconds, work",
             {plan.time_budget().seconds() * 1'000'000 + plan.time_budget().nanos() / 1000,
              static_cast<int64_t>(plan.work_limit())});
  if (plan.has_seed()) out.Counts("  seed", {static_cast<int64_t>(plan.seed())});
  if (plan.has_config_overrides()) Describe(plan.config_overrides(), out);
  out.Counts("  state, revision, ranking",
             {plan.state(), static_cast<int64_t>(plan.revision()), plan.ranking()});
  out.Text("state", plan.state_message());
  Time("  created", plan.create_time(), out);
  Time("  started", plan.start_time(), out);
  Time("  ended", plan.end_time(), out);
  for (const std::string& scanner : plan.scanners()) out.Word("  for", scanner);
  GoldenText basic;
  Describe(plan.result(), basic);
  if (record.blob.empty()) {
    out.Append(basic);
    return;
  }
  // The same and more.
  out.Lines("  in the log", basic);
  v1::PlanResult whole;
  const bool parsed = whole.ParseFromString(store.GetBlob(record.blob).value());
  out.Counts("  whole result", {parsed});
  Describe(whole, out);
}

void Describe(const v1::ViewRejection& rejection, GoldenText& out) {
  out.Word("rejection", rejection.name());
  Vector("  position", rejection.position(), out);
  out.Numbers("  radius", {rejection.radius()});
  out.Word("  reason", rejection.reason());
  Time("  created", rejection.create_time(), out);
  if (rejection.has_expire_time()) Time("  expires", rejection.expire_time(), out);
}

void Describe(const v1::Scanner& scanner, GoldenText& out) {
  out.Word("scanner", scanner.name());
  out.Word("  display name", scanner.display_name());
  out.Word("  model", scanner.scanner_model_id());
  out.Word("  operator", scanner.operator_());
  if (scanner.has_last_pose()) Pose("  last pose", scanner.last_pose(), out);
  for (const v1::Box& box : scanner.reach()) Box("  reach", box, out);
  out.Numbers("  speed", {scanner.speed()});
  out.Counts("  microseconds to scan", {Microseconds(scanner.scan_seconds())});
  Time("  created", scanner.create_time(), out);
}

void Describe(const ClaimRecord& record, GoldenText& out) {
  const v1::Claim& claim = record.claim;
  out.Word("claim", claim.name());
  out.Word("  scanner", claim.scanner());
  Vector("  position", claim.position(), out);
  out.Word("  plan", claim.plan());
  Time("  created", claim.create_time(), out);
  Time("  expires", claim.expire_time(), out);
  out.Counts("  held", {record.held()});
  out.Text("ended", record.ended);
}

void Describe(const v1::Session& session, GoldenText& out) {
  out.Word("session", session.name());
  out.Word("display name", session.display_name());
  for (const v1::ScannerModel& model : session.scanner_models()) Describe(model, out);
  out.Numbers("voxel, discontinuity angle",
              {session.model_config().voxel_size(), session.model_config().discontinuity_angle()});
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

void Describe(const SessionState& state, const Store& store, GoldenText& out) {
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
  for (const v1::ViewRejection& rejection : state.rejections) Describe(rejection, out);
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

void DescribeSpools(const Store& store, GoldenText& out) {
  const std::vector<std::string> spools = store.Spools().value();
  for (const std::string& name : spools) {
    out.Section("what an upload brought");
    const absl::Status read = store.ReadSpool(name, [&](absl::string_view bytes) -> absl::Status {
      store::v1::SpoolRecord record;
      if (!record.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
        return absl::DataLossError("no record");
      }
      if (record.has_piece()) {
        out.Bytes("piece", record.piece().data());
        out.Bits("  crc32c", record.piece().crc32c());
        out.Counts("  compression, size", {record.piece().compression(), record.piece().size()});
      }
      if (record.has_total()) {
        out.Counts("total", {record.total().encoded_size()});
        out.Bytes("  sha256", record.total().sha256());
      }
      return absl::OkStatus();
    });
    out.Counts("read", {read.ok()});
  }
}

}  // namespace vantage

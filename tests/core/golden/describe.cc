#include "tests/core/golden/describe.h"

#include <array>
#include <span>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"

namespace vantage::golden {
namespace {

// Of a list, the first are written out; a hash says the rest.
constexpr size_t kPatchesInClear = 2;
constexpr size_t kViewsInClear = 1;

int64_t Whole(size_t count) { return static_cast<int64_t>(count); }
template <typename Enum>
int64_t ValueOf(Enum value) {
  return static_cast<int64_t>(value);
}

void Describe(const planning::Patch& patch, test_support::GoldenText& out) {
  out.Counts("patch: kind, cells", {ValueOf(patch.kind), Whole(patch.cells.size())});
  out.Numbers("  centre", patch.centre);
  out.Numbers("  normal", patch.normal);
  out.Numbers("  long axis", patch.axis_u);
  out.Numbers("  sides, area, mean density, deficit, importance",
              {patch.length_u, patch.length_v, patch.area, patch.mean_density, patch.deficit,
               patch.importance});
  const std::vector<int64_t> cells(patch.cells.begin(), patch.cells.end());
  test_support::GoldenText list;
  list.Counts("cells", cells);
  out.Lines("  cells", list);
}

void Describe(std::span<const planning::Patch> patches, test_support::GoldenText& out) {
  test_support::GoldenText all;
  for (size_t i = 0; i < patches.size(); ++i) {
    Describe(patches[i], all);
    if (i < kPatchesInClear) Describe(patches[i], out);
  }
  out.Counts("patches", {Whole(patches.size())});
  out.Lines("all patches", all);
}

void Describe(const std::string& label, const std::vector<planning::RankedView>& views,
              test_support::GoldenText& out) {
  test_support::GoldenText all;
  out.Counts(label, {Whole(views.size())});
  for (size_t i = 0; i < views.size(); ++i) {
    golden::Describe(views[i], all);
    if (i < kViewsInClear) golden::Describe(views[i], out);
  }
  out.Lines(absl::StrCat("all ", label), all);
}

void Describe(const model::PlanningView& model, test_support::GoldenText& out) {
  out.Numbers("voxel size", {model.voxel_size()});
  out.Counts("version", {static_cast<int64_t>(model.version())});
  for (const model::Station& station : model.stations()) {
    out.Numbers("station", station.position);
    out.Numbers("  floor height, clearance", {station.floor_height, station.clearance});
    out.Counts("  floor found", {station.floor_found});
  }
  std::array<int64_t, model::kVoxelStates> voxels{};
  test_support::GoldenText states;
  test_support::GoldenText lost;
  int64_t bricks = 0;
  for (const model::BrickAt& at : model.bricks()) {
    ++bricks;
    std::string line;
    for (const model::VoxelState state : at.contents->state) {
      ++voxels[static_cast<size_t>(state)];
      line += static_cast<char>('0' + static_cast<int>(state));
    }
    states.Word(absl::StrCat(at.brick.x(), " ", at.brick.y(), " ", at.brick.z()), line);
    for (const model::Dropout& from : at.contents->dropouts) {
      lost.Numbers(absl::StrCat(from.local), from.from.cast<double>());
    }
  }
  out.Counts("bricks", {bricks});
  out.Counts("voxels by state", voxels);
  out.Lines("states", states);
  test_support::GoldenText surface;
  model.ForEachSurface(
      [&](const model::VoxelIndex& at, model::VoxelState state, const model::SurfaceVoxel& voxel) {
        surface.Counts("voxel", {at.x(), at.y(), at.z(), ValueOf(state), voxel.samples,
                                 voxel.missed, voxel.spread, voxel.ambiguous, voxel.given_up});
        surface.Numbers("centroid", voxel.centroid.cast<double>());
        surface.Numbers("normal", voxel.normal.cast<double>());
        surface.Numbers("area, density", {voxel.area, voxel.density});
      });
  out.Counts("surface voxels", {Whole(model.SurfaceCount())});
  out.Lines("surface", surface);
  out.Lines("rays that did not come back", lost);
}

}  // namespace

void Describe(const Eigen::Isometry3d& pose, test_support::GoldenText& out) {
  for (int row = 0; row < 3; ++row) {
    out.Numbers("pose", {pose.matrix()(row, 0), pose.matrix()(row, 1), pose.matrix()(row, 2),
                         pose.matrix()(row, 3)});
  }
}

void Describe(const registration::RegistrationVerdict& verdict, test_support::GoldenText& out) {
  out.Counts("verdict", {ValueOf(verdict.outcome)});
  out.Numbers("  overlap", {verdict.overlap_share});
  out.Numbers("  error bound, without the prior, rigorous",
              {verdict.error_bound, verdict.judged_bound, verdict.rigorous_bound});
  out.Numbers("  strength", {verdict.strength});
  out.Numbers("  weakest", std::span<const double>(verdict.weakest.data(), 6));
  out.Text("weakest", verdict.weakest_words);
  out.Text("decided by", registration::BasesText(verdict.bases));
  out.Text("reason", verdict.reason);
  out.Text("remedy", verdict.remedy);
}

void Describe(const registration::RegistrationResult& result, test_support::GoldenText& out) {
  Describe(result.T_world_scan, out);
  out.Counts("converged, iterations, correspondences",
             {result.converged, result.iterations, Whole(result.correspondences)});
  out.Numbers("residual, expected, contradicting",
              {result.rms_residual, result.expected_residual, result.contradiction_share});
  for (int row = 0; row < 6; ++row) {
    const sensor::Vector6d values = result.covariance.row(row);
    out.Numbers("covariance", std::span<const double>(values.data(), 6));
  }
  out.Numbers("centroid", result.centroid);
  Describe(result.verdict, out);
}

void Describe(const model::MergeReport& report, test_support::GoldenText& out) {
  out.Counts("version, samples", {static_cast<int64_t>(report.version), Whole(report.samples)});
  out.Counts("voxels: empty, surface", {Whole(report.empty_voxels), Whole(report.surface_voxels)});
  out.Counts(
      "bricks: computed anew, changed; pages",
      {Whole(report.recomputed_bricks), Whole(report.changed_bricks), Whole(report.copied_pages)});
}

void Describe(const model::PartialModel& model, parallel::Parallel& parallel,
              test_support::GoldenText& out) {
  for (const std::string& scan : model.scans()) out.Word("scan", scan);
  out.Bits("digest", model.Digest());
  out.Counts("algorithms", {model.algorithm_version()});
  out.Bytes("saved", model.Save(parallel));
  Describe(*model.Publish(), out);
}

void Describe(const planning::RankedView& view, test_support::GoldenText& out) {
  out.Numbers("view", view.position);
  out.Numbers("  score, lower, upper", {view.score, view.lower, view.upper});
  out.Counts("  exact", {view.exact});
  out.Numbers("  by kind", view.score_by_kind);
  out.Numbers("  height, clearance", {view.height_over_floor, view.clearance});
  if (view.travel.has_value()) out.Numbers("  travel", {*view.travel});
  for (const planning::PatchScore& score : view.patch_scores) {
    out.Numbers(absl::StrCat("  gains on patch ", score.patch), {score.score});
  }
  for (const planning::WallOffset& wall : view.location.walls) {
    out.Numbers("  wall", wall.wall_point);
    out.Numbers("    normal", wall.wall_normal);
    out.Numbers("    distance", {wall.distance});
  }
  out.Numbers("  from the last station: distance, bearing",
              {view.location.last_station_distance.value_or(0),
               view.location.last_station_bearing.value_or(0)});
  out.Text("where", view.location.description);
  out.Numbers("  good from", view.region.box.min());
  out.Numbers("  good to", view.region.box.max());
  out.Numbers("  good volume", {view.region.volume});
  out.Counts("  good cells", {view.region.viewcell_count});
  Describe(view.verdict, out);
}

void Describe(const planning::Coverage& coverage, test_support::GoldenText& out) {
  out.Numbers("coverage: area by kind", coverage.area);
  out.Numbers(
      "coverage: at density, given up, share",
      {coverage.area_at_density, coverage.area_given_up, coverage.estimated_coverage.value_or(0)});
  out.Numbers("coverage: out of reach", {coverage.area_out_of_reach});
}

void Describe(const planning::Plan& plan, test_support::GoldenText& out) {
  out.Counts("outcome", {ValueOf(plan.outcome)});
  out.Text("message", plan.message);
  out.Counts("model version, seed",
             {static_cast<int64_t>(plan.model_version), static_cast<int64_t>(plan.seed)});
  out.Counts("complete, feasible, deficient, rays",
             {plan.complete, Whole(plan.feasible_cells), Whole(plan.deficient_cells),
              static_cast<int64_t>(plan.rays)});
  out.Numbers("deficient area, optimality gap, confidence, density",
              {plan.deficient_area, plan.optimality_gap, plan.confidence, plan.required_density});
  const planning::Termination& end = plan.termination;
  out.Counts("termination: suggested, unseeable known", {end.suggested, end.unobservable_known});
  out.Numbers("termination: best upper, largest patch, unseeable",
              {end.best_upper.value_or(0), end.largest_patch_area, end.unobservable_area});
  out.Text("termination", end.reason);
  Describe(plan.coverage.value_or(planning::Coverage()), out);
  Describe("view", plan.views, out);
  Describe("refused", plan.refused, out);
  Describe(plan.patches, out);
  test_support::GoldenText map;
  for (const planning::ScoredCell& cell : plan.score_map) {
    map.Numbers("cell", cell.centre.cast<double>());
    map.Numbers("score, lower, upper", {cell.score, cell.lower, cell.upper});
  }
  out.Lines("score map", map);
}

void Describe(const planning::ViewEvaluation& evaluation, test_support::GoldenText& out) {
  out.Counts("feasible", {evaluation.feasible});
  out.Text("why not", evaluation.infeasible_message);
  Describe(evaluation.view, out);
  Describe(evaluation.patches, out);
}

void Describe(const fleet::JointPlan& joint, test_support::GoldenText& out) {
  out.Numbers("joint score", {joint.score});
  if (joint.guarantee.has_value()) out.Numbers("guarantee", {*joint.guarantee});
  out.Text("guarantee", joint.guarantee_reason);
  for (const fleet::Assignment& assignment : joint.assignments) {
    out.Counts(
        "assigned: scanner, view",
        {Whole(assignment.scanner), assignment.view.has_value() ? Whole(*assignment.view) : -1});
    out.Text("reason", assignment.reason);
    const std::vector<int64_t> others(assignment.waits_for.begin(), assignment.waits_for.end());
    out.Counts("  waits for", others);
    const std::vector<int64_t> claims(assignment.waits_for_pledged.begin(),
                                      assignment.waits_for_pledged.end());
    out.Counts("  waits for claims", claims);
  }
  for (const fleet::Journey& journey : joint.journeys) {
    out.Numbers("journey: length, minutes, gain a minute",
                {journey.length.value_or(-1), journey.minutes.value_or(-1),
                 journey.per_minute.value_or(-1)});
    out.Text("unreachable", journey.unreachable);
  }
  Describe(joint.plan, out);
}

}  // namespace vantage::golden

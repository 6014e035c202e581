#include "client/cli/report.h"

#include <google/protobuf/util/time_util.h>

#include <cmath>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/strip.h"
#include "client/cli/table.h"
#include "client/library/geometry.h"

namespace vantage {
namespace {

std::string Lower(const std::string& name, absl::string_view prefix) {
  std::string word(absl::StripPrefix(name, prefix));
  absl::AsciiStrToLower(&word);
  return absl::StrReplaceAll(word, {{"_", " "}});
}

std::string SquareMetres(double area) { return absl::StrFormat("%.2f", area); }

void AddViews(const google::protobuf::RepeatedPtrField<v1::RankedView>& views, bool refused,
              Table& table) {
  for (int i = 0; i < views.size(); ++i) {
    const v1::RankedView& view = views[i];
    table.Add({refused ? "-" : absl::StrCat(i + 1), Text(view.position()),
               absl::StrFormat("%.2f", view.height_over_floor()), SquareMetres(view.area()),
               absl::StrFormat("%.2f..%.2f", view.area_lower(), view.area_upper()),
               view.has_travel() ? absl::StrFormat("%.1f", view.travel()) : "",
               Word(view.verdict().outcome()), Percent(view.verdict().overlap_share()),
               Length(view.verdict().error_bound()),
               refused ? view.verdict().remedy() : view.where().words()});
  }
}

}  // namespace

std::string Word(v1::ScanState state) { return Lower(v1::ScanState_Name(state), "SCAN_STATE_"); }
std::string Word(v1::PoseSource source) {
  return Lower(v1::PoseSource_Name(source), "POSE_SOURCE_");
}
std::string Word(v1::PlanState state) { return Lower(v1::PlanState_Name(state), "PLAN_STATE_"); }
std::string Word(v1::PlanOutcome outcome) {
  return Lower(v1::PlanOutcome_Name(outcome), "PLAN_OUTCOME_");
}
std::string Word(v1::RegistrationOutcome outcome) {
  return Lower(v1::RegistrationOutcome_Name(outcome), "REGISTRATION_OUTCOME_");
}

std::string Text(const v1::Vector3& v) {
  return absl::StrFormat("(%.2f, %.2f, %.2f)", v.x(), v.y(), v.z());
}

std::string Text(const v1::Pose& pose) {
  const Eigen::Matrix3d r = FromProto(pose).linear();
  const double yaw = std::atan2(r(1, 0), r(0, 0)) * 180 / 3.14159265358979;
  return absl::StrFormat("(%.3f, %.3f, %.3f), heading %.2f\u00b0", pose.translation().x(),
                         pose.translation().y(), pose.translation().z(), yaw);
}

std::string Length(double metres) {
  if (!std::isfinite(metres) || metres > 1000) return "unbounded";
  if (metres < 0.01) return absl::StrFormat("%.1f mm", metres * 1000);
  if (metres < 1) return absl::StrFormat("%.1f cm", metres * 100);
  return absl::StrFormat("%.2f m", metres);
}

std::string Bytes(double bytes) {
  if (bytes < 1e6) return absl::StrFormat("%.0f kB", bytes / 1e3);
  return absl::StrFormat("%.1f MB", bytes / 1e6);
}

std::string Percent(double share) { return absl::StrFormat("%.0f %%", share * 100); }

std::string Seconds(double seconds) { return absl::StrFormat("%.2f s", seconds); }

std::string Time(const google::protobuf::Timestamp& time) {
  std::string text = google::protobuf::util::TimeUtil::ToString(time);
  if (const size_t dot = text.find('.'); dot != std::string::npos) text = text.substr(0, dot) + "Z";
  return text;
}

std::string VerdictFigures(const v1::RegistrationVerdict& verdict) {
  std::string line = absl::StrFormat("%s: overlap %s, error bound %s, strength %.2f",
                                     Word(verdict.outcome()), Percent(verdict.overlap_share()),
                                     Length(verdict.error_bound()), verdict.strength());
  if (!verdict.weakest_words().empty())
    absl::StrAppend(&line, ", weakest ", verdict.weakest_words());
  if (!verdict.decided_by().empty()) {
    absl::StrAppend(&line, ", decided by ", verdict.decided_by());
  }
  return line;
}

std::string VerdictLine(const v1::RegistrationVerdict& verdict) {
  std::string line = VerdictFigures(verdict);
  if (!verdict.reason().empty()) absl::StrAppend(&line, "; ", verdict.reason());
  if (!verdict.remedy().empty()) absl::StrAppend(&line, "; remedy: ", verdict.remedy());
  return line;
}

std::string SessionReport(const v1::Session& session) {
  const v1::ScanCounts& n = session.scan_counts();
  const v1::PlanningConfig& p = session.planning_config();
  std::string out = absl::StrFormat(
      "%s%s\n", IdOf(session.name()),
      session.display_name().empty() ? "" : absl::StrCat("  ", session.display_name()));
  absl::StrAppendFormat(&out, "  created   %s, last event %d\n", Time(session.create_time()),
                        session.last_sequence());
  absl::StrAppendFormat(&out,
                        "  scans     %d merged, %d pending, %d doubtful, %d failed, %d withdrawn; "
                        "model version %d\n",
                        n.merged(), n.pending(), n.doubtful(), n.failed(), n.withdrawn(),
                        session.model_version());
  absl::StrAppendFormat(&out, "  model     voxel %s, origin %s\n",
                        Length(session.model_config().voxel_size()), Text(session.origin()));
  absl::StrAppendFormat(
      &out,
      "  planning  density %.0f /m\u00b2, viewcell %s, heights %.2f to %.2f m, stop below %.2f "
      "m\u00b2\n",
      p.required_density(), Length(p.viewcell_size()), p.min_height(), p.max_height(),
      p.terminate_below());
  absl::StrAppendFormat(&out, "  register  to %s at 95 %%, overlap at least %s\n",
                        Length(p.registration().required_accuracy()),
                        Percent(p.registration().minimum_overlap()));
  for (const v1::ScannerModel& s : session.scanner_models()) {
    absl::StrAppendFormat(&out,
                          "  scanner   %s: %.3f\u00b0 x %.3f\u00b0, elevation %.0f\u00b0 to "
                          "%.0f\u00b0, range %.1f to %.0f m, noise %s\n",
                          s.id(), Degrees(s.azimuth_step()), Degrees(s.elevation_step()),
                          Degrees(s.elevation_min()), Degrees(s.elevation_max()), s.range_min(),
                          s.range_max(), Length(s.range_noise()));
  }
  for (const v1::ViewRejection& r : session.rejections()) {
    absl::StrAppendFormat(&out, "  rejected  %s within %s%s\n", Text(r.position()),
                          Length(r.radius()), r.reason().empty() ? "" : ": " + r.reason());
  }
  return out;
}

std::string ScanReport(const v1::Scan& scan) {
  std::string out =
      absl::StrFormat("%s  %s  %s\n", IdOf(scan.name()), scan.display_name(), Word(scan.state()));
  if (!scan.state_message().empty()) absl::StrAppend(&out, "  ", scan.state_message(), "\n");
  absl::StrAppendFormat(&out, "  samples   %d in %d columns x %d rows, %s\n", scan.samples(),
                        scan.columns(), scan.rows(), Bytes(scan.encoded_size()));
  if (scan.has_pose()) {
    absl::StrAppendFormat(&out, "  pose      %s, from %s\n", Text(scan.pose()),
                          Word(scan.pose_source()));
  }
  if (scan.has_levelling()) {
    absl::StrAppendFormat(&out, "  levelled  %.2f\u00b0 taken out, by %s\n",
                          Degrees(scan.levelling().tilt()),
                          scan.levelling().from_inclinometer() ? "the inclinometer"
                          : scan.levelling().found_floor()     ? "the floor"
                                                               : "nothing: no floor was found");
  }
  if (scan.has_registration()) {
    const v1::Registration& r = scan.registration();
    absl::StrAppend(&out, "  aligned   ", VerdictFigures(r.verdict()), "\n");
    absl::StrAppendFormat(&out,
                          "            %d pairs, residual %s (noise explains %s), contradictions "
                          "%.1f %%, %d iterations, %s\n",
                          r.correspondences(), Length(r.rms_residual()),
                          Length(r.expected_residual()), r.contradiction_share() * 100,
                          r.iterations(), Seconds(r.seconds()));
    if (!scan.has_pose()) absl::StrAppend(&out, "            at ", Text(r.pose()), "\n");
  }
  if (scan.has_merge()) {
    absl::StrAppendFormat(&out, "  merged    model version %d; carve %s, merge %s\n",
                          scan.merge().model_version(), Seconds(scan.merge().carve_seconds()),
                          Seconds(scan.merge().merge_seconds()));
  }
  return out;
}

std::string StagesLine(const v1::PlanResult& result) {
  std::vector<std::string> parts;
  double total = 0;
  for (const v1::StageSeconds& stage : result.stages()) {
    parts.push_back(absl::StrFormat("%s %.2f", stage.stage(), stage.seconds()));
    total += stage.seconds();
  }
  return absl::StrCat(absl::StrJoin(parts, ", "), absl::StrFormat("; %.2f s in all", total));
}

std::string ViewReport(const v1::RankedView& view) {
  std::string out =
      absl::StrFormat("  gain      %.2f m\u00b2 at density, %.2f to %.2f%s\n", view.area(),
                      view.area_lower(), view.area_upper(), view.exact() ? " (exact)" : "");
  const v1::BySurfaceKind& g = view.gain_by_kind();
  const double scale = view.score() > 0 ? view.area() / view.score() : 0;
  if (view.score() > 0 &&
      g.true_surface() + g.occlusion() + g.hole_boundary() + g.image_boundary() == 0) {
    absl::StrAppend(&out, "  of which  not told apart: the budget ended before\n");
  } else {
    absl::StrAppendFormat(&out,
                          "  of which  %.2f under-sampled, %.2f hidden, %.2f without return, %.2f "
                          "outside the field of view\n",
                          g.true_surface() * scale, g.occlusion() * scale,
                          g.hole_boundary() * scale, g.image_boundary() * scale);
  }
  absl::StrAppendFormat(
      &out, "  stand     %.2f m over the floor, clearance %s%s\n", view.height_over_floor(),
      Length(view.clearance()),
      view.has_travel() ? absl::StrFormat(", %.1f m to walk", view.travel()) : "");
  if (!view.where().words().empty())
    absl::StrAppend(&out, "  where     ", view.where().words(), "\n");
  absl::StrAppend(&out, "  verdict   ", VerdictLine(view.verdict()), "\n");
  return out;
}

std::string CoverageReport(const v1::Coverage& c) {
  const v1::BySurfaceKind& a = c.area();
  return absl::StrFormat(
      "coverage %s (estimated): %.1f m\u00b2 at density of %.1f m\u00b2 measured; missing %.1f "
      "m\u00b2 hidden, %.1f m\u00b2 without return, %.1f m\u00b2 outside the field of view; %.1f "
      "m\u00b2 given up; density %.0f /m\u00b2\n",
      absl::StrFormat("%.1f %%", c.estimated_coverage() * 100), c.area_at_density(),
      a.true_surface(), a.occlusion(), a.hole_boundary(), a.image_boundary(), c.area_given_up(),
      c.required_density());
}

std::string JointReport(const v1::PlanResult& r) {
  std::string out;
  for (int i = 0; i < r.joint().assignments_size(); ++i) {
    const v1::Assignment& assignment = r.joint().assignments(i);
    const std::string who =
        assignment.scanner().empty() ? std::string("the scanner") : IdOf(assignment.scanner());
    if (!assignment.has_view() || assignment.view() >= r.views_size()) {
      absl::StrAppend(&out, who, ": no view: ", assignment.reason(), "\n");
      continue;
    }
    const v1::RankedView& view = r.views(assignment.view());
    absl::StrAppend(&out, who, " to ", Text(view.position()),
                    absl::StrFormat(", %.2f m\u00b2", view.area()));
    if (view.has_minutes()) {
      absl::StrAppendFormat(&out, ", %.1f m walk, %.1f minutes", view.travel(), view.minutes());
    } else if (!view.unreachable().empty()) {
      absl::StrAppend(&out, ", ", view.unreachable());
    }
    for (const int before : assignment.waits_for()) {
      absl::StrAppend(&out, "; waits for ", IdOf(r.joint().assignments(before).scanner()));
    }
    for (const std::string& claim : assignment.waits_for_claims()) {
      absl::StrAppend(&out, "; waits for ", IdOf(claim));
    }
    out += "\n";
  }
  if (r.joint().assignments_size() > 1) {
    absl::StrAppendFormat(&out, "together %.2f m\u00b2; guarantee: %s\n", r.joint().area(),
                          r.joint().guarantee_reason());
  }
  if (r.joint().claims_size() > 0) {
    absl::StrAppend(&out, "around ", r.joint().claims_size(), " claimed views\n");
  }
  return out;
}

std::string PlanReport(const v1::Plan& plan) {
  const v1::PlanResult& r = plan.result();
  std::string out =
      absl::StrFormat("%s  %s: %s\n", IdOf(plan.name()), Word(plan.state()), Word(r.outcome()));
  if (!plan.state_message().empty()) absl::StrAppend(&out, plan.state_message(), "\n");
  if (!r.message().empty()) absl::StrAppend(&out, r.message(), "\n");
  if (r.views_size() + r.refused_size() > 0) {
    Table table({">rank", "position, m", ">height", ">gain, m\u00b2", ">bounds", ">walk, m",
                 "verdict", ">overlap", ">error", "where, or remedy"});
    AddViews(r.views(), false, table);
    AddViews(r.refused(), true, table);
    out += table.ToString();
  }
  if (r.views_size() > 0) {
    out += absl::StrFormat("next position %s\n", Text(r.views(0).position()));
    out += ViewReport(r.views(0));
  }
  if (r.has_joint()) out += JointReport(r);
  if (r.has_coverage()) out += CoverageReport(r.coverage());
  absl::StrAppendFormat(&out, "%s: %s\n", r.termination().suggested() ? "stop" : "go on",
                        r.termination().reason());
  absl::StrAppendFormat(&out,
                        "model version %d, %d viewcells, %.1f m\u00b2 need work, gap %.1f %% at "
                        "confidence %.0f %%%s; "
                        "%d rays, seed %d\n",
                        r.model_version(), r.feasible_cells(), r.needy_area(),
                        r.optimality_gap() * 100, r.confidence() * 100,
                        r.complete() ? ", complete" : "", r.rays(), r.seed());
  absl::StrAppend(&out, "seconds: ", StagesLine(r), "\n");
  return out;
}

}  // namespace vantage

#include "client/cli/report.h"

#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <cmath>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/strip.h"
#include "client/cli/table.h"
#include "client/library/duration.h"
#include "client/library/geometry.h"
#include "client/library/resource_names.h"
#include "core/sensor/scanner_model.h"

namespace vantage::cli {
namespace {

std::string Lower(const std::string& name, absl::string_view prefix) {
  std::string word(absl::StripPrefix(name, prefix));
  absl::AsciiStrToLower(&word);
  return absl::StrReplaceAll(word, {{"_", " "}});
}

std::string FacingAt(double heading_rad) {
  return absl::StrFormat(" facing %.0f\u00b0", sensor::Degrees(heading_rad));
}

// The gain with the view's own heading beside the best of all, which may not register, and the
// worst.
std::string HeadingLine(const v1::RankedView& view) {
  const auto& scores = view.score_by_heading();
  const auto of = [&](auto at) {
    return absl::StrFormat("%.0f samples at %.0f\u00b0", static_cast<double>(*at),
                           360.0 * static_cast<double>(at - scores.begin()) / scores.size());
  };
  return absl::StrFormat("%.0f\u00b0; of all headings most %s, least %s",
                         sensor::Degrees(view.heading_rad()),
                         of(std::max_element(scores.begin(), scores.end())),
                         of(std::min_element(scores.begin(), scores.end())));
}

std::string SquareMetres(double area) { return absl::StrFormat("%.2f", area); }

// '1', or '1 attic'.
std::string StoreyName(const v1::Storey& storey) {
  return absl::StrCat(storey.number(), storey.name().empty() ? "" : " ", storey.name());
}

std::string StoreyText(const v1::Storey& storey) {
  return storey.has_floor_z_m()
             ? absl::StrFormat("%s (floor at %.2f m)", StoreyName(storey), storey.floor_z_m())
             : StoreyName(storey);
}

// Where a view stands: its storey, where it names one.
std::string StoreyOf(const v1::RankedView& view) {
  if (!view.has_storey()) return "";
  return absl::StrCat(StoreyName(view.storey()),
                      view.floor_measured() ? "" : ", floor not measured");
}

// Where there is no floor below, the height over it is no number.
bool FloorKnown(const v1::RankedView& view) { return std::isfinite(view.height_over_floor_m()); }

void AddViews(const google::protobuf::RepeatedPtrField<v1::RankedView>& views, bool refused,
              Table& table) {
  for (int i = 0; i < views.size(); ++i) {
    const v1::RankedView& view = views[i];
    table.Add(
        {refused ? "-" : absl::StrCat(i + 1), absl::StrCat(Text(view.position()), Facing(view)),
         FloorKnown(view) ? absl::StrFormat("%.2f", view.height_over_floor_m()) : "-",
         StoreyOf(view), GainIsKnown(view) ? SquareMetres(view.model_gain_m2()) : "",
         absl::StrFormat("%.0f..%.0f", view.score_lower(), view.score_upper()),
         view.has_travel_distance_m() ? absl::StrFormat("%.1f", view.travel_distance_m()) : "",
         view.has_verdict() ? Word(view.verdict().outcome()) : "not checked yet",
         view.has_verdict() ? Percent(view.verdict().overlap_share()) : "",
         view.has_verdict() ? Length(view.verdict().error_bound_m()) : "",
         refused ? view.verdict().remedy() : view.location().description()});
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
std::string Word(v1::PlanStage stage) { return Lower(v1::PlanStage_Name(stage), "PLAN_STAGE_"); }
std::string Word(v1::RegistrationOutcome outcome) {
  return Lower(v1::RegistrationOutcome_Name(outcome), "REGISTRATION_OUTCOME_");
}
std::string Word(v1::RegistrationBasis basis) {
  return Lower(v1::RegistrationBasis_Name(basis), "REGISTRATION_BASIS_");
}
std::string Word(v1::ClaimEndReason reason) {
  return Lower(v1::ClaimEndReason_Name(reason), "CLAIM_END_REASON_");
}

std::string Text(const v1::Vector3& v) {
  return absl::StrFormat("(%.2f, %.2f, %.2f)", v.x(), v.y(), v.z());
}

std::string Text(const v1::Pose& pose) {
  const Eigen::Matrix3d r = client::FromProto(pose).linear();
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

std::string Seconds(const google::protobuf::Duration& duration) {
  return absl::StrFormat("%.2f s", client::SecondsOf(duration));
}

std::string Time(const google::protobuf::Timestamp& time) {
  std::string text = google::protobuf::util::TimeUtil::ToString(time);
  if (const size_t dot = text.find('.'); dot != std::string::npos) text = text.substr(0, dot) + "Z";
  return text;
}

std::string VerdictFigures(const v1::RegistrationVerdict& verdict) {
  std::string line = absl::StrFormat("%s: overlap %s, error bound %s, strength %.2f",
                                     Word(verdict.outcome()), Percent(verdict.overlap_share()),
                                     Length(verdict.error_bound_m()), verdict.strength());
  if (!verdict.weakest_description().empty())
    absl::StrAppend(&line, ", weakest ", verdict.weakest_description());
  if (verdict.basis() != v1::REGISTRATION_BASIS_UNSPECIFIED) {
    absl::StrAppend(&line, ", decided by ", Word(verdict.basis()));
  }
  return line;
}

std::string VerdictLine(const v1::RegistrationVerdict& verdict) {
  std::string line = VerdictFigures(verdict);
  if (!verdict.message().empty()) absl::StrAppend(&line, "; ", verdict.message());
  if (!verdict.remedy().empty()) absl::StrAppend(&line, "; remedy: ", verdict.remedy());
  return line;
}

std::string SessionReport(const v1::Session& session) {
  const v1::ScanCounts& n = session.scan_counts();
  const v1::PlanningConfig& p = session.planning_config();
  std::string out = absl::StrFormat(
      "%s%s\n", client::IdOf(session.name()),
      session.display_name().empty() ? "" : absl::StrCat("  ", session.display_name()));
  absl::StrAppendFormat(&out, "  created   %s, last event %d\n", Time(session.create_time()),
                        session.last_sequence());
  absl::StrAppendFormat(&out,
                        "  scans     %d merged, %d pending, %d doubtful, %d failed, %d withdrawn; "
                        "model version %d\n",
                        n.merged_count(), n.unmerged_count(), n.doubtful_count(), n.failed_count(),
                        n.withdrawn_count(), session.model_version());
  absl::StrAppendFormat(&out, "  model     voxel %s, origin %s\n",
                        Length(session.model_config().voxel_size_m()),
                        session.has_origin() ? Text(session.origin()) : "by the first scan");
  absl::StrAppendFormat(
      &out,
      "  planning  density %.0f /m\u00b2, viewcell %s, heights %.2f to %.2f m, stop below %.2f "
      "m\u00b2\n",
      p.required_density_per_m2(), Length(p.viewcell_size_m()), p.min_viewpoint_height_m(),
      p.max_viewpoint_height_m(), p.terminate_below_m2());
  absl::StrAppendFormat(&out, "  register  to %s at 95 %%, overlap at least %s\n",
                        Length(p.registration().required_accuracy_m()),
                        Percent(p.registration().min_overlap()));
  for (const v1::ScannerModel& s : session.scanner_models()) {
    absl::StrAppendFormat(
        &out,
        "  scanner   %s%s: %.3f\u00b0 x %.3f\u00b0, azimuth %.0f\u00b0, elevation %.0f\u00b0 to "
        "%.0f\u00b0, range %.1f to %.0f m, noise %s\n",
        s.id(), s.preset().empty() ? "" : absl::StrCat(" (", s.preset(), " at ", s.setting(), ")"),
        sensor::Degrees(s.azimuth_step_rad()), sensor::Degrees(s.elevation_step_rad()),
        sensor::Degrees(s.azimuth_span_rad()), sensor::Degrees(s.min_elevation_rad()),
        sensor::Degrees(s.max_elevation_rad()), s.min_range_m(), s.max_range_m(),
        Length(s.range_noise_m()));
  }
  for (const v1::NamedStorey& s : session.site_rules().storeys()) {
    absl::StrAppendFormat(&out, "  storey    %s: floor at %.2f m\n", s.name(), s.floor_z_m());
  }
  for (const v1::RequiredRegion& r : session.site_rules().regions()) {
    absl::StrAppendFormat(
        &out, "  region    %s: density %.0f /m\u00b2, weight %g%s\n", r.name(),
        r.has_required_density_per_m2() ? r.required_density_per_m2() : p.required_density_per_m2(),
        r.has_weight() ? r.weight() : 1.0,
        r.storey().empty() ? "" : absl::StrCat(", on storey ", r.storey()));
  }
  for (const v1::Rejection& r : session.rejections()) {
    absl::StrAppendFormat(&out, "  rejected  %s within %s%s\n", Text(r.position()),
                          Length(r.radius_m()), r.reason().empty() ? "" : ": " + r.reason());
  }
  return out;
}

namespace {

std::string AdjustmentLines(const v1::Scan& scan) {
  const v1::PoseAdjustment& adjustment = scan.adjustment();
  const v1::Vector3& before = adjustment.unadjusted_pose().translation();
  const v1::Vector3& now = scan.pose().translation();
  std::string out = absl::StrFormat(
      "  adjusted  %s from where it was registered",
      Length(std::hypot(now.x() - before.x(), now.y() - before.y(), now.z() - before.z())));
  if (adjustment.covariance().empty()) {
    absl::StrAppend(&out, ", along with the scan beside it");
  } else {
    absl::StrAppendFormat(&out, "; now known to %s", Length(adjustment.position_sigma_m()));
  }
  if (adjustment.has_worst_link()) {
    absl::StrAppendFormat(&out, "; its worst link, to %s, is off by %.0f %% of what is allowed",
                          client::IdOf(adjustment.worst_link().scan()),
                          100 * adjustment.worst_link().test_ratio());
  }
  return out + "\n";
}

// Poses of a scan that waits for a person, by the numbers that 'scan accept' takes, and how.
std::string PosesToAccept(const v1::Scan& scan) {
  const v1::Registration& r = scan.registration();
  const bool open = r.rival_poses_size() > 0;
  std::string out = absl::StrCat(open ? "  pose 1    " : "            at ", Text(r.pose()), "\n");
  for (int i = 0; i < r.rival_poses_size(); ++i) {
    const v1::RivalPose& rival = r.rival_poses(i);
    absl::StrAppendFormat(&out, "  pose %d    %s: %s away, fits %.0f %% as well\n", i + 2,
                          Text(rival.pose()), Length(rival.distance_m()), 100 * rival.fit_share());
  }
  if (scan.has_pose_proposal()) {
    const v1::PoseProposal& proposal = scan.pose_proposal();
    absl::StrAppendFormat(&out, "  proposed  %s%s\n            %s\n",
                          proposal.has_rival_pose()
                              ? absl::StrFormat("pose %d, now ", proposal.rival_pose() + 1)
                              : "",
                          Text(proposal.registration().pose()), proposal.message());
  }
  if (!open && !scan.has_pose_proposal()) return out;
  absl::StrAppendFormat(
      &out, "            vantage scan accept %s/%s %s%s takes %s\n",
      client::IdOf(client::SessionOf(scan.name())), client::IdOf(scan.name()),
      scan.has_pose_proposal() ? "--proposed" : "--pose N",
      scan.etag().empty() ? "" : absl::StrCat(" --seen ", scan.etag()),
      scan.has_pose_proposal() ? "what is proposed, --pose N another" : "one of them");
  return out;
}

// 'came since scan 3: 0.9 x 0.1 x 2.0 m around (1.20, 0.40, 1.10)'
std::string ChangeWords(const v1::SiteChange& change) {
  const v1::Box& box = change.box();
  return absl::StrFormat("%s since %s: %.1f x %.1f x %.1f m around (%.2f, %.2f, %.2f)",
                         change.kind() == v1::SITE_CHANGE_KIND_CAME ? "came" : "gone",
                         client::IdOf(change.since()), box.max().x() - box.min().x(),
                         box.max().y() - box.min().y(), box.max().z() - box.min().z(),
                         change.centre().x(), change.centre().y(), change.centre().z());
}

}  // namespace

std::string ScanReport(const v1::Scan& scan) {
  std::string out = absl::StrFormat("%s  %s  %s\n", client::IdOf(scan.name()), scan.display_name(),
                                    Word(scan.state()));
  if (scan.preview()) absl::StrAppend(&out, "  a preview; its whole scan may come in its place\n");
  if (!scan.state_message().empty()) absl::StrAppend(&out, "  ", scan.state_message(), "\n");
  absl::StrAppendFormat(&out, "  samples   %d in %d columns x %d rows, %s\n", scan.sample_count(),
                        scan.column_count(), scan.row_count(), Bytes(scan.encoded_size_bytes()));
  if (scan.has_pose()) {
    absl::StrAppendFormat(&out, "  pose      %s, from %s\n", Text(scan.pose()),
                          Word(scan.pose_source()));
  }
  if (scan.has_adjustment()) absl::StrAppend(&out, AdjustmentLines(scan));
  if (scan.has_levelling()) {
    absl::StrAppendFormat(&out, "  levelled  %.2f\u00b0 taken out, by %s\n",
                          sensor::Degrees(scan.levelling().tilt_rad()),
                          scan.levelling().from_inclinometer() ? "the inclinometer"
                          : scan.levelling().found_floor()     ? "the floor"
                                                               : "nothing: no floor was found");
    if (!scan.levelling().message().empty()) {
      absl::StrAppend(&out, "            ", scan.levelling().message(), "\n");
    }
  }
  if (scan.has_registration()) {
    const v1::Registration& r = scan.registration();
    absl::StrAppend(&out, "  aligned   ", VerdictFigures(r.verdict()), "\n");
    absl::StrAppendFormat(&out,
                          "            %d pairs, residual %s (noise explains %s), contradictions "
                          "%.1f %%, %d iterations, %s\n",
                          r.correspondence_count(), Length(r.rms_residual_m()),
                          Length(r.expected_residual_m()), r.contradiction_share() * 100,
                          r.iteration_count(), Seconds(r.duration()));
    if (r.has_moved_area_m2()) {
      absl::StrAppendFormat(&out,
                            "            %.1f m\u00b2 of it was moved since, or came: what was "
                            "scanned before is where it was\n",
                            r.moved_area_m2());
    }
    if (!scan.has_pose()) absl::StrAppend(&out, PosesToAccept(scan));
  }
  if (scan.has_merge()) {
    absl::StrAppendFormat(&out, "  merged    model version %d; carve %s, merge %s\n",
                          scan.merge().model_version(), Seconds(scan.merge().carve_duration()),
                          Seconds(scan.merge().merge_duration()));
    if (scan.merge().has_obtained_gain_m2()) {
      absl::StrAppendFormat(&out, "  brought   %.1f m\u00b2 to density",
                            scan.merge().obtained_gain_m2());
      if (scan.merge().has_promise()) {
        const v1::GainPromise& promise = scan.merge().promise();
        absl::StrAppendFormat(&out, "; %.1f expected by %s", promise.expected_gain_m2(),
                              client::IdOf(promise.plan()));
      }
      absl::StrAppend(&out, "\n");
    }
    for (const v1::SiteChange& change : scan.merge().changes()) {
      absl::StrAppend(&out, "  changed   ", ChangeWords(change), "\n");
    }
    if (scan.merge().beyond_range_count() > 0) {
      absl::StrAppendFormat(&out, "  cut       %d returns beyond the scanner's range\n",
                            scan.merge().beyond_range_count());
    }
    if (scan.merge().beyond_site_count() > 0) {
      absl::StrAppendFormat(&out, "  cut       %d returns beyond the site's limit\n",
                            scan.merge().beyond_site_count());
    }
    if (scan.merge().sky_ray_count() > 0) {
      absl::StrAppendFormat(&out, "  sky       %d rays into the open sky\n",
                            scan.merge().sky_ray_count());
    }
  }
  return out;
}

std::string Facing(const v1::RankedView& view) {
  return view.has_heading_rad() ? FacingAt(view.heading_rad()) : "";
}

std::string Facing(const v1::Station& station) {
  return station.has_heading_rad() ? FacingAt(station.heading_rad()) : "";
}

std::string Facing(const v1::Claim& claim) {
  return claim.has_heading_rad() ? FacingAt(claim.heading_rad()) : "";
}

std::string StagesLine(const v1::PlanResult& result) {
  std::vector<std::string> parts;
  double total = 0;
  for (const v1::StageDuration& stage : result.stage_durations()) {
    const double seconds = client::SecondsOf(stage.duration());
    parts.push_back(absl::StrFormat("%s %.2f", Word(stage.stage()), seconds));
    total += seconds;
  }
  return absl::StrCat(absl::StrJoin(parts, ", "), absl::StrFormat("; %.2f s in all", total));
}

bool GainIsKnown(const v1::RankedView& view) {
  return view.exact() && view.model_gain_lower_m2() == view.model_gain_upper_m2();
}

std::string ViewReport(const v1::RankedView& view) {
  std::string out =
      GainIsKnown(view)
          ? absl::StrFormat("  gain       brings %.2f m\u00b2 to density\n", view.model_gain_m2())
          : std::string("  gain       not known: the budget ended before\n");
  if (GainIsKnown(view) && view.expected_gain_m2() > view.model_gain_m2() + 0.005) {
    absl::StrAppendFormat(
        &out,
        "  expected   %.1f m\u00b2 with what was not seen yet; %.1f to %.1f in four "
        "cases of five\n",
        view.expected_gain_m2(), view.expected_gain_lower_m2(), view.expected_gain_upper_m2());
  }
  const v1::BySurfaceKind& score = view.score_by_kind();
  absl::StrAppendFormat(&out, "  score      %.0f samples", view.score());
  if (!view.exact()) {
    absl::StrAppendFormat(&out, " (%.0f to %.0f)", view.score_lower(), view.score_upper());
  }
  if (view.score() > 0 &&
      score.true_surface() + score.occlusion() + score.hole_boundary() + score.image_boundary() ==
          0) {
    absl::StrAppend(&out, ", causes not told apart: the budget ended before\n");
  } else {
    absl::StrAppendFormat(
        &out,
        ": %.0f under-sampled, %.0f hidden, %.0f without return, %.0f outside the field of "
        "view\n",
        score.true_surface(), score.occlusion(), score.hole_boundary(), score.image_boundary());
  }
  if (view.has_heading_rad() && view.score_by_heading_size() > 0) {
    absl::StrAppend(&out, "  heading    ", HeadingLine(view), "\n");
  }
  if (!view.setting().empty()) {
    absl::StrAppendFormat(
        &out, "  setting    %s, %.1f minutes a scan, %.0f samples a minute with setting up\n",
        view.setting(), client::SecondsOf(view.scan_duration()) / 60, view.score_per_minute());
  }
  absl::StrAppendFormat(
      &out, "  station    %s, clearance %s%s\n",
      FloorKnown(view) ? absl::StrFormat("%.2f m over the floor", view.height_over_floor_m())
                       : "no floor is known below",
      Length(view.clearance_m()),
      view.has_travel_distance_m() ? absl::StrFormat(", %.1f m to walk", view.travel_distance_m())
                                   : "");
  if (view.has_enabled_view_index()) {
    absl::StrAppendFormat(
        &out,
        "  first      since the view refused in row %d, which gains more, registers "
        "after it\n",
        view.enabled_view_index() + 1);
  }
  if (view.has_expected_station()) {
    const v1::ExpectedStation& expected = view.expected_station();
    absl::StrAppendFormat(
        &out, "  assumed    %s; works with a chance of %.0f %%%s\n", expected.message(),
        100 * expected.chance(),
        expected.has_fallback_view_index()
            ? absl::StrFormat(", else take rank %d", expected.fallback_view_index() + 1)
            : "");
  }
  if (view.has_storey()) {
    absl::StrAppend(&out, "  storey     ", StoreyText(view.storey()),
                    view.floor_measured() ? "" : "; the floor below was not measured", "\n");
  }
  if (!view.location().description().empty())
    absl::StrAppend(&out, "  where      ", view.location().description(), "\n");
  absl::StrAppend(&out, "  verdict    ",
                  view.has_verdict() ? VerdictLine(view.verdict()) : "not checked yet", "\n");
  return out;
}

std::string CoverageReport(const v1::Coverage& c) {
  const v1::BySurfaceKind& a = c.area_by_kind_m2();
  std::string out = absl::StrFormat(
      "coverage %s (estimated): %.1f m\u00b2 at density of %.1f m\u00b2 measured; missing %.1f "
      "m\u00b2 hidden, %.1f m\u00b2 without return, %.1f m\u00b2 outside the field of view; %.1f "
      "m\u00b2 given up, %.1f m\u00b2 out of reach; density %.0f /m\u00b2\n",
      c.has_estimated_coverage() ? absl::StrFormat("%.1f %%", c.estimated_coverage() * 100) : "-",
      c.area_at_density_m2(), a.true_surface(), a.occlusion(), a.hole_boundary(),
      a.image_boundary(), c.area_given_up_m2(), c.area_out_of_reach_m2(),
      c.required_density_per_m2());
  for (const v1::RegionCoverage& r : c.regions()) {
    absl::StrAppendFormat(
        &out,
        "  region %s: %s, %.1f m\u00b2 at density of %.1f m\u00b2 measured; density %.0f "
        "/m\u00b2\n",
        r.name(),
        r.has_estimated_coverage() ? absl::StrFormat("%.1f %%", r.estimated_coverage() * 100) : "-",
        r.area_at_density_m2(), r.area_by_kind_m2().true_surface(), r.required_density_per_m2());
  }
  if (c.pending_station_count() > 0) {
    absl::StrAppendFormat(
        &out, "besides, %d station%s without data should bring %.1f m\u00b2, to %s\n",
        c.pending_station_count(), c.pending_station_count() == 1 ? "" : "s", c.area_pending_m2(),
        c.has_expected_coverage() ? absl::StrFormat("%.1f %%", c.expected_coverage() * 100) : "-");
  }
  if (!c.has_rooms_not_entered_count()) return out;
  if (c.rooms_not_entered_count() == 0) {
    out += "no doorway to a room that was not entered is known\n";
  } else {
    absl::StrAppendFormat(&out, "besides, at least %d room%s not entered:\n",
                          c.rooms_not_entered_count(), c.rooms_not_entered_count() == 1 ? "" : "s");
  }
  for (const v1::Opening& opening : c.openings()) {
    if (!opening.doorway() || opening.entered() || opening.frontier_area_behind_m2() <= 0) continue;
    absl::StrAppendFormat(
        &out,
        "  behind the doorway at %s, %.2f m wide and %.2f m high: %.1f m\u00b2 of floor seen\n",
        Text(opening.centre()), opening.width_m(), opening.height_m(),
        opening.free_area_behind_m2());
  }
  return out;
}

std::string StoreysReport(const google::protobuf::RepeatedPtrField<v1::Storey>& storeys) {
  std::vector<std::string> words;
  for (const v1::Storey& storey : storeys) words.push_back(StoreyText(storey));
  return storeys.empty() ? "" : absl::StrCat("storeys: ", absl::StrJoin(words, ", "), "\n");
}

std::string JointReport(const v1::PlanResult& r) {
  std::string out;
  for (int i = 0; i < r.joint().assignments_size(); ++i) {
    const v1::Assignment& assignment = r.joint().assignments(i);
    const std::string who = assignment.scanner().empty() ? std::string("the scanner")
                                                         : client::IdOf(assignment.scanner());
    if (!assignment.has_view_index() || assignment.view_index() >= r.views_size()) {
      absl::StrAppend(&out, who, ": no view: ", assignment.message(), "\n");
      continue;
    }
    const v1::RankedView& view = r.views(assignment.view_index());
    absl::StrAppend(&out, who, " to ", Text(view.position()), Facing(view));
    if (view.has_storey()) absl::StrAppend(&out, ", storey ", StoreyOf(view));
    if (GainIsKnown(view)) {
      absl::StrAppendFormat(&out, ", brings %.2f m\u00b2 to density", view.model_gain_m2());
    }
    if (view.has_total_duration()) {
      absl::StrAppendFormat(&out, ", %.1f m walk, %.1f minutes", view.travel_distance_m(),
                            client::SecondsOf(view.total_duration()) / 60);
    } else if (!view.unreachable_message().empty()) {
      absl::StrAppend(&out, ", ", view.unreachable_message());
    }
    for (const int before : assignment.waits_for_indices()) {
      absl::StrAppend(&out, "; waits for ", client::IdOf(r.joint().assignments(before).scanner()));
    }
    for (const std::string& claim : assignment.waits_for_claims()) {
      absl::StrAppend(&out, "; waits for ", client::IdOf(claim));
    }
    out += "\n";
  }
  if (r.joint().assignments_size() > 1) {
    if (r.joint().model_gain_m2() > 0) {
      absl::StrAppendFormat(&out, "together %.2f m\u00b2; ", r.joint().model_gain_m2());
    }
    absl::StrAppend(&out, "guarantee: ", r.joint().guarantee_message(), "\n");
  }
  if (r.joint().claims_size() > 0) {
    absl::StrAppend(&out, "around ", r.joint().claims_size(), " claimed views\n");
  }
  return out;
}

std::string PlanReport(const v1::Plan& plan) {
  const v1::PlanResult& r = plan.result();
  std::string out = absl::StrFormat("%s  %s: %s\n", client::IdOf(plan.name()), Word(plan.state()),
                                    Word(r.outcome()));
  if (!plan.state_message().empty()) absl::StrAppend(&out, plan.state_message(), "\n");
  if (!r.message().empty()) absl::StrAppend(&out, r.message(), "\n");
  if (r.views_size() + r.refused_size() > 0) {
    Table table({">rank", "position, m", ">height", "storey", ">gain, m\u00b2", ">score",
                 ">walk, m", "verdict", ">overlap", ">error", "where, or remedy"});
    AddViews(r.views(), false, table);
    AddViews(r.refused(), true, table);
    out += table.ToString();
  }
  if (r.views_size() > 0) {
    out += absl::StrFormat("next position %s%s\n", Text(r.views(0).position()), Facing(r.views(0)));
    out += ViewReport(r.views(0));
    for (const v1::OpenDoor& door : r.views(0).open_doors()) {
      absl::StrAppendFormat(&out,
                            "leave open the door of %.2f m at (%.2f, %.2f): %.0f %% of what this "
                            "view registers by is seen through it\n",
                            door.width_m(), door.centre().x(), door.centre().y(),
                            100 * door.overlap_share());
    }
  }
  if (r.has_followed_tour()) absl::StrAppend(&out, "tour: ", r.followed_tour().message(), "\n");
  if (r.has_joint()) out += JointReport(r);
  for (const v1::RankedView& view : r.refused()) {
    if (!view.has_target_advice()) continue;
    absl::StrAppend(&out, "targets    for ", Text(view.position()), Facing(view), ": ",
                    view.target_advice().message(), "\n");
  }
  for (const v1::NarrowWay& way : r.narrow_ways()) absl::StrAppend(&out, way.message(), "\n");
  if (r.has_coverage()) out += CoverageReport(r.coverage());
  out += StoreysReport(r.storeys());
  absl::StrAppendFormat(&out, "%s: %s\n", r.termination().suggested() ? "stop" : "go on",
                        r.termination().message());
  absl::StrAppendFormat(&out,
                        "model version %d, %d viewcells, %.1f m\u00b2 deficient, gap %.1f %% at "
                        "confidence %.0f %%%s; "
                        "%d rays, seed %d\n",
                        r.model_version(), r.feasible_viewcell_count(), r.deficient_area_m2(),
                        r.optimality_gap() * 100, r.confidence() * 100,
                        r.complete() ? ", complete" : "", r.ray_count(), r.seed());
  if (r.surface_cube_voxels() > 1) {
    absl::StrAppendFormat(
        &out,
        "surface was planned for in cubes of %d voxels, since there is so much of "
        "it: scores and gains are of one voxel in each\n",
        r.surface_cube_voxels());
  }
  absl::StrAppend(&out, "seconds: ", StagesLine(r), "\n");
  return out;
}

}  // namespace vantage::cli

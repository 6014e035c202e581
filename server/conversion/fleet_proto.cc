#include "server/conversion/fleet_proto.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/planning/setting_choice.h"
#include "server/conversion/from_proto.h"
#include "server/conversion/to_proto.h"

namespace vantage::conversion {
namespace {

constexpr size_t kMaxText = 200;
constexpr int kMaxReach = 64;
constexpr double kMaxSpeed = 10;  // m/s
constexpr double kMaxScanSeconds = 86400;

void CheckBox(const v1::Box& box, const std::string& field, contract::Violations& violations) {
  if (!box.has_min()) violations.Add(field + ".min", "is required");
  if (!box.has_max()) violations.Add(field + ".max", "is required");
  const Eigen::Vector3d min = ReadVector(box.min(), field + ".min", violations);
  const Eigen::Vector3d max = ReadVector(box.max(), field + ".max", violations);
  if (box.has_min() && box.has_max() && !(min.array() < max.array()).all()) {
    violations.Add(field, "must have min below max on every axis");
  }
}

}  // namespace

const v1::ScannerModel* FindModel(const std::string& id, const v1::Session& session) {
  const auto it = std::find_if(session.scanner_models().begin(), session.scanner_models().end(),
                               [&](const v1::ScannerModel& model) { return model.id() == id; });
  return it == session.scanner_models().end() ? nullptr : &*it;
}

void CheckScanner(const v1::Scanner& scanner, const std::string& field,
                  contract::Violations& violations) {
  CheckText(scanner.display_name(), kMaxText, field + ".display_name", violations);
  CheckText(scanner.operator_(), kMaxText, field + ".operator", violations);
  if (scanner.reach_size() > kMaxReach) {
    violations.Add(field + ".reach", absl::StrCat("has ", scanner.reach_size(), " boxes, at most ",
                                                  kMaxReach, " fit"));
  } else {
    for (int i = 0; i < scanner.reach_size(); ++i) {
      CheckBox(scanner.reach(i), absl::StrCat(field, ".reach[", i, "]"), violations);
    }
  }
  if (scanner.has_speed_m_per_s() &&
      !(scanner.speed_m_per_s() > 0 && scanner.speed_m_per_s() <= kMaxSpeed)) {
    violations.Add(field + ".speed_m_per_s", absl::StrFormat("is %g m/s, must be in (0, %g]",
                                                             scanner.speed_m_per_s(), kMaxSpeed));
  }
  const int32_t nanos = scanner.scan_duration().nanos();
  const double duration = ReadDuration(scanner.scan_duration());
  if (!(duration >= 0 && duration <= kMaxScanSeconds && nanos >= 0 && nanos < 1'000'000'000)) {
    violations.Add(field + ".scan_duration",
                   absl::StrFormat("is %g s, must be in [0, %g]", duration, kMaxScanSeconds));
  }
}

void FillDefaults(v1::Scanner& scanner, const v1::Session& session) {
  const fleet::FleetMember defaults;
  scanner.set_scanner_model_id(ModelOf(scanner, session).id());
  if (!scanner.has_speed_m_per_s()) scanner.set_speed_m_per_s(defaults.speed);
  if (!scanner.has_scan_duration()) {
    const v1::ScannerModel& model = ModelOf(scanner, session);
    *scanner.mutable_scan_duration() =
        WriteDuration(model.has_scan_duration()
                          ? 60 * planning::kSetUpMinutes + ReadDuration(model.scan_duration())
                          : defaults.scan_seconds);
  }
}

const v1::ScannerModel& ModelOf(const v1::Scanner& scanner, const v1::Session& session) {
  const v1::ScannerModel* model = FindModel(scanner.scanner_model_id(), session);
  return model != nullptr ? *model : session.scanner_models(0);
}

fleet::FleetMember ReadFleetMember(const v1::Scanner& scanner, const v1::Session& session,
                                   const Eigen::Vector3d& origin) {
  contract::Violations none;  // the scanner was checked when it was added
  fleet::FleetMember out;
  out.model = ReadScannerModel(ModelOf(scanner, session), "scanner_model", none);
  if (scanner.has_last_pose()) out.at = ReadOwnPose(scanner.last_pose(), origin).translation();
  for (const v1::Box& box : scanner.reach()) {
    out.reach.emplace_back(ReadVector(box.min(), "", none) - origin,
                           ReadVector(box.max(), "", none) - origin);
  }
  out.speed = scanner.speed_m_per_s();
  out.scan_seconds = ReadDuration(scanner.scan_duration());
  return out;
}

fleet::Claims ReadClaims(std::span<const v1::Claim* const> held, const Eigen::Vector3d& origin) {
  std::vector<fleet::ViewClaim> claims;
  claims.reserve(held.size());
  for (const v1::Claim* claim : held) {
    claims.push_back({claim->name(), claim->scanner(), ReadOwnVector(claim->position()) - origin,
                      ReadTime(claim->create_time()), ReadTime(claim->expire_time()),
                      claim->has_heading_rad() ? std::optional(claim->heading_rad()) : std::nullopt,
                      claim->azimuth_span_rad()});
  }
  return fleet::Claims(std::move(claims));
}

fleet::PledgedView ReadStation(const v1::Station& station,
                               const std::map<std::string, v1::Scanner>& scanners,
                               const v1::Session& session, const Eigen::Vector3d& origin) {
  const v1::ScannerModel* model = FindModel(station.scanner_model_id(), session);
  const auto scanner = scanners.find(station.scanner());
  if (model == nullptr && scanner != scanners.end()) model = &ModelOf(scanner->second, session);
  if (model == nullptr) model = &session.scanner_models(0);
  contract::Violations none;  // the station was checked when it was created
  return {ReadOwnVector(station.position()) - origin,
          ReadScannerModel(*model, "scanner_model", none),
          station.has_heading_rad() ? std::optional(station.heading_rad()) : std::nullopt};
}

v1::ClaimEndReason WriteClaimEnd(fleet::ClaimEnd end) {
  switch (end) {
    case fleet::ClaimEnd::kScanArrived:
      return v1::CLAIM_END_REASON_SCAN_ARRIVED;
    case fleet::ClaimEnd::kExpired:
      return v1::CLAIM_END_REASON_EXPIRED;
    case fleet::ClaimEnd::kReleased:
      return v1::CLAIM_END_REASON_RELEASED;
  }
  return v1::CLAIM_END_REASON_UNSPECIFIED;
}

const char* Words(v1::ClaimEndReason reason) {
  switch (reason) {
    case v1::CLAIM_END_REASON_SCAN_ARRIVED:
      return fleet::ClaimEndName(fleet::ClaimEnd::kScanArrived);
    case v1::CLAIM_END_REASON_EXPIRED:
      return fleet::ClaimEndName(fleet::ClaimEnd::kExpired);
    case v1::CLAIM_END_REASON_RELEASED:
      return fleet::ClaimEndName(fleet::ClaimEnd::kReleased);
    default:
      return "not stated";
  }
}

void WriteJointPlan(const fleet::JointPlan& joint, const std::vector<std::string>& scanners,
                    const std::vector<std::string>& claims,
                    const std::vector<std::string>& stations, v1::PlanResult& result) {
  v1::JointPlan& out = *result.mutable_joint();
  for (const fleet::Assignment& assignment : joint.assignments) {
    v1::Assignment& written = *out.add_assignments();
    if (assignment.scanner < scanners.size()) written.set_scanner(scanners[assignment.scanner]);
    if (assignment.view.has_value()) written.set_view_index(static_cast<int32_t>(*assignment.view));
    written.set_message(assignment.reason);
    for (const size_t before : assignment.waits_for) {
      written.add_waits_for_indices(static_cast<int32_t>(before));
    }
    for (const size_t view : assignment.waits_for_pledged) {
      if (view < claims.size()) {
        written.add_waits_for_claims(claims[view]);
      } else if (view - claims.size() < stations.size()) {
        written.add_waits_for_stations(stations[view - claims.size()]);
      }
    }
  }
  out.set_score(joint.score);
  if (joint.model_gain.has_value()) out.set_model_gain_m2(*joint.model_gain);
  if (joint.guarantee.has_value()) out.set_guarantee(*joint.guarantee);
  out.set_guarantee_message(joint.guarantee_reason);
  for (const std::string& claim : claims) out.add_claims(claim);
  for (const std::string& station : stations) out.add_stations(station);
  for (int i = 0; i < result.views_size(); ++i) {
    if (static_cast<size_t>(i) >= joint.journeys.size()) break;
    const fleet::Journey& journey = joint.journeys[static_cast<size_t>(i)];
    v1::RankedView& view = *result.mutable_views(i);
    view.set_unreachable_message(journey.unreachable);
    if (journey.minutes.has_value()) {
      *view.mutable_total_duration() = WriteDuration(60 * *journey.minutes);
    }
    if (journey.per_minute.has_value()) view.set_score_per_minute(*journey.per_minute);
  }
}

}  // namespace vantage::conversion

#include "server/store/upgrade.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "google/protobuf/duration.pb.h"
#include "google/protobuf/unknown_field_set.h"
#include "google/protobuf/util/time_util.h"
#include "server/store/store.h"

namespace vantage::store {
namespace {

using google::protobuf::Message;
using google::protobuf::UnknownField;
using google::protobuf::UnknownFieldSet;
using google::protobuf::util::TimeUtil;

template <typename Value>
using Names = std::span<const std::pair<absl::string_view, Value>>;

UnknownFieldSet& UnknownOf(Message& message) {
  return *message.GetReflection()->MutableUnknownFields(&message);
}

// Removes and returns all fields of a number and a wire type, in order.
template <typename Value, typename Read>
std::vector<Value> TakeAll(UnknownFieldSet& fields, int number, UnknownField::Type type,
                           Read read) {
  std::vector<Value> values;
  for (int i = 0; i < fields.field_count();) {
    const UnknownField& field = fields.field(i);
    if (field.number() != number || field.type() != type) {
      ++i;
      continue;
    }
    values.push_back(read(field));
    fields.DeleteSubrange(i, 1);
  }
  return values;
}

std::vector<std::string> TakeTexts(UnknownFieldSet& fields, int number) {
  return TakeAll<std::string>(fields, number, UnknownField::TYPE_LENGTH_DELIMITED,
                              [](const UnknownField& field) { return field.length_delimited(); });
}

// Nothing when the field was absent, as a field without presence is when it is 0.
std::optional<google::protobuf::Duration> TakeDuration(UnknownFieldSet& fields, int number,
                                                       double unit_seconds = 1) {
  const std::vector<double> values = TakeAll<double>(
      fields, number, UnknownField::TYPE_FIXED64,
      [](const UnknownField& field) { return std::bit_cast<double>(field.fixed64()); });
  if (values.empty()) return std::nullopt;
  const double nanos = values.back() * unit_seconds * 1e9;
  if (!(nanos >= 0 && nanos < 9.2e18)) return std::nullopt;
  return TimeUtil::NanosecondsToDuration(std::llround(nanos));
}

template <typename Value>
Value ByName(Names<Value> names, absl::string_view name, Value otherwise) {
  for (const auto& [known, value] : names) {
    if (known == name) return value;
  }
  return otherwise;
}

// Between guarantees that it took together.
constexpr absl::string_view kTogether = " and ";
constexpr std::pair<absl::string_view, v1::RegistrationBasis> kBases[] = {
    {"scan geometry", v1::REGISTRATION_BASIS_SCAN_GEOMETRY},
    {"levelling", v1::REGISTRATION_BASIS_LEVELLING},
    {"targets", v1::REGISTRATION_BASIS_TARGETS},
    {"trusted pose", v1::REGISTRATION_BASIS_TRUSTED_POSE},
    {"overlap", v1::REGISTRATION_BASIS_OVERLAP},
    {"no pose prior", v1::REGISTRATION_BASIS_NO_POSE_PRIOR},
    {"residuals", v1::REGISTRATION_BASIS_RESIDUALS},
    {"contradiction", v1::REGISTRATION_BASIS_CONTRADICTION},
    {"rival pose", v1::REGISTRATION_BASIS_RIVAL_POSE},
    {"convergence", v1::REGISTRATION_BASIS_NOT_CONVERGED},
};
constexpr std::pair<absl::string_view, v1::PlanStage> kStages[] = {
    {"feasible views", v1::PLAN_STAGE_FEASIBLE_VIEWS},
    {"extract patches", v1::PLAN_STAGE_EXTRACT_PATCHES},
    {"rank patches", v1::PLAN_STAGE_RANK_PATCHES},
    {"evaluate views", v1::PLAN_STAGE_EVALUATE_VIEWS},
    {"rank views", v1::PLAN_STAGE_RANK_VIEWS},
    {"registration check", v1::PLAN_STAGE_REGISTRATION_CHECK},
};
constexpr std::pair<absl::string_view, v1::ClaimEndReason> kClaimEnds[] = {
    {"scan arrived", v1::CLAIM_END_REASON_SCAN_ARRIVED},
    {"expired", v1::CLAIM_END_REASON_EXPIRED},
    {"released", v1::CLAIM_END_REASON_RELEASED},
};
// Fields of a session that could be updated and were renamed.
constexpr std::pair<absl::string_view, absl::string_view> kPlanningFields[] = {
    {"required_density", "required_density_per_m2"},
    {"viewcell_size", "viewcell_size_m"},
    {"min_height", "min_viewpoint_height_m"},
    {"max_height", "max_viewpoint_height_m"},
    {"floor_height", "floor_z_m"},
    {"scanner_width", "scanner_width_m"},
    {"scanner_height", "scanner_height_m"},
    {"separation", "candidate_separation_m"},
    {"candidates", "max_view_count"},
    {"max_checked", "max_checked_view_count"},
    {"terminate_below", "terminate_below_m2"},
    {"min_patch_area", "min_patch_area_m2"},
    {"depth_behind", "unknown_depth_m"},
    {"least_deficit", "min_deficit_share"},
    {"counts_from", "min_counted_density_share"},
};
constexpr std::pair<absl::string_view, absl::string_view> kRegistrationFields[] = {
    {"required_accuracy", "required_accuracy_m"},
    {"minimum_overlap", "min_overlap"},
    {"correlation_length", "correlation_length_m"},
    {"correlated_sigma", "correlated_sigma_m"},
    {"normal_sigma", "normal_sigma_rad"},
    {"sample_spacing", "sample_spacing_m"},
    {"max_correspondence", "max_correspondence_distance_m"},
    {"draws", "draw_count"},
};

void UpgradeVerdict(v1::RegistrationVerdict& verdict) {
  const std::vector<std::string> decided_by = TakeTexts(UnknownOf(verdict), 9);
  if (decided_by.empty()) return;
  const auto basis_of = [](absl::string_view text) {
    return ByName<v1::RegistrationBasis>(kBases, text, v1::REGISTRATION_BASIS_UNSPECIFIED);
  };
  if (!absl::StrContains(decided_by.back(), kTogether)) {
    verdict.set_basis(basis_of(decided_by.back()));
    return;
  }
  verdict.set_basis(v1::REGISTRATION_BASIS_COMBINED);
  for (const absl::string_view text : absl::StrSplit(decided_by.back(), kTogether)) {
    verdict.add_combined_bases(basis_of(text));
  }
}

void UpgradeScan(v1::Scan& scan) {
  if (scan.has_registration()) {
    v1::Registration& registration = *scan.mutable_registration();
    if (const auto took = TakeDuration(UnknownOf(registration), 10)) {
      *registration.mutable_duration() = *took;
    }
    if (registration.has_verdict()) UpgradeVerdict(*registration.mutable_verdict());
  }
  if (scan.has_merge()) {
    v1::MergeReport& merge = *scan.mutable_merge();
    if (const auto took = TakeDuration(UnknownOf(merge), 6))
      *merge.mutable_carve_duration() = *took;
    if (const auto took = TakeDuration(UnknownOf(merge), 7))
      *merge.mutable_merge_duration() = *took;
  }
}

void UpgradeView(v1::RankedView& view) {
  if (const auto minutes = TakeDuration(UnknownOf(view), 19, 60)) {
    *view.mutable_total_duration() = *minutes;
  }
  if (view.has_verdict()) UpgradeVerdict(*view.mutable_verdict());
}

void UpgradePlan(v1::Plan& plan) {
  if (plan.has_result()) Upgrade(*plan.mutable_result());
}

void UpgradeUpdatedPaths(v1::SessionUpdatedEvent& event) {
  for (const std::string& path : TakeTexts(UnknownOf(event), 2)) {
    std::string& written = *event.mutable_update_mask()->add_paths();
    absl::string_view field = path;
    if (!absl::ConsumePrefix(&field, "planning_config.")) {
      written = path;
    } else if (absl::ConsumePrefix(&field, "registration.")) {
      written = absl::StrCat("planning_config.registration.",
                             ByName<absl::string_view>(kRegistrationFields, field, field));
    } else {
      written = absl::StrCat("planning_config.",
                             ByName<absl::string_view>(kPlanningFields, field, field));
    }
  }
}

void UpgradeEvent(v1::SessionEvent& event) {
  switch (event.event_case()) {
    case v1::SessionEvent::kSessionUpdated:
      return UpgradeUpdatedPaths(*event.mutable_session_updated());
    case v1::SessionEvent::kScanReceived:
      return UpgradeScan(*event.mutable_scan_received()->mutable_scan());
    case v1::SessionEvent::kScanReplaced:
      return UpgradeScan(*event.mutable_scan_replaced()->mutable_scan());
    case v1::SessionEvent::kScanRegistered:
      return UpgradeScan(*event.mutable_scan_registered()->mutable_scan());
    case v1::SessionEvent::kScanRefused:
      return UpgradeScan(*event.mutable_scan_refused()->mutable_scan());
    case v1::SessionEvent::kScanAccepted:
      return UpgradeScan(*event.mutable_scan_accepted()->mutable_scan());
    case v1::SessionEvent::kScanPoseSet:
      return UpgradeScan(*event.mutable_scan_pose_set()->mutable_scan());
    case v1::SessionEvent::kScanMerged:
      return UpgradeScan(*event.mutable_scan_merged()->mutable_scan());
    case v1::SessionEvent::kScanWithdrawn:
      return UpgradeScan(*event.mutable_scan_withdrawn()->mutable_scan());
    case v1::SessionEvent::kScanRemoved:
      return UpgradeScan(*event.mutable_scan_removed()->mutable_scan());
    case v1::SessionEvent::kPlanCreated:
      return UpgradePlan(*event.mutable_plan_created()->mutable_plan());
    case v1::SessionEvent::kPlanEnded:
      return UpgradePlan(*event.mutable_plan_ended()->mutable_plan());
    case v1::SessionEvent::kScannerCreated: {
      v1::Scanner& scanner = *event.mutable_scanner_created()->mutable_scanner();
      if (const auto takes = TakeDuration(UnknownOf(scanner), 8)) {
        *scanner.mutable_scan_duration() = *takes;
      }
      return;
    }
    case v1::SessionEvent::kClaimEnded: {
      v1::ClaimEndedEvent& ended = *event.mutable_claim_ended();
      const std::vector<std::string> reason = TakeTexts(UnknownOf(ended), 2);
      if (reason.empty()) return;
      ended.set_end_reason(
          ByName<v1::ClaimEndReason>(kClaimEnds, reason.back(), v1::CLAIM_END_REASON_UNSPECIFIED));
      return;
    }
    case v1::SessionEvent::kSessionCreated:
    case v1::SessionEvent::kUploadCreated:
    case v1::SessionEvent::kUploadReceived:
    case v1::SessionEvent::kUploadEnded:
    case v1::SessionEvent::kViewRejected:
    case v1::SessionEvent::kRejectionDeleted:
    case v1::SessionEvent::kClaimTaken:
    case v1::SessionEvent::kClaimRenewed:
    case v1::SessionEvent::kStationCreated:
    case v1::SessionEvent::kStationEnded:
    case v1::SessionEvent::kScannerUpdated:
    case v1::SessionEvent::kScannerDeleted:
    case v1::SessionEvent::kPlanDeleted:
    case v1::SessionEvent::kPosesAdjusted:
    case v1::SessionEvent::kSitePriorSet:
    case v1::SessionEvent::kSitePriorCleared:
    case v1::SessionEvent::kEventsLeftOut:
    case v1::SessionEvent::EVENT_NOT_SET:
      return;  // none of their fields has another type
  }
}

}  // namespace

void Upgrade(v1::PlanResult& result) {
  // Each was a message of its own: 1 the stage's name, 2 its seconds.
  for (const std::string& bytes : TakeTexts(UnknownOf(result), 16)) {
    UnknownFieldSet stage;
    if (!stage.ParseFromString(bytes)) continue;
    v1::StageDuration& written = *result.add_stage_durations();
    const std::vector<std::string> name = TakeTexts(stage, 1);
    if (!name.empty()) {
      written.set_stage(ByName<v1::PlanStage>(kStages, name.back(), v1::PLAN_STAGE_UNSPECIFIED));
    }
    if (const auto took = TakeDuration(stage, 2)) *written.mutable_duration() = *took;
  }
  for (v1::RankedView& view : *result.mutable_views()) UpgradeView(view);
  for (v1::RankedView& view : *result.mutable_refused()) UpgradeView(view);
}

void Upgrade(storage::v1::LogEntry& entry) {
  if (entry.format_version() >= kLogFormatVersion) return;
  UpgradeEvent(*entry.mutable_event());
  if (entry.request().method() == "AddScanner") {
    entry.mutable_request()->set_method("CreateScanner");
  }
  entry.set_format_version(kLogFormatVersion);
}

}  // namespace vantage::store

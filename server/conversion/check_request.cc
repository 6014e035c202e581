#include "server/conversion/check_request.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/site_prior/site_prior.h"
#include "google/protobuf/util/field_mask_util.h"
#include "google/protobuf/util/time_util.h"
#include "server/contract/error.h"
#include "server/contract/resource_names.h"
#include "server/conversion/fleet_proto.h"
#include "server/conversion/from_proto.h"
#include "server/conversion/to_proto.h"

namespace vantage::conversion {
namespace {

constexpr size_t kMaxUploadName = 200;
constexpr size_t kMaxReason = 500;
constexpr size_t kMaxFilterText = 200;
constexpr int kMaxExportedScans = 1000;
constexpr double kDefaultBudget = 1.0;  // s
constexpr double kMinBudget = 0.01;
constexpr double kMaxBudget = 3600;
constexpr double kDefaultTourBudget = 30;  // s
constexpr double kMinTourBudget = 0.1;
constexpr double kMaxTourBudget = 600;
constexpr double kLongestDay = 1000 * 3600.0;      // s
constexpr double kLatestOpening = 10000 * 3600.0;  // s
constexpr int kMaxTourScanners = 16;
constexpr int kMaxRoomHours = 64;
constexpr int kMaxPreviousStations = 1000;
// Of a plan: days of work. The log keeps them with every plan.
constexpr int kMaxTourStations = 256;
constexpr int kMaxTourScans = 10000;
constexpr int kFewestTourCandidates = 10;
constexpr int kMostTourCandidates = 2000;
constexpr double kDefaultRejectionRadius = 0.5;         // m
constexpr double kLongestRejection = 10 * 366 * 86400;  // s, ten years
constexpr absl::Duration kDefaultClaim = absl::Minutes(30);

// The fields that an update may change, each with everything below it.
constexpr const char* kUpdatable[] = {"display_name", "scanner_models", "planning_config",
                                      "site_rules"};

bool Updatable(const std::string& path) {
  return google::protobuf::util::FieldMaskUtil::IsValidPath<v1::Session>(path) &&
         std::any_of(std::begin(kUpdatable), std::end(kUpdatable), [&](const char* field) {
           return path == field || absl::StartsWith(path, absl::StrCat(field, "."));
         });
}

// A filter by states: enum values other than 0, by `known`, of a `kind` ("scan").
absl::Status CheckStates(const google::protobuf::RepeatedField<int>& states, bool (*known)(int),
                         absl::string_view kind) {
  constexpr int kMost = 16;
  contract::Violations violations;
  if (states.size() > kMost) {
    violations.Add("states", absl::StrCat("names ", states.size(), ", at most ", kMost));
  }
  for (int i = 0; i < std::min(states.size(), kMost); ++i) {
    if (states[i] != 0 && known(states[i])) continue;
    violations.Add(absl::StrCat("states[", i, "]"), absl::StrCat("is no state of a ", kind));
  }
  return violations.ToStatus();
}

absl::Status CheckRequestIdAlone(const std::string& request_id) {
  contract::Violations violations;
  CheckRequestId(request_id, violations);
  return violations.ToStatus();
}

// `Request` has a position, m, world.
template <typename Request>
void CheckPosition(const Request& request, contract::Violations& violations) {
  if (!request.has_position()) violations.Add("position", "is required");
  ReadVector(request.position(), "position", violations);
}

// `Request` may have a heading, rad.
template <typename Request>
void CheckHeading(const Request& request, contract::Violations& violations) {
  if (request.has_heading_rad()) ReadHeading(request.heading_rad(), "heading_rad", violations);
}

template <typename Request>
absl::Duration TtlOf(const Request& request) {
  if (!request.has_ttl()) return kDefaultClaim;
  return absl::Seconds(request.ttl().seconds()) + absl::Nanoseconds(request.ttl().nanos());
}

template <typename Request>
void CheckTtl(const Request& request, contract::Violations& violations) {
  const absl::Duration asked = TtlOf(request);
  if (asked >= absl::Seconds(10) && asked <= absl::Hours(24)) return;
  violations.Add("ttl", absl::StrCat("is ", absl::FormatDuration(asked), ", must be 10 s to 24 h"));
}

}  // namespace

v1::Session Completed(const v1::Session& asked) {
  v1::Session session;
  session.set_display_name(asked.display_name());
  *session.mutable_scanner_models() = asked.scanner_models();
  if (session.scanner_models().empty()) session.add_scanner_models();
  for (v1::ScannerModel& scanner : *session.mutable_scanner_models()) FillDefaults(scanner);
  *session.mutable_model_config() = asked.model_config();
  FillDefaults(*session.mutable_model_config());
  *session.mutable_planning_config() = asked.planning_config();
  FillDefaults(*session.mutable_planning_config());
  *session.mutable_site_rules() = asked.site_rules();
  if (asked.has_origin()) *session.mutable_origin() = asked.origin();
  return session;
}

PlanBudget ReadPlanBudget(const v1::Plan& plan) {
  if (plan.has_work_limit_rays()) return {0, plan.work_limit_rays()};
  return {plan.has_time_budget() ? ReadDuration(plan.time_budget()) : kDefaultBudget, 0};
}

PlanBudget ReadTourBudget(const v1::TourWish& wish) {
  if (wish.has_work_limit_rays()) return {0, wish.work_limit_rays()};
  return {wish.has_time_budget() ? ReadDuration(wish.time_budget()) : kDefaultTourBudget, 0};
}

double ReadRadius(const v1::RejectViewRequest& request) {
  return request.has_radius_m() ? request.radius_m() : kDefaultRejectionRadius;
}

absl::Duration ReadTtl(const v1::ClaimViewRequest& request) { return TtlOf(request); }
absl::Duration ReadTtl(const v1::RenewClaimRequest& request) { return TtlOf(request); }

absl::Status CheckRequest(const v1::CreateSessionRequest& request) {
  contract::Violations violations;
  CheckRequestId(request.request_id(), violations);
  if (!request.session_id().empty() && !contract::IsValidId(request.session_id())) {
    violations.Add("session_id", "must be 1 to 63 of [a-z0-9-], starting with a letter");
  }
  CheckSession(Completed(request.session()), "session.", violations);
  return violations.ToStatus();
}

absl::Status CheckRequest(const v1::UpdateSessionRequest& request) {
  contract::Violations violations;
  CheckRequestId(request.request_id(), violations);
  const google::protobuf::FieldMask& mask = request.update_mask();
  if (mask.paths().empty()) violations.Add("update_mask", "must name at least one field");
  for (const std::string& path : mask.paths()) {
    if (Updatable(path)) continue;
    violations.Add("update_mask",
                   absl::StrCat("'", path,
                                "' is no field that can be updated; those are "
                                "display_name, scanner_models, planning_config, site_rules"));
  }
  return violations.ToStatus();
}

absl::Status CheckRequest(const v1::DeleteSessionRequest& request) {
  return CheckRequestIdAlone(request.request_id());
}

absl::Status CheckRequest(const v1::ImportSessionRequest& request, const contract::Limits& limits) {
  contract::Violations violations;
  if (request.request_id().empty()) {
    violations.Add("request_id", "is required: it is the name of the import");
  }
  CheckRequestId(request.request_id(), violations);
  if (!request.session_id().empty() && !contract::IsValidId(request.session_id())) {
    violations.Add("session_id", "must be 1 to 63 of [a-z0-9-], starting with a letter");
  }
  if (request.offset() < 0) {
    violations.Add("offset", absl::StrCat("is ", request.offset(), ", must not be negative"));
  }
  if (request.data().empty() || static_cast<int64_t>(request.data().size()) > limits.piece_bytes) {
    violations.Add("data", absl::StrCat("has ", request.data().size(), " bytes, must have 1 to ",
                                        limits.piece_bytes));
  }
  return violations.ToStatus();
}

namespace {

// How large it may be is the session's matter.
void CheckFile(const v1::Upload& asked, contract::Violations& violations) {
  const v1::ScanFile& file = asked.file();
  CheckText(file.name(), kMaxUploadName, "upload.file.name", violations);
  if (file.has_station()) ReadVector(file.station(), "upload.file.station", violations);
  const auto within = [&](double value, double least, double most, const char* field) {
    if (value == 0 || (value >= least && value <= most)) return;
    violations.Add(field, absl::StrCat("is ", value, ", must be ", least, " to ", most, ", or 0"));
  };
  within(file.unit_m(), 1e-6, 1e6, "upload.file.unit_m");
  within(file.preview_step_rad(), 1e-4, 0.2, "upload.file.preview_step_rad");
  if (!asked.has_total()) {
    violations.Add("upload.total", "is required with a file");
    return;
  }
  if (asked.total().encoded_size_bytes() < 1) {
    violations.Add("upload.total.encoded_size_bytes", "the file is empty");
  }
  if (asked.total().sha256().size() != 32) {
    violations.Add("upload.total.sha256",
                   absl::StrCat("has ", asked.total().sha256().size(), " bytes, must have 32"));
  }
}

}  // namespace

absl::Status CheckRequest(const v1::CreateUploadRequest& request, const contract::Limits& limits) {
  const v1::Upload& asked = request.upload();
  contract::Violations violations;
  CheckRequestId(request.request_id(), violations);
  CheckText(asked.display_name(), kMaxUploadName, "upload.display_name", violations);
  if (asked.has_scanner_model()) {
    ReadScannerModel(asked.scanner_model(), "upload.scanner_model", violations);
  }
  if (asked.has_prior()) {
    ReadPosePrior(asked.prior(), Eigen::Vector3d::Zero(), "upload.prior", violations);
  }
  CheckTargets(asked.targets(), "upload.targets", violations);
  if (asked.has_file()) {
    CheckFile(asked, violations);
  } else if (asked.has_total()) {
    const v1::UploadTotal& total = asked.total();
    if (total.encoded_size_bytes() < 1 || total.encoded_size_bytes() > limits.encoded_scan_bytes) {
      violations.Add("upload.total.encoded_size_bytes",
                     absl::StrCat("is ", total.encoded_size_bytes(), " bytes, must be 1 to ",
                                  limits.encoded_scan_bytes, "; thin the scan"));
    }
    if (total.sha256().size() != 32) {
      violations.Add("upload.total.sha256",
                     absl::StrCat("has ", total.sha256().size(), " bytes, must have 32"));
    }
  }
  return violations.ToStatus();
}

absl::Status CheckRequest(const v1::AcceptScanRequest& request) {
  contract::Violations violations;
  CheckRequestId(request.request_id(), violations);
  if (request.rival_pose() < 0) {
    violations.Add("rival_pose", absl::StrCat("is ", request.rival_pose(),
                                              "; 0 is the aligned pose, the others count from 1"));
  }
  if (request.proposed() && request.rival_pose() > 0) {
    violations.Add("proposed", "names a pose, and rival_pose another; set one of them");
  }
  return violations.ToStatus();
}

absl::Status CheckRequest(const v1::CompareScanPosesRequest& request) {
  contract::Violations violations;
  const auto check = [&](int count, int most, absl::string_view field) {
    if (count == 0 || (count >= 100 && count <= most)) return;
    violations.Add(std::string(field),
                   absl::StrCat("is ", count, ", must be 0 or in [100, ", most, "]"));
  };
  check(request.max_sample_count(), 20'000, "max_sample_count");
  check(request.max_surface_count(), 40'000, "max_surface_count");
  return violations.ToStatus();
}

absl::Status CheckRequest(const v1::SetScanPoseRequest& request) {
  contract::Violations violations;
  CheckRequestId(request.request_id(), violations);
  if (!request.has_prior()) violations.Add("prior", "is required");
  if (request.has_prior()) {
    ReadPosePrior(request.prior(), Eigen::Vector3d::Zero(), "prior", violations);
  }
  if (!v1::PoseUse_IsValid(request.use())) violations.Add("use", "must be ALIGN or AS_IS");
  return violations.ToStatus();
}

absl::Status CheckRequest(const v1::WithdrawScanRequest& request) {
  return CheckRequestIdAlone(request.request_id());
}

absl::Status CheckRequest(const v1::CreatePlanRequest& request) {
  const v1::Plan& asked = request.plan();
  contract::Violations violations;
  CheckRequestId(request.request_id(), violations);
  const PlanBudget budget = ReadPlanBudget(asked);
  if (asked.has_work_limit_rays()) {
    if (budget.work_limit == 0) violations.Add("plan.work_limit_rays", "must be above 0 rays");
  } else if (!(budget.seconds >= kMinBudget && budget.seconds <= kMaxBudget)) {
    violations.Add("plan.time_budget", absl::StrCat("is ", budget.seconds, " s, must be in [",
                                                    kMinBudget, ", ", kMaxBudget, "]"));
  }
  if (!v1::Ranking_IsValid(asked.ranking())) {
    violations.Add("plan.ranking", "must be RANKING_SCORE or RANKING_SCORE_PER_MINUTE");
  }
  if (asked.tour_stations_size() > kMaxTourStations) {
    violations.Add("plan.tour_stations",
                   absl::StrCat("has ", asked.tour_stations_size(), " entries, at most ",
                                kMaxTourStations, " fit: give those that come next"));
  }
  for (int i = 0; i < std::min(asked.tour_stations_size(), kMaxTourStations); ++i) {
    ReadVector(asked.tour_stations(i), absl::StrCat("plan.tour_stations[", i, "]"), violations);
  }
  return violations.ToStatus();
}

absl::Status CheckRequest(const v1::EvaluateViewRequest& request) {
  contract::Violations violations;
  CheckPosition(request, violations);
  CheckHeading(request, violations);
  return violations.ToStatus();
}

absl::Status CheckRequest(const v1::CreateTourRequest& request) {
  const v1::TourWish& wish = request.wish();
  contract::Violations violations;
  const auto most = [&](int count, int limit, const char* field) {
    if (count > limit) {
      violations.Add(field, absl::StrCat("has ", count, " entries, at most ", limit, " fit"));
    }
  };
  most(wish.scanners_size(), kMaxTourScanners, "wish.scanners");
  most(wish.hours_size(), kMaxRoomHours, "wish.hours");
  most(wish.previous_stations_size(), kMaxPreviousStations, "wish.previous_stations");
  if (wish.previous_stations_size() > 0 &&
      (wish.has_available_scan_count() || wish.has_available_duration())) {
    violations.Add("wish.previous_stations",
                   "goes with a goal, not with available_scan_count or available_duration");
  }
  const auto duration = [&](const google::protobuf::Duration& asked, double least, double longest,
                            const std::string& field) {
    const double seconds = ReadDuration(asked);
    const bool whole = asked.nanos() > -1'000'000'000 && asked.nanos() < 1'000'000'000;
    if (whole && seconds >= least && seconds <= longest) return;
    violations.Add(field,
                   absl::StrCat("is ", seconds, " s, must be in [", least, ", ", longest, "]"));
  };
  if (wish.scanners_size() > 0 && !wish.scanner_model_id().empty()) {
    violations.Add("wish.scanner_model_id",
                   "must be empty where scanners are named: each has its own");
  }
  if (wish.has_goal() && !(wish.goal() > 0 && wish.goal() <= 1)) {
    violations.Add("wish.goal", absl::StrCat("is ", wish.goal(), ", must be in (0, 1]"));
  }
  if (wish.has_available_duration()) {
    duration(wish.available_duration(), 1, kLongestDay, "wish.available_duration");
  }
  if (wish.has_day_duration()) duration(wish.day_duration(), 1, kLongestDay, "wish.day_duration");
  const auto count = [&](bool given, int value, int least, int limit, const char* field) {
    if (!given || (value >= least && value <= limit)) return;
    violations.Add(field, absl::StrCat("is ", value, ", must be in [", least, ", ", limit, "]"));
  };
  count(wish.has_available_scan_count(), wish.available_scan_count(), 1, kMaxTourScans,
        "wish.available_scan_count");
  count(wish.has_max_candidate_count(), wish.max_candidate_count(), kFewestTourCandidates,
        kMostTourCandidates, "wish.max_candidate_count");
  for (int i = 0; i < std::min(wish.hours_size(), kMaxRoomHours); ++i) {
    const v1::RoomHours& hours = wish.hours(i);
    const std::string at = absl::StrCat("wish.hours[", i, "]");
    if (hours.region().empty()) violations.Add(at + ".region", "is required");
    duration(hours.open_after(), 0, kLatestOpening, at + ".open_after");
    if (!hours.has_closed_after()) continue;
    duration(hours.closed_after(), 0, kLatestOpening, at + ".closed_after");
    if (!(ReadDuration(hours.closed_after()) > ReadDuration(hours.open_after()))) {
      violations.Add(at + ".closed_after", "must be later than open_after");
    }
  }
  for (int i = 0; i < std::min(wish.previous_stations_size(), kMaxPreviousStations); ++i) {
    ReadVector(wish.previous_stations(i), absl::StrCat("wish.previous_stations[", i, "]"),
               violations);
  }
  const PlanBudget budget = ReadTourBudget(wish);
  if (wish.has_work_limit_rays()) {
    if (budget.work_limit == 0) violations.Add("wish.work_limit_rays", "must be above 0 rays");
  } else if (wish.has_time_budget()) {
    duration(wish.time_budget(), kMinTourBudget, kMaxTourBudget, "wish.time_budget");
  }
  return violations.ToStatus();
}

absl::Status CheckRequest(const v1::RejectViewRequest& request) {
  contract::Violations violations;
  CheckRequestId(request.request_id(), violations);
  CheckPosition(request, violations);
  const double radius = ReadRadius(request);
  if (!(radius > 0 && radius <= 100)) {
    violations.Add("radius_m", absl::StrCat("is ", radius, " m, must be in (0, 100]"));
  }
  CheckText(request.reason(), kMaxReason, "reason", violations);
  const double ttl = ReadDuration(request.ttl());
  if (request.has_ttl() && !(ttl >= 1 && ttl <= kLongestRejection)) {
    violations.Add("ttl", absl::StrCat("is ", ttl, " s, must be 1 s to 10 years"));
  }
  return violations.ToStatus();
}

absl::Status CheckRequest(const v1::ExportModelRequest& request) {
  const v1::ExportFormat format = request.format();
  if (!v1::ExportFormat_IsValid(format) || format == v1::EXPORT_FORMAT_UNSPECIFIED) {
    return contract::InvalidField("format", "must be one of the EXPORT_FORMAT values");
  }
  if (request.scans_size() > 0 && format != v1::EXPORT_FORMAT_SCANS_PLY &&
      format != v1::EXPORT_FORMAT_SCANS_E57) {
    return contract::InvalidField(
        "scans", "only goes with EXPORT_FORMAT_SCANS_PLY and EXPORT_FORMAT_SCANS_E57");
  }
  if (request.scans_size() > kMaxExportedScans) {
    return contract::InvalidField(
        "scans",
        absl::StrCat("has ", request.scans_size(), " names, at most ", kMaxExportedScans, " fit"));
  }
  return absl::OkStatus();
}

absl::Status CheckRequest(const v1::ExportReportRequest& request) {
  contract::Violations violations;
  // No place on earth is farther from UTC than 14 hours; protobufs' zones go to 18.
  constexpr double kMostOffset = 18 * 3600;
  const double offset = ReadDuration(request.utc_offset());
  if (!(std::abs(offset) <= kMostOffset) || std::fmod(offset, 60) != 0) {
    violations.Add("utc_offset",
                   absl::StrCat("is ", offset, " s, must be whole minutes within 18 h of UTC"));
  }
  if (request.has_required_coverage() &&
      !(request.required_coverage() > 0 && request.required_coverage() <= 1)) {
    violations.Add("required_coverage",
                   absl::StrCat("is ", request.required_coverage(), ", must be a share in (0, 1]"));
  }
  return violations.ToStatus();
}

absl::Status CheckRequest(const v1::CreateScannerRequest& request) {
  contract::Violations violations;
  CheckRequestId(request.request_id(), violations);
  if (!request.has_scanner()) violations.Add("scanner", "is required");
  if (!request.scanner_id().empty() && !contract::IsValidId(request.scanner_id())) {
    violations.Add("scanner_id",
                   "must be 1 to 63 of [a-z0-9-], start with a letter and not end in '-'");
  }
  CheckScanner(request.scanner(), "scanner", violations);
  return violations.ToStatus();
}

absl::Status CheckRequest(const v1::ClaimViewRequest& request) {
  contract::Violations violations;
  CheckRequestId(request.request_id(), violations);
  CheckPosition(request, violations);
  CheckHeading(request, violations);
  CheckTtl(request, violations);
  return violations.ToStatus();
}

absl::Status CheckRequest(const v1::RenewClaimRequest& request) {
  contract::Violations violations;
  CheckRequestId(request.request_id(), violations);
  CheckTtl(request, violations);
  return violations.ToStatus();
}

absl::Status CheckRequest(const v1::ReleaseClaimRequest& request) {
  return CheckRequestIdAlone(request.request_id());
}

absl::Status CheckRequest(const v1::CreateStationRequest& request) {
  contract::Violations violations;
  CheckRequestId(request.request_id(), violations);
  const v1::Station& station = request.station();
  if (!station.has_position()) violations.Add("station.position", "is required");
  ReadVector(station.position(), "station.position", violations);
  if (station.has_heading_rad()) {
    ReadHeading(station.heading_rad(), "station.heading_rad", violations);
  }
  if (station.has_loss_chance() && !(station.loss_chance() >= 0 && station.loss_chance() < 1)) {
    violations.Add("station.loss_chance", "must be in [0, 1)");
  }
  return violations.ToStatus();
}

absl::Status CheckRequest(const v1::ListSessionsRequest& request) {
  contract::Violations violations;
  CheckText(request.text(), kMaxFilterText, "text", violations);
  using Times = google::protobuf::util::TimeUtil;
  const google::protobuf::Timestamp& after = request.updated_after();
  if (after.seconds() < Times::kTimestampMinSeconds ||
      after.seconds() > Times::kTimestampMaxSeconds || after.nanos() < 0 ||
      after.nanos() > 999'999'999) {
    violations.Add("updated_after", "must be a time from 0001-01-01 to 9999-12-31");
  }
  return violations.ToStatus();
}

absl::Status CheckRequest(const v1::ListScansRequest& request) {
  return CheckStates(request.states(), v1::ScanState_IsValid, "scan");
}

absl::Status CheckRequest(const v1::ListPlansRequest& request) {
  return CheckStates(request.states(), v1::PlanState_IsValid, "plan");
}

absl::Status CheckRequest(const v1::ListUploadsRequest& request) {
  return CheckStates(request.states(), v1::UploadState_IsValid, "upload");
}

absl::Status CheckRequest(const v1::CancelPlanRequest& request) {
  return CheckRequestIdAlone(request.request_id());
}

absl::Status CheckRequest(const v1::DeletePlanRequest& request) {
  return CheckRequestIdAlone(request.request_id());
}

absl::Status CheckRequest(const v1::UpdateScannerRequest& request) {
  constexpr const char* kFields[] = {"display_name", "scanner_model_id", "operator",
                                     "reach",        "speed_m_per_s",    "scan_duration"};
  contract::Violations violations;
  CheckRequestId(request.request_id(), violations);
  const google::protobuf::FieldMask& mask = request.update_mask();
  if (mask.paths().empty()) violations.Add("update_mask", "must name at least one field");
  for (const std::string& path : mask.paths()) {
    if (std::find(std::begin(kFields), std::end(kFields), path) != std::end(kFields)) continue;
    violations.Add("update_mask",
                   absl::StrCat("'", path, "' is no field that can be updated; those are ",
                                absl::StrJoin(kFields, ", ")));
  }
  CheckScanner(request.scanner(), "scanner", violations);
  return violations.ToStatus();
}

absl::Status CheckRequest(const v1::DeleteScannerRequest& request) {
  return CheckRequestIdAlone(request.request_id());
}

absl::Status CheckRequest(const v1::AbortUploadRequest& request) {
  return CheckRequestIdAlone(request.request_id());
}

absl::Status CheckRequest(const v1::ClearSitePriorRequest& request) {
  return CheckRequestIdAlone(request.request_id());
}

absl::Status CheckRequest(const v1::SetSitePriorRequest& request) {
  constexpr size_t kMostSent = size_t{3} << 20;
  constexpr int64_t kMostUnfolded = int64_t{64} << 20;
  contract::Violations violations;
  CheckRequestId(request.request_id(), violations);
  const v1::SitePrior& prior = request.site_prior();
  if (prior.source_session().empty() == request.file().empty()) {
    violations.Add("file", "is required, or site_prior.source_session, and not both");
  }
  if (request.file().size() > kMostSent) {
    violations.Add("file", absl::StrCat("is ", request.file().size(), " bytes, at most ", kMostSent,
                                        " are taken: compress it, or simplify the mesh"));
  }
  if (request.compression() == v1::COMPRESSION_ZSTD &&
      !(request.uncompressed_size_bytes() > 0 &&
        request.uncompressed_size_bytes() <= kMostUnfolded)) {
    violations.Add("uncompressed_size_bytes",
                   absl::StrCat("is ", request.uncompressed_size_bytes(), ", must be in [1, ",
                                kMostUnfolded, "]"));
  }
  const auto sent = static_cast<int64_t>(request.file().size());
  if (request.compression() != v1::COMPRESSION_ZSTD && request.uncompressed_size_bytes() != 0 &&
      request.uncompressed_size_bytes() != sent) {
    violations.Add("uncompressed_size_bytes",
                   absl::StrCat("is ", request.uncompressed_size_bytes(), ", file has ", sent));
  }
  CheckSitePrior(prior, "site_prior", violations);
  return violations.ToStatus();
}

void CheckSitePrior(const v1::SitePrior& prior, const std::string& field,
                    contract::Violations& violations) {
  constexpr size_t kMostName = 128;
  CheckText(prior.display_name(), kMostName, field + ".display_name", violations);
  const auto number = [&](double value, double least, double most, const char* name) {
    if (value == 0 || (value >= least && value <= most)) return;
    violations.Add(absl::StrCat(field, ".", name),
                   absl::StrCat("is ", value, ", must be in [", least, ", ", most, "]"));
  };
  number(prior.unit_m(), 1e-6, 1000, "unit_m");
  number(prior.wall_height_m(), 0.5001, 50, "wall_height_m");
  number(prior.darkest(), 0.001, 0.999, "darkest");
  number(prior.scale(), 0.1, 10, "scale");
  number(prior.accuracy_m(), 0.001, site_prior::kMostAccuracy, "accuracy_m");
  if (prior.points_size() != 2) {
    violations.Add(field + ".points",
                   absl::StrCat("has ", prior.points_size(), ", two are needed"));
  }
  for (int i = 0; i < prior.points_size() && i < 2; ++i) {
    const std::string point = absl::StrCat(field, ".points[", i, "]");
    ReadVector(prior.points(i).prior(), point + ".prior", violations);
    ReadVector(prior.points(i).site(), point + ".site", violations);
  }
}

absl::Status CheckRequest(const v1::DeleteRejectionRequest& request) {
  return CheckRequestIdAlone(request.request_id());
}

absl::Status CheckRequest(const v1::DeleteStationRequest& request) {
  return CheckRequestIdAlone(request.request_id());
}

}  // namespace vantage::conversion

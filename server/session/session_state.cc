#include "server/session/session_state.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/bytes/checksum.h"
#include "core/fleet/claims.h"
#include "server/contract/error.h"
#include "server/contract/resource_names.h"
#include "server/store/left_out.h"
#include "server/store/store.h"

namespace vantage::session {
namespace {

constexpr size_t kMaxListedRejections = 1000;

bool Before(const google::protobuf::Timestamp& a, const google::protobuf::Timestamp& b) {
  return a.seconds() != b.seconds() ? a.seconds() < b.seconds() : a.nanos() < b.nanos();
}

// True when the scan is from a place that its scanner had left before another scan of its own: that
// one arrived later, or this one is from the place of a claim that had ended without a scan.
bool IsLate(const SessionState& state, const v1::Scan& scan) {
  const google::protobuf::Timestamp* newest = nullptr;  // arrival of its other scans
  for (const auto& [name, record] : state.scans) {
    const v1::Scan& other = record.scan;
    if (!record.in_model || name == scan.name() || other.scanner() != scan.scanner()) continue;
    if (newest == nullptr || Before(*newest, other.create_time())) newest = &other.create_time();
  }
  if (newest == nullptr) return false;
  if (Before(scan.create_time(), *newest)) return true;
  const v1::Vector3& at = scan.pose().translation();
  bool lapsed = false;
  for (const auto& [name, record] : state.claims) {
    const v1::Claim& claim = record.claim;
    const double apart = std::hypot(claim.position().x() - at.x(), claim.position().y() - at.y());
    if (claim.scanner() != scan.scanner() || apart > fleet::ClaimRules().arrival_tolerance)
      continue;
    if (record.held() && Before(scan.create_time(), claim.expire_time())) return false;
    lapsed = lapsed || (record.end_reason != v1::CLAIM_END_REASON_SCAN_ARRIVED &&
                        Before(claim.create_time(), *newest));
  }
  return lapsed;
}

absl::Duration ReadSeen(const storage::v1::LogEntry& entry) {
  return absl::Seconds(entry.seen().seconds()) + absl::Nanoseconds(entry.seen().nanos());
}

void DropPreview(ScanRecord& record) {
  record.preview.Clear();
  record.preview_blob.clear();
}

absl::Status Misfit(const v1::SessionEvent& event, absl::string_view what) {
  return absl::InternalError(absl::StrCat("log entry ", event.sequence(), ": ", what));
}

}  // namespace

absl::StatusOr<size_t> PlaceAfter(const std::vector<std::string>& order, absl::string_view name) {
  if (name.empty()) return 0;
  const auto it = std::find(order.begin(), order.end(), name);
  if (it == order.end()) return contract::UnknownPageToken();
  return static_cast<size_t>(it - order.begin()) + 1;
}

absl::StatusOr<int64_t> NumberAfter(absl::string_view name, uint64_t count) {
  if (name.empty()) return 0;
  const int64_t number = contract::NumberOf(name);
  if (number <= 0 || static_cast<uint64_t>(number) > count) return contract::UnknownPageToken();
  return number;
}

std::string EtagOf(const v1::Session& session) {
  v1::Session settable;
  settable.set_display_name(session.display_name());
  *settable.mutable_scanner_models() = session.scanner_models();
  *settable.mutable_planning_config() = session.planning_config();
  *settable.mutable_site_rules() = session.site_rules();
  return absl::StrFormat("%08x", bytes::Crc32c(settable.SerializeAsString()));
}

absl::Status SessionState::Apply(const storage::v1::LogEntry& entry) {
  const v1::SessionEvent& event = entry.event();
  if (entry.format_version() > store::kLogFormatVersion) {
    return absl::FailedPreconditionError(
        absl::StrCat("log entry ", event.sequence(), " has format ", entry.format_version(),
                     ", this server reads up to ", store::kLogFormatVersion));
  }
  if (store::FirstSequence(event) != last_sequence + 1 || event.sequence() <= last_sequence) {
    return Misfit(event, "out of sequence");
  }
  std::string resource;

  const auto update_scan = [&](const v1::Scan& scan) -> absl::Status {
    const auto it = scans.find(scan.name());
    if (it == scans.end()) return Misfit(event, absl::StrCat("unknown scan ", scan.name()));
    it->second.scan = scan;
    resource = scan.name();
    return absl::OkStatus();
  };
  absl::Status status;
  switch (event.event_case()) {
    case v1::SessionEvent::kSessionCreated:
      session = event.session_created().session();
      tenant = entry.tenant();
      resource = session.name();
      break;
    case v1::SessionEvent::kSessionUpdated:
      session = event.session_updated().session();
      resource = session.name();
      break;
    case v1::SessionEvent::kUploadCreated: {
      const v1::Upload& upload = event.upload_created().upload();
      uploads[upload.name()] = upload;
      ++upload_count;
      resource = upload.name();
      break;
    }
    case v1::SessionEvent::kUploadReceived: {
      const v1::Upload& upload = event.upload_received().upload();
      uploads[upload.name()] = upload;
      files[upload.name()].last_pieces = entry.last_pieces();
      resource = upload.name();
      break;
    }
    case v1::SessionEvent::kUploadEnded: {
      const v1::Upload& upload = event.upload_ended().upload();
      uploads[upload.name()] = upload;
      resource = upload.name();
      if (upload.state() == v1::UPLOAD_STATE_COMMITTED) break;  // a file, which became scans
      ended_uploads.push_back(upload.name());
      if (ended_uploads.size() > kEndedUploads) {
        uploads.erase(ended_uploads.front());
        files.erase(ended_uploads.front());
        ended_uploads.pop_front();
      }
      break;
    }
    case v1::SessionEvent::kScanReceived: {
      const v1::Scan& scan = event.scan_received().scan();
      if (scans.count(scan.name()) != 0) {
        return Misfit(event, absl::StrCat("scan ", scan.name(), " came twice"));
      }
      ScanRecord& record = scans[scan.name()];
      record.scan = scan;
      record.blob = entry.blob();
      record.received_bytes = scan.encoded_size_bytes();
      record.last_pieces = entry.last_pieces();
      scan_order.push_back(scan.name());
      EndWithScan(scan);
      resource = scan.name();
      break;
    }
    case v1::SessionEvent::kScanReplaced: {
      const v1::Scan& scan = event.scan_replaced().scan();
      const auto known = scans.find(scan.name());
      if (known != scans.end() && known->second.preview_blob == entry.blob()) {
        DropPreview(known->second);  // what came was another scan, and the preview is back
      } else if (known != scans.end() && known->second.in_model &&
                 known->second.preview_blob.empty()) {
        known->second.preview = known->second.scan;
        known->second.preview_blob = known->second.blob;
      }
      status = update_scan(scan);
      if (!status.ok()) break;
      ScanRecord& record = scans[resource];
      record.blob = entry.blob();
      record.received_bytes = scan.encoded_size_bytes();
      record.last_pieces = entry.last_pieces();
      EndWithScan(scan);
      break;
    }
    case v1::SessionEvent::kScanRegistered:
      status = update_scan(event.scan_registered().scan());
      break;
    case v1::SessionEvent::kScanRefused:
      status = update_scan(event.scan_refused().scan());
      break;
    case v1::SessionEvent::kScanAccepted:
      status = update_scan(event.scan_accepted().scan());
      break;
    case v1::SessionEvent::kScanPoseSet:
      status = update_scan(event.scan_pose_set().scan());
      break;
    case v1::SessionEvent::kScanMerged:
      status = update_scan(event.scan_merged().scan());
      if (status.ok()) {
        ScanRecord& record = scans[resource];
        const v1::Scan& scan = event.scan_merged().scan();
        model_version = scan.merge().model_version();
        if (!record.in_model) record.entered = model_version;
        record.in_model = true;
        DropPreview(record);
        status = SetLinks(event, resource);
        const auto scanner = scanners.find(scan.scanner());
        if (scanner != scanners.end() && !IsLate(*this, scan)) {
          *scanner->second.mutable_last_pose() = scan.pose();
        }
      }
      break;
    case v1::SessionEvent::kScanWithdrawn:
      status = update_scan(event.scan_withdrawn().scan());
      if (status.ok()) scans[resource].withdrawn = ReadSeen(entry);
      // Its data are erased some time after it was withdrawn.
      if (status.ok() && event.scan_withdrawn().scan().encoded_size_bytes() == 0) {
        scans[resource].blob.clear();
      }
      break;
    case v1::SessionEvent::kScanRemoved:
      status = update_scan(event.scan_removed().scan());
      if (status.ok()) {
        scans[resource].in_model = false;
        scans[resource].removed = entry.event().sequence();
        DropPreview(scans[resource]);
        model_version = event.scan_removed().model_version();
        status = SetLinks(event, resource);
      }
      break;
    case v1::SessionEvent::kPosesAdjusted:
      status = AdjustPoses(event);
      break;
    case v1::SessionEvent::kPlanCreated: {
      const v1::Plan& plan = event.plan_created().plan();
      plans[plan.name()] = {plan, ""};
      plan_order.push_back(plan.name());
      ++plan_count;
      resource = plan.name();
      break;
    }
    case v1::SessionEvent::kPlanEnded: {
      const v1::Plan& plan = event.plan_ended().plan();
      const auto it = plans.find(plan.name());
      if (it == plans.end()) return Misfit(event, absl::StrCat("unknown plan ", plan.name()));
      it->second = {plan, entry.blob()};
      resource = plan.name();
      break;
    }
    case v1::SessionEvent::kPlanDeleted:
      resource = event.plan_deleted().plan();
      if (plans.erase(resource) == 0) {
        return Misfit(event, absl::StrCat("unknown plan ", resource));
      }
      std::erase(plan_order, resource);
      break;
    case v1::SessionEvent::kSitePriorSet:
      site_prior = event.site_prior_set().site_prior();
      site_prior_blob = entry.blob();
      site_prior_set = event.sequence();
      resource = site_prior.name();
      break;
    case v1::SessionEvent::kSitePriorCleared:
      resource = event.site_prior_cleared().site_prior().name();
      site_prior.Clear();
      site_prior_blob.clear();
      site_prior_set = 0;
      break;
    case v1::SessionEvent::kViewRejected:
      std::erase_if(rejections, [&](const v1::Rejection& rejection) {
        return rejection.has_expire_time() && Before(rejection.expire_time(), event.time());
      });
      rejections.push_back(event.view_rejected().rejection());
      ++rejection_count;
      resource = event.view_rejected().rejection().name();
      break;
    case v1::SessionEvent::kRejectionDeleted:
      resource = event.rejection_deleted().rejection().name();
      std::erase_if(rejections,
                    [&](const v1::Rejection& rejection) { return rejection.name() == resource; });
      break;
    case v1::SessionEvent::kScannerCreated: {
      const v1::Scanner& scanner = event.scanner_created().scanner();
      if (!scanners.emplace(scanner.name(), scanner).second) {
        return Misfit(event, absl::StrCat("scanner ", scanner.name(), " came twice"));
      }
      scanner_order.push_back(scanner.name());
      resource = scanner.name();
      break;
    }
    case v1::SessionEvent::kScannerUpdated: {
      const v1::Scanner& scanner = event.scanner_updated().scanner();
      const auto it = scanners.find(scanner.name());
      if (it == scanners.end()) {
        return Misfit(event, absl::StrCat("unknown scanner ", scanner.name()));
      }
      it->second = scanner;
      resource = scanner.name();
      break;
    }
    case v1::SessionEvent::kScannerDeleted:
      resource = event.scanner_deleted().scanner().name();
      if (scanners.erase(resource) == 0) {
        return Misfit(event, absl::StrCat("unknown scanner ", resource));
      }
      break;
    case v1::SessionEvent::kClaimTaken: {
      const v1::Claim& claim = event.claim_taken().claim();
      if (scanners.count(claim.scanner()) == 0) {
        return Misfit(event, absl::StrCat("unknown scanner ", claim.scanner()));
      }
      if (!claims.emplace(claim.name(), ClaimRecord{claim, entry.caller()}).second) {
        return Misfit(event, absl::StrCat("claim ", claim.name(), " came twice"));
      }
      held_claims.push_back(claim.name());
      resource = claim.name();
      break;
    }
    case v1::SessionEvent::kClaimRenewed:
    case v1::SessionEvent::kClaimEnded: {
      const bool renewed = event.has_claim_renewed();
      const v1::Claim& claim =
          renewed ? event.claim_renewed().claim() : event.claim_ended().claim();
      const auto it = claims.find(claim.name());
      if (it == claims.end() || !it->second.held()) {
        return Misfit(event, absl::StrCat("claim ", claim.name(), " is not held"));
      }
      it->second.claim = claim;
      if (!renewed) {
        if (event.claim_ended().end_reason() == v1::CLAIM_END_REASON_UNSPECIFIED) {
          return Misfit(event, absl::StrCat("claim ", claim.name(), " ends for no known reason"));
        }
        it->second.end_reason = event.claim_ended().end_reason();
        held_claims.erase(std::find(held_claims.begin(), held_claims.end(), claim.name()));
      }
      resource = claim.name();
      break;
    }
    case v1::SessionEvent::kStationCreated: {
      const v1::Station& station = event.station_created().station();
      if (!stations.emplace(station.name(), station).second) {
        return Misfit(event, absl::StrCat("station ", station.name(), " came twice"));
      }
      station_order.push_back(station.name());
      ++station_count;
      resource = station.name();
      break;
    }
    case v1::SessionEvent::kStationEnded: {
      resource = event.station_ended().station().name();
      if (stations.erase(resource) == 0) {
        return Misfit(event, absl::StrCat("station ", resource, " waits for no scan"));
      }
      std::erase(station_order, resource);
      break;
    }
    case v1::SessionEvent::kEventsLeftOut:
      upload_count += entry.left_out().created_upload_count();
      rejection_count += entry.left_out().rejection_count();
      station_count += entry.left_out().created_station_count();
      plan_count += entry.left_out().created_plan_count();
      resource = entry.left_out().resource();
      break;
    case v1::SessionEvent::EVENT_NOT_SET:
      return Misfit(event, "of a kind that this server does not know");
  }
  if (!status.ok()) return status;
  if (entry.has_request()) {
    const std::string& id = entry.request().id();
    requests[id] = {entry.request().method(), entry.request().fingerprint(), resource,
                    event.sequence()};
    // The registry asks for the session's own as long as it lives.
    if (!event.has_session_created()) request_order.emplace_back(event.sequence(), id);
    if (request_order.size() > kRequests) {
      const auto& [sequence, oldest] = request_order.front();
      // One that was forgotten may have been used again.
      const auto record = requests.find(oldest);
      if (record != requests.end() && record->second.sequence == sequence) requests.erase(record);
      request_order.pop_front();
    }
  }
  *session.mutable_update_time() = event.time();
  last_sequence = event.sequence();
  last_seen = std::max(last_seen, ReadSeen(entry));
  last_resource = resource;
  return absl::OkStatus();
}

absl::Status SessionState::SetLinks(const v1::SessionEvent& event, const std::string& scan) {
  const size_t gone = std::erase_if(links, [&](const auto& link) {
    return link.first.first == scan || link.first.second == scan;
  });
  for (const v1::ScanLink& link : event.scan_merged().links()) {
    const bool first = link.first_scan() == scan;
    const std::string& other = first ? link.second_scan() : link.first_scan();
    if (!first && link.second_scan() != scan) return Misfit(event, "a link of other scans");
    if (!scans.contains(other) || !(link.first_scan() < link.second_scan())) {
      return Misfit(event, absl::StrCat("a link to ", other));
    }
    links[{link.first_scan(), link.second_scan()}] = link;
  }
  poses_due = poses_due || gone > 0 || event.scan_merged().links_size() > 0;
  return absl::OkStatus();
}

absl::Status SessionState::AdjustPoses(const v1::SessionEvent& event) {
  for (const v1::AdjustedPose& adjusted : event.poses_adjusted().poses()) {
    const auto it = scans.find(adjusted.scan());
    if (it == scans.end()) return Misfit(event, absl::StrCat("unknown scan ", adjusted.scan()));
    const auto adjust = [&](v1::Scan& scan) {
      *scan.mutable_pose() = adjusted.pose();
      scan.clear_adjustment();
      if (adjusted.has_adjustment()) *scan.mutable_adjustment() = adjusted.adjustment();
    };
    adjust(it->second.scan);
    if (!it->second.preview_blob.empty()) adjust(it->second.preview);
  }
  model_version = event.poses_adjusted().model_version();
  poses_due = false;
  return absl::OkStatus();
}

void SessionState::EndWithScan(const v1::Scan& scan) {
  if (scan.file_setup() != 0) {
    // The upload's end is another step; it may be forgotten since.
    const auto file = uploads.find(scan.upload());
    if (file == uploads.end()) return;
    // A preview may come back in place of what replaced it.
    if (!files[scan.upload()].setups.insert(scan.file_setup()).second) return;
    file->second.add_scans(scan.name());
    if (file->second.scan().empty()) file->second.set_scan(scan.name());
    return;
  }
  v1::Upload& upload = uploads[scan.upload()];
  upload.set_name(scan.upload());
  upload.set_state(v1::UPLOAD_STATE_COMMITTED);
  upload.set_scan(scan.name());
  upload.set_next_offset(scan.encoded_size_bytes());
  upload.set_credit_offset(scan.encoded_size_bytes());
}

v1::Session SessionState::Describe() const {
  v1::Session out = session;
  out.set_last_sequence(last_sequence);
  out.set_model_version(model_version);
  out.set_etag(EtagOf(session));
  v1::ScanCounts& counts = *out.mutable_scan_counts();
  for (const auto& [name, record] : scans) {
    switch (record.scan.state()) {
      case v1::SCAN_STATE_MERGED:
        counts.set_merged_count(counts.merged_count() + 1);
        break;
      case v1::SCAN_STATE_DOUBTFUL:
        counts.set_doubtful_count(counts.doubtful_count() + 1);
        break;
      case v1::SCAN_STATE_FAILED:
        counts.set_failed_count(counts.failed_count() + 1);
        break;
      case v1::SCAN_STATE_WITHDRAWN:
        counts.set_withdrawn_count(counts.withdrawn_count() + 1);
        break;
      default:
        counts.set_unmerged_count(counts.unmerged_count() + 1);
    }
  }
  return out;
}

void SessionState::AddRejections(const google::protobuf::Timestamp& now, v1::Session& to) const {
  const std::vector<const v1::Rejection*> refused = RejectionsAt(now);
  const size_t skip = refused.size() - std::min(refused.size(), kMaxListedRejections);
  for (size_t i = skip; i < refused.size(); ++i) *to.add_rejections() = *refused[i];
}

std::vector<const v1::Rejection*> SessionState::RejectionsAt(
    const google::protobuf::Timestamp& now) const {
  std::vector<const v1::Rejection*> refused;
  for (const v1::Rejection& rejection : rejections) {
    const bool expired = rejection.has_expire_time() && Before(rejection.expire_time(), now);
    if (!expired) refused.push_back(&rejection);
  }
  return refused;
}

std::vector<const v1::Claim*> SessionState::HeldClaims() const {
  std::vector<const v1::Claim*> held;
  held.reserve(held_claims.size());
  for (const std::string& name : held_claims) held.push_back(&claims.at(name).claim);
  return held;
}

int SessionState::PendingScans() const {
  return static_cast<int>(std::count_if(scans.begin(), scans.end(), [](const auto& entry) {
    const v1::ScanState state = entry.second.scan.state();
    return state == v1::SCAN_STATE_RECEIVED || state == v1::SCAN_STATE_REGISTERING ||
           state == v1::SCAN_STATE_MERGING;
  }));
}

bool SessionState::AnyInModel() const {
  return std::any_of(scans.begin(), scans.end(),
                     [](const auto& entry) { return entry.second.in_model; });
}

std::vector<std::string> SessionState::UndecidedScans() const {
  std::vector<std::string> undecided;
  for (const std::string& name : scan_order) {
    const ScanRecord& record = scans.at(name);
    const v1::ScanState state = record.scan.state();
    if (state == v1::SCAN_STATE_RECEIVED || state == v1::SCAN_STATE_MERGING ||
        record.in_model != (state == v1::SCAN_STATE_MERGED)) {
      undecided.push_back(name);
    }
  }
  return undecided;
}

}  // namespace vantage::session

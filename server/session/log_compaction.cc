#include "server/session/log_compaction.h"

#include <utility>

#include "server/store/left_out.h"
#include "server/store/store.h"

namespace vantage::session {
namespace {

// Bytes of entries for which one stands, at most, so that they go in short steps.
constexpr int64_t kMostBytes = 1 << 20;

void AddTo(storage::v1::LeftOut& sum, const storage::v1::LeftOut& more) {
  sum.set_created_upload_count(sum.created_upload_count() + more.created_upload_count());
  sum.set_rejection_count(sum.rejection_count() + more.rejection_count());
  sum.set_created_station_count(sum.created_station_count() + more.created_station_count());
  sum.set_created_plan_count(sum.created_plan_count() + more.created_plan_count());
}

}  // namespace

LogCompaction::LogCompaction(const SessionState& state) {
  for (const auto& [name, upload] : state.uploads) uploads_.insert(name);
  for (const v1::Rejection& rejection : state.rejections) rejections_.insert(rejection.name());
}

// The resources are those that SessionState::Apply() names.
void LogCompaction::Read(const storage::v1::LogEntry& entry) {
  const v1::SessionEvent& event = entry.event();
  last_ = event.sequence();
  switch (event.event_case()) {
    case v1::SessionEvent::kUploadCreated: {
      const std::string& name = event.upload_created().upload().name();
      candidates_.push_back(CandidateOf(entry, uploads_.count(name) == 0));
      candidates_.back().counts.set_created_upload_count(1);
      return Remember(entry, name);
    }
    case v1::SessionEvent::kUploadReceived: {
      const std::string& name = event.upload_received().upload().name();
      candidates_.push_back(CandidateOf(entry, uploads_.count(name) == 0));
      return Remember(entry, name);
    }
    case v1::SessionEvent::kUploadEnded: {
      const std::string& name = event.upload_ended().upload().name();
      candidates_.push_back(CandidateOf(entry, uploads_.count(name) == 0));
      return Remember(entry, name);
    }
    case v1::SessionEvent::kViewRejected: {
      const std::string& name = event.view_rejected().rejection().name();
      candidates_.push_back(CandidateOf(entry, rejections_.count(name) == 0));
      candidates_.back().counts.set_rejection_count(1);
      return Remember(entry, name);
    }
    case v1::SessionEvent::kRejectionDeleted: {
      const std::string& name = event.rejection_deleted().rejection().name();
      candidates_.push_back(CandidateOf(entry, true));
      return Remember(entry, name);
    }
    case v1::SessionEvent::kStationCreated: {
      const std::string& name = event.station_created().station().name();
      stations_[name] = candidates_.size();
      candidates_.push_back(CandidateOf(entry, false));
      candidates_.back().counts.set_created_station_count(1);
      return Remember(entry, name);
    }
    case v1::SessionEvent::kStationEnded: {
      const std::string& name = event.station_ended().station().name();
      const auto created = stations_.find(name);
      const bool deleted = created != stations_.end() && event.station_ended().scan().empty();
      if (deleted) candidates_[created->second].goes_with = event.sequence();
      if (created != stations_.end()) stations_.erase(created);
      candidates_.push_back(CandidateOf(entry, deleted));
      return Remember(entry, name);
    }
    case v1::SessionEvent::kPlanCreated:
    case v1::SessionEvent::kPlanEnded: {
      const bool created = event.has_plan_created();
      const std::string& name =
          created ? event.plan_created().plan().name() : event.plan_ended().plan().name();
      plans_[name].push_back(candidates_.size());
      candidates_.push_back(CandidateOf(entry, false));
      if (created) candidates_.back().counts.set_created_plan_count(1);
      return Remember(entry, name);
    }
    case v1::SessionEvent::kPlanDeleted: {
      const std::string& name = event.plan_deleted().plan();
      for (const size_t earlier : plans_[name]) candidates_[earlier].goes_with = event.sequence();
      plans_.erase(name);
      candidates_.push_back(CandidateOf(entry, true));
      return Remember(entry, name);
    }
    case v1::SessionEvent::kScannerUpdated: {
      const std::string& name = event.scanner_updated().scanner().name();
      EndConfigured(name);
      scanners_[name] = candidates_.size();
      candidates_.push_back(CandidateOf(entry, false));
      return Remember(entry, name);
    }
    case v1::SessionEvent::kScannerDeleted:
      EndConfigured(event.scanner_deleted().scanner().name());
      return Remember(entry, "");
    case v1::SessionEvent::kClaimRenewed: {
      const std::string& name = event.claim_renewed().claim().name();
      EndProlonged(name);
      prolonged_[name] = candidates_.size();
      candidates_.push_back(CandidateOf(entry, false));
      return Remember(entry, name);
    }
    case v1::SessionEvent::kClaimEnded:
      EndProlonged(event.claim_ended().claim().name());
      return Remember(entry, "");
    case v1::SessionEvent::kScanMerged:
      prolonged_.clear();
      Place(event.scan_merged().scan().name());
      return Remember(entry, "");
    case v1::SessionEvent::kScanRemoved:
      Place(event.scan_removed().scan().name());
      return Remember(entry, "");
    case v1::SessionEvent::kPosesAdjusted:
      return ReadAdjustment(entry);
    case v1::SessionEvent::kSessionUpdated:
      if (configured_ < candidates_.size()) Replace(candidates_[configured_]);
      configured_ = candidates_.size();
      candidates_.push_back(CandidateOf(entry, false));
      return Remember(entry, event.session_updated().session().name());
    case v1::SessionEvent::kSitePriorSet: {
      if (site_prior_ < candidates_.size()) Replace(candidates_[site_prior_]);
      site_prior_ = candidates_.size();
      candidates_.push_back(CandidateOf(entry, false));
      return Remember(entry, event.site_prior_set().site_prior().name());
    }
    case v1::SessionEvent::kSitePriorCleared: {
      if (site_prior_ < candidates_.size()) {
        candidates_[site_prior_].goes_with = event.sequence();
      }
      site_prior_ = SIZE_MAX;
      candidates_.push_back(CandidateOf(entry, true));
      return Remember(entry, event.site_prior_cleared().site_prior().name());
    }
    case v1::SessionEvent::kEventsLeftOut:
      candidates_.push_back(CandidateOf(entry, true));
      return Remember(entry, entry.left_out().resource());
    default:
      return Remember(entry, "");
  }
}

LogCompaction::Candidate LogCompaction::CandidateOf(const storage::v1::LogEntry& entry, bool goes) {
  Candidate candidate;
  candidate.first = store::FirstSequence(entry.event());
  candidate.sequence = entry.event().sequence();
  candidate.time = entry.event().time();
  candidate.seen = entry.seen();
  candidate.counts = entry.left_out();
  candidate.counts.clear_resource();
  candidate.bytes = static_cast<int64_t>(entry.ByteSizeLong());
  candidate.stands_for_others = entry.event().has_events_left_out();
  candidate.has_request = entry.has_request();
  if (goes) candidate.goes_with = candidate.sequence;
  return candidate;
}

// Counts every request, as the state does, and keeps what an entry that goes must still tell.
void LogCompaction::Remember(const storage::v1::LogEntry& entry, const std::string& resource) {
  if (!entry.has_request() || entry.event().has_session_created()) return;
  request_order_.push_back(entry.event().sequence());
  requests_[entry.event().sequence()] = {entry.request(), resource};
  if (request_order_.size() <= SessionState::kRequests) return;
  requests_.erase(request_order_.front());
  request_order_.pop_front();
}

void LogCompaction::Place(const std::string& scan) {
  const auto placed = placed_by_.find(scan);
  if (placed == placed_by_.end()) return;
  --adjustments_[placed->second].scans;
  placed_by_.erase(placed);
}

// Whoever folds the log without an entry that went finds all that it said, and that poses are not
// due, in the one with which it goes.
void LogCompaction::ReadAdjustment(const storage::v1::LogEntry& entry) {
  const v1::PosesAdjustedEvent& adjusted = entry.event().poses_adjusted();
  for (const v1::AdjustedPose& pose : adjusted.poses()) Place(pose.scan());
  for (const PlacedScans& before : adjustments_) {
    Candidate& candidate = candidates_[before.candidate];
    if (before.scans == 0 && candidate.goes_with == kStays) {
      candidate.goes_with = entry.event().sequence();
    }
  }
  for (const v1::AdjustedPose& pose : adjusted.poses())
    placed_by_[pose.scan()] = adjustments_.size();
  adjustments_.push_back({candidates_.size(), static_cast<size_t>(adjusted.poses_size())});
  candidates_.push_back(CandidateOf(entry, false));
  Remember(entry, "");
}

// It is told by a later one.
void LogCompaction::Replace(Candidate& candidate) { candidate.goes_with = candidate.sequence; }

void LogCompaction::EndProlonged(const std::string& claim) {
  const auto before = prolonged_.find(claim);
  if (before == prolonged_.end()) return;
  Replace(candidates_[before->second]);
  prolonged_.erase(before);
}

void LogCompaction::EndConfigured(const std::string& scanner) {
  const auto before = scanners_.find(scanner);
  if (before == scanners_.end()) return;
  Replace(candidates_[before->second]);
  scanners_.erase(before);
}

std::vector<LogCompaction::Replacement> LogCompaction::Replacements() const {
  std::vector<Replacement> replacements;
  // The run of entries that are being joined: its end in `replacements`, and how many they are.
  size_t joined = 0;
  bool closed = true;      // nothing joins the last replacement
  bool unchanged = false;  // it would be what is there already
  const auto end_run = [&] {
    if (joined == 1 && unchanged) replacements.pop_back();
    joined = 0;
    closed = true;
  };
  for (const Candidate& candidate : candidates_) {
    const bool goes = candidate.goes_with <= last_ && last_ - candidate.goes_with >= kNewest;
    if (!goes) continue;
    const auto request = requests_.find(candidate.sequence);
    const bool remembered = request != requests_.end();
    const bool follows = !closed && replacements.back().saved_bytes < kMostBytes &&
                         replacements.back().entry.event().sequence() + 1 == candidate.first;
    if (!follows || remembered) {
      end_run();
      replacements.emplace_back();
      storage::v1::LogEntry& entry = replacements.back().entry;
      entry.set_format_version(store::kLogFormatVersion);
      entry.mutable_event()->mutable_events_left_out()->set_first_sequence(candidate.first);
      if (remembered) {
        *entry.mutable_request() = request->second.request;
        entry.mutable_left_out()->set_resource(request->second.resource);
      }
      unchanged = candidate.stands_for_others && candidate.has_request == remembered;
    }
    Replacement& last = replacements.back();
    last.entry.mutable_event()->set_sequence(candidate.sequence);
    *last.entry.mutable_event()->mutable_time() = candidate.time;
    *last.entry.mutable_seen() = candidate.seen;
    AddTo(*last.entry.mutable_left_out(), candidate.counts);
    last.saved_bytes += candidate.bytes;
    ++joined;
    closed = false;
    if (remembered) {
      end_run();
    }
  }
  end_run();
  for (Replacement& replacement : replacements) {
    replacement.saved_bytes -= static_cast<int64_t>(replacement.entry.ByteSizeLong());
  }
  return replacements;
}

}  // namespace vantage::session

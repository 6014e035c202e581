#include "server/session/scans.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/contract/error.h"
#include "server/conversion/to_proto.h"
#include "server/session/chained_poses.h"
#include "server/session/doubt_proposals.h"
#include "server/session/list_filter.h"
#include "server/session/stored_scans.h"

namespace vantage::session {
namespace {

constexpr char kScanType[] = "vantage/Scan";

absl::Status WrongState(const v1::Scan& scan, absl::string_view needed) {
  return contract::ErrorWithReason(
      absl::StatusCode::kFailedPrecondition, "SCAN_STATE",
      absl::StrCat(scan.name(), " is ", v1::ScanState_Name(scan.state()), "; ", needed),
      {{"state", v1::ScanState_Name(scan.state())}});
}

// Scans in the model that were aligned when `scan` was in it.
std::vector<std::string> Dependents(const SessionState& state, const ScanRecord& scan) {
  std::vector<std::string> names;
  if (!scan.in_model) return names;
  for (const std::string& name : state.scan_order) {
    const ScanRecord& other = state.scans.at(name);
    const bool aligned = other.scan.pose_source() == v1::POSE_SOURCE_REGISTRATION ||
                         other.scan.pose_source() == v1::POSE_SOURCE_ACCEPTED;
    if (other.in_model && name != scan.scan.name() && aligned &&
        other.scan.registration().model_version() >= scan.entered) {
      names.push_back(name);
    }
  }
  return names;
}

// What it was registered beside may have been moved since.
void CarryAlong(const SessionState& state, const Eigen::Vector3d& origin, v1::Scan& scan) {
  if (!scan.has_pose_reference()) return;
  v1::PoseReference& reference = *scan.mutable_pose_reference();
  const auto beside = state.scans.find(reference.scan());
  if (beside == state.scans.end() || !beside->second.in_model) return;
  const v1::Pose& now = beside->second.scan.pose();
  *scan.mutable_pose() = CarriedAlong(scan.pose(), reference, now, origin);
  *reference.mutable_pose() = now;
}

}  // namespace

Scans::Scans(SessionContext& context, ScanReconciler& reconciler)
    : context_(context), journal_(context.journal()), reconciler_(reconciler) {}

absl::StatusOr<v1::Scan> Scans::Get(const std::string& name) const {
  absl::StatusOr<v1::Scan> found = contract::ResourceNotFound(kScanType, name);
  journal_.Read([&](const SessionState& state) {
    const auto it = state.scans.find(name);
    if (it != state.scans.end()) found = it->second.scan;
  });
  if (found.ok()) Complete(*found);
  return found;
}

absl::StatusOr<std::vector<v1::Scan>> Scans::List(absl::string_view after, size_t limit, bool& more,
                                                  const v1::ListScansRequest& filter) const {
  std::vector<v1::Scan> scans;
  absl::StatusOr<size_t> begin = 0;
  journal_.Read([&](const SessionState& state) {
    begin = PlaceAfter(state.scan_order, after);
    if (!begin.ok()) return;
    more = false;
    for (size_t i = *begin; i < state.scan_order.size() && !more; ++i) {
      const v1::Scan& scan = state.scans.at(state.scan_order[i]).scan;
      if (!LetsThrough(filter.states(), scan.state())) continue;
      if (!filter.scanner().empty() && scan.scanner() != filter.scanner()) continue;
      more = scans.size() == limit;
      if (!more) scans.push_back(scan);
    }
  });
  if (!begin.ok()) return begin.status();
  for (v1::Scan& scan : scans) Complete(scan);
  return scans;
}

void Scans::Complete(v1::Scan& scan) const {
  scan.set_etag(EtagOfDoubt(scan));  // logs of earlier releases have none
  reconciler_.AddProgress(scan);
  context_.lost_scans().Describe(scan);
}

absl::StatusOr<v1::Scan> Scans::Accept(const std::string& name, const ChosenPose& chosen,
                                       const RequestKey& key) {
  absl::StatusOr<std::string> accepted =
      journal_.Execute(key, [&](const SessionState& state) -> absl::StatusOr<Draft> {
        const auto it = state.scans.find(name);
        if (it == state.scans.end()) return contract::ResourceNotFound(kScanType, name);
        const v1::Scan& scan = it->second.scan;
        const bool waits =
            scan.state() == v1::SCAN_STATE_DOUBTFUL || scan.state() == v1::SCAN_STATE_FAILED;
        if (!waits || !scan.has_registration()) {
          return WrongState(scan,
                            "only a doubtful or failed scan with an alignment can be "
                            "accepted; give it a pose with SetScanPose");
        }
        if (!chosen.etag.empty() && chosen.etag != EtagOfDoubt(scan)) {
          return contract::ErrorWithReason(
              absl::StatusCode::kAborted, "ETAG_STALE",
              absl::StrCat("etag: the poses of ", name,
                           " are others by now than those that were looked at; read it again "
                           "(GetScan) and choose among these"),
              {{"field", "etag"}, {"etag", EtagOfDoubt(scan)}});
        }
        const v1::Registration& registration = scan.registration();
        if (chosen.proposed && !scan.has_pose_proposal()) {
          return contract::InvalidField("proposed",
                                        absl::StrCat("nothing is proposed of ", name,
                                                     "; choose one of its poses (rival_pose)"));
        }
        if (chosen.rival_pose > registration.rival_poses_size()) {
          return contract::InvalidField(
              "rival_pose", absl::StrCat("is ", chosen.rival_pose, "; the registration of ", name,
                                         " names ", registration.rival_poses_size(), " of them"));
        }
        Draft draft;
        v1::Scan& next = *draft.event.mutable_scan_accepted()->mutable_scan();
        next = scan;
        next.set_state(v1::SCAN_STATE_MERGING);
        next.clear_state_message();
        next.clear_pose_proposal();
        next.clear_etag();
        if (chosen.proposed) {
          *next.mutable_registration() = scan.pose_proposal().registration();
          *next.mutable_pose_reference() = scan.pose_proposal().pose_reference();
          *next.mutable_pose() = next.registration().pose();
        } else if (chosen.rival_pose == 0) {
          *next.mutable_pose() = registration.pose();
        } else {
          *next.mutable_pose() = registration.rival_poses(chosen.rival_pose - 1).pose();
          next.clear_pose_reference();  // it was beside others there
        }
        CarryAlong(state, context_.origin(), next);
        next.set_pose_source(v1::POSE_SOURCE_ACCEPTED);
        *next.mutable_update_time() = conversion::WriteTime(journal_.Now());
        return draft;
      });
  if (!accepted.ok()) return accepted.status();
  reconciler_.Post(*accepted);
  return Get(*accepted);
}

absl::StatusOr<v1::Scan> Scans::SetPose(const std::string& name, const v1::PosePrior& prior,
                                        bool as_is, const RequestKey& key) {
  absl::StatusOr<std::string> placed =
      journal_.Execute(key, [&](const SessionState& state) -> absl::StatusOr<Draft> {
        const auto it = state.scans.find(name);
        if (it == state.scans.end()) return contract::ResourceNotFound(kScanType, name);
        const v1::Scan& scan = it->second.scan;
        if (scan.state() == v1::SCAN_STATE_WITHDRAWN) {
          return WrongState(scan, "send it again instead");
        }
        // Without its data it would leave the model and not come back.
        if (context_.lost_scans().Has(name)) {
          return contract::ErrorWithReason(
              absl::StatusCode::kDataLoss, "SCAN_LOST",
              absl::StrCat(name,
                           ": its data are lost, so that it can only stay where it is; have "
                           "its operator restore a backup, or withdraw it and send it again"));
        }
        Draft draft;
        v1::Scan& next = *draft.event.mutable_scan_pose_set()->mutable_scan();
        next = scan;
        *next.mutable_prior() = prior;
        next.clear_state_message();
        next.clear_adjustment();
        next.clear_pose_reference();
        next.clear_pose_proposal();
        next.clear_etag();
        if (as_is) {
          next.set_state(v1::SCAN_STATE_MERGING);
          *next.mutable_pose() = prior.pose();
          next.set_pose_source(v1::POSE_SOURCE_SET);
        } else {
          next.set_state(v1::SCAN_STATE_RECEIVED);
          next.clear_pose();
          next.clear_pose_source();
          next.clear_registration();
          next.clear_levelling();
        }
        *next.mutable_update_time() = conversion::WriteTime(journal_.Now());
        return draft;
      });
  if (!placed.ok()) return placed.status();
  reconciler_.Post(*placed);
  return Get(*placed);
}

absl::StatusOr<Scans::Withdrawn> Scans::Withdraw(const std::string& name, const RequestKey& key) {
  absl::StatusOr<std::string> gone =
      journal_.Execute(key, [&](const SessionState& state) -> absl::StatusOr<Draft> {
        const auto it = state.scans.find(name);
        if (it == state.scans.end()) return contract::ResourceNotFound(kScanType, name);
        const v1::Scan& scan = it->second.scan;
        if (scan.state() == v1::SCAN_STATE_WITHDRAWN) {
          return WrongState(scan, "it has been withdrawn already");
        }
        Draft draft;
        v1::ScanWithdrawnEvent& event = *draft.event.mutable_scan_withdrawn();
        *event.mutable_scan() = scan;
        event.mutable_scan()->set_state(v1::SCAN_STATE_WITHDRAWN);
        event.mutable_scan()->clear_state_message();
        event.mutable_scan()->clear_pose_proposal();
        event.mutable_scan()->clear_etag();
        *event.mutable_scan()->mutable_update_time() = conversion::WriteTime(journal_.Now());
        for (const std::string& dependent : Dependents(state, it->second)) {
          event.add_dependent_scans(dependent);
        }
        return draft;
      });
  if (!gone.ok()) return gone.status();
  reconciler_.Post(*gone);
  absl::StatusOr<v1::Scan> scan = Get(*gone);
  if (!scan.ok()) return scan.status();
  Withdrawn withdrawn{*std::move(scan), {}};
  // From the log, so that a repeated request gets the same answer.
  uint64_t after = 0;
  constexpr size_t kBatch = 256;
  while (true) {
    absl::StatusOr<std::vector<v1::SessionEvent>> events = journal_.Events(after, kBatch);
    if (!events.ok()) return events.status();
    if (events->empty()) return withdrawn;
    for (const v1::SessionEvent& event : *events) {
      if (event.scan_withdrawn().scan().name() != *gone) continue;
      const auto& dependents = event.scan_withdrawn().dependent_scans();
      withdrawn.dependents.assign(dependents.begin(), dependents.end());
    }
    after = events->back().sequence();
  }
}

absl::StatusOr<sensor::RangeImage> Scans::LoadImage(const std::string& name) const {
  return session::LoadImage(context_, name, "", sensor::RangeImageDecoder::Keep::kAll);
}

int Scans::Pending() const {
  int pending = 0;
  journal_.Read([&](const SessionState& state) { pending = state.PendingScans(); });
  return pending;
}

absl::StatusOr<int> Scans::EraseWithdrawn(absl::Duration before,
                                          absl::FunctionRef<bool(const std::string& scan)> sure,
                                          absl::FunctionRef<bool(uint64_t sequence)> release) {
  std::vector<std::pair<std::string, uint64_t>> past;  // and when they left the model
  uint64_t erased_until = 0;
  const auto is_past = [before](const ScanRecord& record) {
    return record.scan.state() == v1::SCAN_STATE_WITHDRAWN && !record.in_model &&
           !record.blob.empty() && record.withdrawn < before;
  };
  journal_.Read([&](const SessionState& state) {
    for (const std::string& name : state.scan_order) {
      const ScanRecord& record = state.scans.at(name);
      if (is_past(record)) past.emplace_back(name, record.removed);
      const bool is_erased = record.scan.state() == v1::SCAN_STATE_WITHDRAWN && record.blob.empty();
      if (is_erased) erased_until = std::max(erased_until, record.removed);
    }
  });
  // An earlier release left snapshots of what it erased.
  if (erased_until > 0) release(erased_until);
  int count = 0;
  for (const auto& [past_name, removed] : past) {
    const std::string& name = past_name;
    if (!sure(name)) continue;
    // First the snapshots: what the log calls erased is nowhere any more, also after a crash here.
    if (removed > 0 && !release(removed)) {
      context_.dependencies().log.Info(
          "a withdrawn scan is erased once there is a snapshot of the model without it",
          {{"scan", name}});
      continue;
    }
    std::string blob;
    int64_t bytes = 0;
    const absl::StatusOr<std::string> logged =
        journal_.Execute({}, [&](const SessionState& state) -> absl::StatusOr<Draft> {
          const ScanRecord& record = state.scans.at(name);
          if (!is_past(record)) return absl::CancelledError("done meanwhile");
          blob = record.blob;
          bytes = record.scan.encoded_size_bytes();
          Draft draft;
          v1::Scan& erased = *draft.event.mutable_scan_withdrawn()->mutable_scan();
          erased = record.scan;
          erased.set_encoded_size_bytes(0);
          erased.set_state_message("withdrawn, and its data erased");
          *erased.mutable_update_time() = conversion::WriteTime(journal_.Now());
          return draft;
        });
    if (absl::IsCancelled(logged.status()) || absl::IsAborted(logged.status())) continue;
    if (!logged.ok()) return logged.status();
    context_.account()->GiveBack(bytes);
    // What cannot be removed now is removed at the next start.
    context_.dependencies().store.ReleaseBlob(blob).IgnoreError();
    ++count;
  }
  return count;
}

}  // namespace vantage::session

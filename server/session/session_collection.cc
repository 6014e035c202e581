// What is past its time goes: sessions, the data of withdrawn scans, uploads that nobody goes on
// with.
#include <memory>
#include <vector>

#include "server/conversion/to_proto.h"
#include "server/session/session.h"
#include "server/session/session_registry.h"

namespace vantage::session {

Collected SessionRegistry::Collect() {
  std::vector<std::shared_ptr<Session>> sessions;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& [id, session] : sessions_) sessions.push_back(session);
  }
  Collected collected;
  const absl::Time now = dependencies_.clock();
  const absl::Time unused_since = now - dependencies_.limits.keep_sessions;
  for (const std::shared_ptr<Session>& session : sessions) {
    if (draining()) break;
    session->ExpireUploads();
    session->ExpireClaims();
    if (session->LastTouched() < now - dependencies_.limits.evict_after) session->PostEvict();
    if (session->LastUsed() < unused_since) {
      std::lock_guard<std::mutex> only_one(create_mutex_);
      const absl::StatusOr<std::shared_ptr<Session>> still = Find(session->id());
      if (!still.ok() || *still != session || session->LastUsed() >= unused_since) continue;
      const absl::Status erased = Erase(session);
      if (erased.ok()) {
        ++collected.sessions;
        dependencies_.log.Info("a session past its time was deleted", {{"session", session->id()}});
      } else {
        dependencies_.log.Error("a session past its time could not be deleted",
                                {{"session", session->id()}, {"error", erased.ToString()}});
      }
      continue;
    }
    const absl::StatusOr<int> erased =
        session->EraseWithdrawnScans(now - dependencies_.limits.keep_withdrawn_scans);
    if (erased.ok()) {
      collected.scans += *erased;
    } else {
      dependencies_.log.Error("withdrawn scans could not be erased",
                              {{"session", session->id()}, {"error", erased.status().ToString()}});
    }
  }
  return collected;
}

absl::StatusOr<int> Session::EraseWithdrawnScans(absl::Time before) {
  std::vector<std::string> past;
  const auto is_past = [before](const ScanRecord& record) {
    return record.scan.state() == v1::SCAN_STATE_WITHDRAWN && !record.in_model &&
           !record.blob.empty() && conversion::ReadTime(record.scan.update_time()) < before;
  };
  journal_.Read([&](const SessionState& state) {
    for (const std::string& name : state.scan_order) {
      if (is_past(state.scans.at(name))) past.push_back(name);
    }
  });
  int count = 0;
  for (const std::string& name : past) {
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
    account_->GiveBack(bytes);
    // What cannot be removed now is collected at the next start.
    dependencies_.store.ReleaseBlob(blob).IgnoreError();
    ++count;
  }
  return count;
}

}  // namespace vantage::session

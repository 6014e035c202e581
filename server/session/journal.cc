#include "server/session/journal.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/bytes/checksum.h"
#include "core/model/snapshot/snapshot_header.h"
#include "core/model/view/algorithm_version.h"
#include "server/contract/error.h"
#include "server/conversion/to_proto.h"
#include "server/session/log_compaction.h"

namespace vantage::session {
namespace {

constexpr size_t kLoadBatch = 256;
// Bytes that go at a time. Others write in between.
constexpr int64_t kCompactedAtOnce = 4 << 20;

// Null: it is not remembered, or has no id.
const RequestRecord* FindRequest(const SessionState& state, const RequestKey& key) {
  if (key.id.empty()) return nullptr;
  const auto known = state.requests.find(key.id);
  return known == state.requests.end() ? nullptr : &known->second;
}

absl::Status CheckSame(const RequestRecord& known, const RequestKey& key) {
  if (known.method == key.method && known.fingerprint == key.fingerprint) return absl::OkStatus();
  return contract::ErrorWithReason(absl::StatusCode::kAlreadyExists, "REQUEST_ID_REUSED",
                                   absl::StrCat("request_id was used for another ", known.method,
                                                "; use a new one for every intent"));
}

}  // namespace

RequestKey RequestKey::Of(const std::string& id, const std::string& method,
                          const google::protobuf::Message& request) {
  if (id.empty()) return {};
  return {id, method, bytes::Sha256::Of(request.SerializeAsString())};
}

Journal::Journal(std::string session, store::Store& store, Clock clock, SeenClock seen)
    : session_(std::move(session)),
      store_(store),
      clock_(std::move(clock)),
      seen_(std::move(seen)) {}

absl::StatusOr<std::unique_ptr<Journal>> Journal::Open(std::string session, store::Store& store,
                                                       Clock clock, SeenClock seen) {
  auto journal =
      std::make_unique<Journal>(std::move(session), store, std::move(clock), std::move(seen));
  if (absl::Status loaded = journal->Load(); !loaded.ok()) return loaded;
  return journal;
}

absl::Status Journal::Load() {
  std::lock_guard<std::mutex> write(write_mutex_);
  std::lock_guard<std::mutex> lock(state_mutex_);
  while (true) {
    absl::StatusOr<std::vector<storage::v1::LogEntry>> batch =
        store_.Read(session_, state_.last_sequence, kLoadBatch);
    if (!batch.ok()) return batch.status();
    if (batch->empty()) break;
    for (const storage::v1::LogEntry& entry : *batch) {
      absl::Status applied = state_.Apply(entry);
      if (!applied.ok()) return applied;
      bytes_ += static_cast<int64_t>(entry.ByteSizeLong());
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<std::string> Journal::Execute(
    const RequestKey& key, absl::FunctionRef<absl::StatusOr<Draft>(const SessionState&)> build,
    absl::FunctionRef<void()> applied) {
  std::string resource;
  {
    std::lock_guard<std::mutex> write(write_mutex_);
    if (closed_) return absl::AbortedError(absl::StrCat("session ", session_, " was deleted"));
    absl::StatusOr<Draft> draft = Draft{};
    uint64_t sequence = 0;
    {
      std::lock_guard<std::mutex> lock(state_mutex_);
      if (const RequestRecord* known = FindRequest(state_, key); known != nullptr) {
        if (absl::Status same = CheckSame(*known, key); !same.ok()) return same;
        return known->resource;
      }
      draft = build(state_);
      if (!draft.ok()) return draft.status();
      sequence = state_.last_sequence + 1;
    }
    storage::v1::LogEntry entry;
    entry.set_format_version(store::kLogFormatVersion);
    entry.set_algorithm_version(model::kModelAlgorithmVersion);
    *entry.mutable_event() = std::move(draft->event);
    entry.mutable_event()->set_sequence(sequence);
    *entry.mutable_event()->mutable_time() = conversion::WriteTime(clock_());
    *entry.mutable_seen() = conversion::WriteDuration(absl::ToDoubleSeconds(seen_()));
    entry.set_blob(std::move(draft->blob));
    entry.set_tenant(std::move(draft->tenant));
    entry.set_caller(std::move(draft->caller));
    if (!draft->last_pieces.digests().empty()) {
      *entry.mutable_last_pieces() = std::move(draft->last_pieces);
    }
    if (!key.id.empty()) {
      entry.mutable_request()->set_id(key.id);
      entry.mutable_request()->set_method(key.method);
      entry.mutable_request()->set_fingerprint(key.fingerprint);
    }
    // Readers do not wait while the store writes; only other writers do.
    absl::Status written = store_.Append(session_, entry);
    if (!written.ok()) return written;
    const auto size = static_cast<int64_t>(entry.ByteSizeLong());
    bytes_ += size;
    if (on_written_) on_written_(size);
    std::lock_guard<std::mutex> lock(state_mutex_);
    absl::Status fits = state_.Apply(entry);
    if (!fits.ok()) return fits;
    applied();
    resource = state_.last_resource;
  }
  Wake();
  return resource;
}

bool Journal::Knows(const RequestKey& key) const {
  std::lock_guard<std::mutex> lock(state_mutex_);
  return FindRequest(state_, key) != nullptr;
}

absl::Status Journal::CheckRequest(const RequestKey& key) const {
  std::lock_guard<std::mutex> lock(state_mutex_);
  const RequestRecord* known = FindRequest(state_, key);
  return known == nullptr ? absl::OkStatus() : CheckSame(*known, key);
}

bool Journal::DueForCompaction() {
  return bytes_ > compact_beyond_ && !compaction_due_.exchange(true);
}

absl::StatusOr<int64_t> Journal::Compact() {
  std::lock_guard<std::mutex> one(compact_mutex_);
  const int64_t before = bytes_;
  absl::StatusOr<int64_t> saved = CompactOnce();
  // What came meanwhile is growth: it may be due again at once.
  const int64_t left = saved.ok() ? before - *saved : bytes_.load();
  compact_beyond_ = left + std::clamp<int64_t>(left / 2, kLeastGrowth, kMostGrowth);
  compaction_due_ = false;
  return saved;
}

absl::StatusOr<int64_t> Journal::CompactOnce() {
  std::optional<LogCompaction> compaction;
  uint64_t last = 0;
  Read([&](const SessionState& state) {
    compaction.emplace(state);
    last = state.last_sequence;
  });
  for (uint64_t after = 0; after < last;) {
    const absl::StatusOr<std::vector<storage::v1::LogEntry>> batch =
        store_.Read(session_, after, kLoadBatch);
    if (!batch.ok()) return batch.status();
    if (batch->empty()) break;  // another session has the id
    for (const storage::v1::LogEntry& entry : *batch) {
      after = entry.event().sequence();
      if (after <= last) compaction->Read(entry);
    }
  }
  const std::vector<LogCompaction::Replacement> replacements = compaction->Replacements();
  int64_t saved = 0;
  for (auto next = replacements.begin(); next != replacements.end();) {
    std::vector<storage::v1::LogEntry> together;
    int64_t bytes = 0;
    for (; next != replacements.end() && bytes < kCompactedAtOnce; ++next) {
      together.push_back(next->entry);
      bytes += next->saved_bytes;
    }
    std::lock_guard<std::mutex> write(write_mutex_);
    if (closed_) return absl::AbortedError(absl::StrCat("session ", session_, " was deleted"));
    if (absl::Status left = store_.Compact(session_, together); !left.ok()) return left;
    bytes_ -= bytes;
    saved += bytes;
    if (on_written_) on_written_(-bytes);
  }
  return saved;
}

absl::Status Journal::CheckRoom(int64_t most) const {
  if (bytes_ < most) return absl::OkStatus();
  return contract::ErrorWithReason(absl::StatusCode::kResourceExhausted, "LOG_FULL",
                                   absl::StrCat("the session's log has ", bytes_ >> 20,
                                                " MiB, the most it may; go on in another session"));
}

void Journal::OnWritten(std::function<void(int64_t)> call) {
  std::lock_guard<std::mutex> write(write_mutex_);
  on_written_ = std::move(call);
  on_written_(bytes_);
}

void Journal::Close() {
  std::lock_guard<std::mutex> write(write_mutex_);
  closed_ = true;
}

void Journal::Wake() {
  std::vector<std::shared_ptr<std::function<void()>>> watchers;
  {
    std::lock_guard<std::mutex> lock(watch_mutex_);
    watchers.reserve(watchers_.size());
    for (const auto& [id, call] : watchers_) watchers.push_back(call);
  }
  for (const auto& call : watchers) (*call)();
}

void Journal::Read(absl::FunctionRef<void(const SessionState&)> read) const {
  std::lock_guard<std::mutex> lock(state_mutex_);
  read(state_);
}

absl::StatusOr<std::vector<v1::SessionEvent>> Journal::Events(uint64_t after, size_t limit) const {
  absl::StatusOr<std::vector<storage::v1::LogEntry>> entries = store_.Read(session_, after, limit);
  // Looked at after reading: a log that another session has under this id was begun after this one
  // was closed.
  if (closed_) return absl::NotFoundError(absl::StrCat("session ", session_, " was deleted"));
  if (!entries.ok()) return entries.status();
  std::vector<v1::SessionEvent> events;
  events.reserve(entries->size());
  for (storage::v1::LogEntry& entry : *entries) {
    v1::SessionEvent& event = *entry.mutable_event();
    if (event.has_events_left_out() && !events.empty() && events.back().has_events_left_out()) {
      // Only the log needs to keep them apart.
      event.mutable_events_left_out()->set_first_sequence(
          events.back().events_left_out().first_sequence());
      events.back() = std::move(event);
    } else {
      events.push_back(std::move(event));
    }
  }
  return events;
}

Journal::WatchId Journal::Watch(std::function<void()> call) {
  std::lock_guard<std::mutex> lock(watch_mutex_);
  const WatchId id = next_watch_++;
  watchers_[id] = std::make_shared<std::function<void()>>(std::move(call));
  return id;
}

void Journal::Unwatch(WatchId id) {
  std::lock_guard<std::mutex> lock(watch_mutex_);
  watchers_.erase(id);
}

}  // namespace vantage::session

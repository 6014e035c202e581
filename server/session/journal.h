// The log of one session and its state. Commands are checked against the state, written and
// applied, one at a time; readers and watchers see every step in order.
#ifndef VANTAGE_SERVER_SESSION_JOURNAL_H_
#define VANTAGE_SERVER_SESSION_JOURNAL_H_

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "google/protobuf/message.h"
#include "server/session/session_state.h"
#include "server/store/store.h"

namespace vantage::session {

// Identifies a request, so that it is executed only once however often it is sent. An empty id: the
// request has none.
struct RequestKey {
  std::string id;
  std::string method;
  std::string fingerprint;

  static RequestKey Of(const std::string& id, const std::string& method,
                       const google::protobuf::Message& request);
};

// A step that a command proposes.
struct Draft {
  v1::SessionEvent event;               // without sequence and time
  std::string blob;                     // SHA-256 of the blob that belongs to it; empty: none
  std::string tenant;                   // in a session's first step
  std::string caller;                   // who takes a claim
  storage::v1::LastPieces last_pieces;  // of a scan that is received
};

// A moment, by two clocks.
struct Moment {
  absl::Time time;      // by the wall clock, which people read
  absl::Duration seen;  // that servers of these data have seen pass until then: ages go by it
};

// Thread safe.
class Journal {
 public:
  using Clock = std::function<absl::Time()>;
  using SeenClock = std::function<absl::Duration()>;
  using WatchId = uint64_t;

  // Of a session that the store does not have yet; `store` must outlive it.
  Journal(std::string session, store::Store& store, Clock clock, SeenClock seen);
  // Of one that it has: reads the log. NOT_FOUND: it has none. INTERNAL: entries do not fit
  // together. Otherwise errors as of Store::Read().
  static absl::StatusOr<std::unique_ptr<Journal>> Open(std::string session, store::Store& store,
                                                       Clock clock, SeenClock seen);

  // Makes one step. `build` gets the present state and returns the draft, or an error, which is
  // returned unchanged and changes nothing. Returns the name of the resource concerned. When the
  // request was executed before, its resource is returned and nothing happens; ALREADY_EXISTS
  // (REQUEST_ID_REUSED) when it was another request. `applied` runs when the step is written and
  // before anyone can see it.
  absl::StatusOr<std::string> Execute(
      const RequestKey& key, absl::FunctionRef<absl::StatusOr<Draft>(const SessionState&)> build,
      absl::FunctionRef<void()> applied = [] {});

  // Whether a request is remembered under this key's id; what was executed under it is another one
  // where CheckRequest() fails.
  bool Knows(const RequestKey& key) const;
  // ALREADY_EXISTS (REQUEST_ID_REUSED): its id was used for another request.
  absl::Status CheckRequest(const RequestKey& key) const;

  // Calls `read` with the state; it must be quick.
  void Read(absl::FunctionRef<void(const SessionState&)> read) const;

  // Events after a sequence number, in order, at most `limit`. NOT_FOUND once it is closed: another
  // session may have the id, and its log is not this one's.
  absl::StatusOr<std::vector<v1::SessionEvent>> Events(uint64_t after, size_t limit) const;

  // `call` runs after every step, on the thread that made the step; it must be quick. It may still
  // be running when Unwatch returns.
  WatchId Watch(std::function<void()> call);
  void Unwatch(WatchId id);
  // The bytes of its entries.
  int64_t bytes() const { return bytes_; }
  // RESOURCE_EXHAUSTED (LOG_FULL): they come to `most` or more.
  absl::Status CheckRoom(int64_t most) const;
  // True where the log has grown by a half, at least by 1 MiB, since it was compacted or read; then
  // once until Compact() has ended, which follows.
  bool DueForCompaction();
  // Leaves out what nothing depends on any more (log_compaction.h), while others write; returns how
  // many bytes that saves. Errors as of Store::Compact(): a part may have been left out. ABORTED:
  // the log was closed.
  absl::StatusOr<int64_t> Compact();
  // `call` runs at once with the bytes of all entries so far, and after every step with those of
  // its entry, and with those that are gone, below 0, when it is compacted; one such call at a
  // time, which must be quick. Replaces the one before.
  void OnWritten(std::function<void(int64_t)> call);
  // Waits for the step in progress; all later ones are refused (ABORTED).
  void Close();
  // Calls every watcher when something other than a step happened (the log was dropped).
  void Wake();

  absl::Time Now() const { return clock_(); }
  absl::Duration Seen() const { return seen_(); }
  Moment At() const { return {clock_(), seen_()}; }

 private:
  static constexpr int64_t kLeastGrowth = 1 << 20;  // bytes: below, compacting saves little
  static constexpr int64_t kMostGrowth = 16
                                         << 20;  // bytes: a log is never far beyond what it needs
  absl::Status Load();
  absl::StatusOr<int64_t> CompactOnce();

  const std::string session_;
  store::Store& store_;
  const Clock clock_;
  const SeenClock seen_;
  std::mutex compact_mutex_;         // guards no member: one compaction at a time
  std::mutex write_mutex_;           // held for a whole step, the store's write included
  std::atomic<bool> closed_{false};  // set while write_mutex_ is held
  mutable std::mutex state_mutex_;
  SessionState state_ ABSL_GUARDED_BY(state_mutex_);
  std::atomic<int64_t> bytes_{0};
  std::atomic<int64_t> compact_beyond_{kLeastGrowth};                      // bytes
  std::atomic<bool> compaction_due_{false};                                // told, and not ended
  std::function<void(int64_t)> on_written_ ABSL_GUARDED_BY(write_mutex_);  // may be null
  std::mutex watch_mutex_;
  std::map<WatchId, std::shared_ptr<std::function<void()>>> watchers_ ABSL_GUARDED_BY(watch_mutex_);
  WatchId next_watch_ ABSL_GUARDED_BY(watch_mutex_) = 1;
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_JOURNAL_H_

// Log compaction: finds the entries of a log on which nothing depends any more, so that a log does
// not grow for ever with what failed, expired or was replaced.
#ifndef VANTAGE_SERVER_SESSION_LOG_COMPACTION_H_
#define VANTAGE_SERVER_SESSION_LOG_COMPACTION_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "server/session/session_state.h"
#include "vantage/storage/v1/log.pb.h"

namespace vantage::session {

// A log folds to the same state with its entries as with those that stand for them, and goes on in
// the same way. An entry goes when it tells of
// - an upload that ended without a scan and that the state has forgotten,
// - a refused place that has expired, as the state has seen,
// - a station or a plan that was deleted,
// - a claim that was prolonged, where a later entry of that claim follows before any scan was
//   merged (a merge looks at when claims expire),
// - a configuration of the session or of a scanner that a later one replaced,
// - a prior of the site that a later one replaced, or that was taken out,
// - poses that were adjusted, where a later entry says again where each of those scans is.
// What counts of it (how many there were, a request that is still remembered) is kept in the entry
// that stands for it.
class LogCompaction {
 public:
  // So many of the newest entries stay as they are: who watches and was away for a while gets them.
  static constexpr uint64_t kNewest = 1024;

  // An entry that stands for others, and the bytes that it saves.
  struct Replacement {
    storage::v1::LogEntry entry;
    int64_t saved_bytes = 0;
  };

  // `state` is that of the log, as of an entry not before the last that will be read.
  explicit LogCompaction(const SessionState& state);

  // Takes the log's entries, from the first on.
  void Read(const storage::v1::LogEntry& entry);
  // In the order of the log.
  std::vector<Replacement> Replacements() const;

 private:
  static constexpr uint64_t kStays = UINT64_MAX;
  // An entry that may go.
  struct Candidate {
    uint64_t first = 0;  // it stands for those from here on
    uint64_t sequence = 0;
    google::protobuf::Timestamp time;
    google::protobuf::Duration seen;
    storage::v1::LeftOut counts;  // without the resource
    int64_t bytes = 0;
    bool stands_for_others = false;
    bool has_request = false;
    uint64_t goes_with = kStays;  // the entry with this sequence, when that is old enough
  };
  struct RememberedRequest {
    storage::v1::Request request;
    std::string resource;
  };

  static Candidate CandidateOf(const storage::v1::LogEntry& entry, bool goes);
  void Remember(const storage::v1::LogEntry& entry, const std::string& resource);
  static void Replace(Candidate& candidate);
  void EndProlonged(const std::string& claim);
  void EndConfigured(const std::string& scanner);
  // A later entry says where a scan is.
  void Place(const std::string& scan);
  void ReadAdjustment(const storage::v1::LogEntry& entry);

  std::unordered_set<std::string> uploads_;     // that the state knows
  std::unordered_set<std::string> rejections_;  // the same
  std::vector<Candidate> candidates_;
  std::unordered_map<std::string, size_t> prolonged_;           // by claim: its last prolongation
  std::unordered_map<std::string, size_t> stations_;            // by name: its creation
  std::unordered_map<std::string, std::vector<size_t>> plans_;  // by name: its creation and end
  std::unordered_map<std::string, size_t> scanners_;            // by name: its last change
  // Entries that adjusted poses, how many scans are still where each put them, and which: by name,
  // the place in the former.
  struct PlacedScans {
    size_t candidate = 0;
    size_t scans = 0;
  };
  std::vector<PlacedScans> adjustments_;
  std::unordered_map<std::string, size_t> placed_by_;
  size_t configured_ = SIZE_MAX;  // the last configuration
  size_t site_prior_ = SIZE_MAX;  // the prior of the site that is set
  uint64_t last_ = 0;
  // The last SessionState::kRequests requests, by the sequence of their entries.
  std::unordered_map<uint64_t, RememberedRequest> requests_;
  std::deque<uint64_t> request_order_;
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_LOG_COMPACTION_H_

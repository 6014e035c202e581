// The state of a session, computed from its log. Pure data, without threads and without the model.
#ifndef VANTAGE_SERVER_SESSION_SESSION_STATE_H_
#define VANTAGE_SERVER_SESSION_SESSION_STATE_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "vantage/storage/v1/log.pb.h"
#include "vantage/v1/event.pb.h"
#include "vantage/v1/fleet.pb.h"
#include "vantage/v1/plan.pb.h"
#include "vantage/v1/pose_graph.pb.h"
#include "vantage/v1/scan.pb.h"
#include "vantage/v1/session.pb.h"
#include "vantage/v1/site_prior.pb.h"
#include "vantage/v1/upload.pb.h"

namespace vantage::session {

struct ScanRecord {
  v1::Scan scan;
  std::string blob;       // SHA-256 of the encoded range image, 32 bytes; empty: erased
  bool in_model = false;  // by the log: merged, and not removed since
  uint64_t entered = 0;   // the version of the model that was the first with it in, if it is
  // When it was withdrawn, by the time that servers had seen pass.
  absl::Duration withdrawn;
  // Of the entry that says that it was taken out of the model: snapshots of earlier ones may hold
  // it. 0: it was never taken out.
  uint64_t removed = 0;
  // Of its upload: its size, also when its data have been erased since, and its last pieces.
  int64_t received_bytes = 0;
  storage::v1::LastPieces last_pieces;
  // The preview that it replaces, and the blob of that, until it is merged in its place; empty
  // where there is none in the model.
  v1::Scan preview;
  std::string preview_blob;
};

// Of an upload that brought a file.
struct FileRecord {
  storage::v1::LastPieces last_pieces;
  std::set<int32_t> setups;  // that are scans, from 1
};

struct PlanRecord {
  v1::Plan plan;     // basic view
  std::string blob;  // SHA-256 of the full result; empty while it runs or when it was released
};

struct RequestRecord {
  std::string method;
  std::string fingerprint;
  std::string resource;   // name of the resource that the request made or changed
  uint64_t sequence = 0;  // of its entry
};

struct ClaimRecord {
  v1::Claim claim;
  std::string caller;  // who took it; empty: not known
  // Why it ended; unspecified: it is held.
  v1::ClaimEndReason end_reason = v1::CLAIM_END_REASON_UNSPECIFIED;

  bool held() const { return end_reason == v1::CLAIM_END_REASON_UNSPECIFIED; }
};

struct SessionState {
  std::string tenant;
  v1::Session session;  // without counts, rejections and sequence: see Describe()
  std::map<std::string, ScanRecord> scans;  // by resource name
  std::vector<std::string> scan_order;      // by creation
  // Those that are open or became a scan, and the last of those that ended without one.
  std::map<std::string, v1::Upload> uploads;
  std::deque<std::string> ended_uploads;    // of those: oldest first
  std::map<std::string, FileRecord> files;  // of those, by name: all of which was here
  std::map<std::string, PlanRecord> plans;
  std::vector<std::string> plan_order;    // of those, oldest first
  v1::SitePrior site_prior;               // without a name where there is none
  std::string site_prior_blob;            // SHA-256 of its triangles
  uint64_t site_prior_set = 0;            // of the entry that set it
  std::vector<v1::Rejection> rejections;  // without those that had expired when the last was made
  std::map<std::string, v1::Scanner> scanners;  // the fleet
  std::vector<std::string> scanner_order;       // by creation, with those that were deleted
  std::map<std::string, ClaimRecord> claims;    // all claims ever made
  std::vector<std::string> held_claims;         // oldest first; also expired ones, until logged
  std::map<std::string, v1::Station> stations;  // whose scans have not come
  std::vector<std::string> station_order;       // of those, oldest first
  // By request_id: the last that there were, and that which created the session.
  std::map<std::string, RequestRecord> requests;
  std::deque<std::pair<uint64_t, std::string>> request_order;  // without the latter; by sequence
  uint64_t last_sequence = 0;
  absl::Duration last_seen;   // when the last entry was written, by the time seen
  std::string last_resource;  // name of the resource that the last entry made or changed
  uint64_t model_version = 0;
  // What ties scans in the model to each other, by the names of both, the lesser first.
  std::map<std::pair<std::string, std::string>, v1::ScanLink> links;
  // Links came or went since poses were adjusted last: they may have to be adjusted.
  bool poses_due = false;
  uint64_t upload_count = 0;     // ever created
  uint64_t rejection_count = 0;  // ever made
  uint64_t station_count = 0;    // ever created
  uint64_t plan_count = 0;       // ever created

  // Applies the next entry. INTERNAL, naming the entry, when it does not fit the state before it;
  // FAILED_PRECONDITION when its format is newer than this server knows.
  absl::Status Apply(const storage::v1::LogEntry& entry);

  // The places that people refused and that have not expired, oldest first.
  std::vector<const v1::Rejection*> RejectionsAt(const google::protobuf::Timestamp& now) const;

  // The session as clients see it, without its rejections.
  v1::Session Describe() const;
  // The newest of the rejections, which GetSession adds.
  void AddRejections(const google::protobuf::Timestamp& now, v1::Session& session) const;

  // The claims that are held, oldest first.
  std::vector<const v1::Claim*> HeldClaims() const;

  // What is kept of what comes without end. By number, so that a log gives the same state whenever
  // it is read.
  static constexpr size_t kRequests = 4096;
  static constexpr size_t kEndedUploads = 64;

  int PendingScans() const;
  bool AnyInModel() const;
  // Scans, in the order of creation, that are not yet registered or refused, or whose presence in
  // the model differs from what the log asks for.
  std::vector<std::string> UndecidedScans() const;

 private:
  // The upload that a scan came in is committed, unless it brought a file.
  void EndWithScan(const v1::Scan& scan);
  // A scan came into the model with these links, or left it.
  absl::Status SetLinks(const v1::SessionEvent& event, const std::string& scan);
  absl::Status AdjustPoses(const v1::SessionEvent& event);
};

// The index in an order of creation of the first resource after `name` (empty: the first of all).
// Page tokens are such names: INVALID_ARGUMENT naming `page_token` for one that is not in the
// order. Nothing ever leaves an order that is paged so, so that a name marks the same place for the
// life of the session: those of what was deleted stay in it, and are not given again.
absl::StatusOr<size_t> PlaceAfter(const std::vector<std::string>& order, absl::string_view name);

// The same for resources that come and go and whose names the server numbers ('.../stations/
// station-3'): the number after which a page begins, 0 for the first. INVALID_ARGUMENT naming
// `page_token`: `name` has no number, or one above `count`, the last that was given.
absl::StatusOr<int64_t> NumberAfter(absl::string_view name, uint64_t count);

// Changes whenever a field that a client can set changes.
std::string EtagOf(const v1::Session& session);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_SESSION_STATE_H_

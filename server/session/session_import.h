// A session that comes in as an archive. What the archive holds is stored as it comes; the session
// is there when all of it has come and fits together. Whoever made the archive is not trusted.
#ifndef VANTAGE_SERVER_SESSION_SESSION_IMPORT_H_
#define VANTAGE_SERVER_SESSION_SESSION_IMPORT_H_

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "server/session/archive_reader.h"
#include "server/session/session_context.h"
#include "server/session/session_state.h"
#include "server/session/tenant_account.h"
#include "server/session/tenant_memory.h"
#include "server/session/upload.h"
#include "vantage/storage/v1/archive.pb.h"

namespace vantage::session {

// Not thread safe. What it stored goes with it, unless Keep() was called.
class SessionImport {
 public:
  // Who asked for it, and how.
  struct Asked {
    std::string session_id;  // empty: as in the archive
    std::string tenant;
    std::string request_id;
  };
  // `spools`: a beginning of names of spools that nobody has and nobody gets. `account`: the
  // tenant's.
  SessionImport(Asked asked, std::string spools, std::shared_ptr<TenantAccount> account,
                const SessionDependencies& dependencies);
  ~SessionImport();
  SessionImport(const SessionImport&) = delete;
  SessionImport& operator=(const SessionImport&) = delete;

  // Takes the next bytes. DATA_LOSS (ARCHIVE_DAMAGED), FAILED_PRECONDITION (ARCHIVE_NEWER),
  // RESOURCE_EXHAUSTED (QUOTA_EXCEEDED, MEMORY_SHORT, FILE_TOO_LARGE and those of the store): it
  // cannot go on.
  absl::Status Take(absl::string_view bytes);
  // True when all of it has come and fits together.
  bool whole() const { return whole_; }

  // Of one that is whole: the id that the session gets.
  const std::string& id() const { return id_; }
  const std::string& request_id() const { return asked_.request_id; }
  // Writes the log, in one step: from then on the store has the session, which Load() finds.
  absl::Status PutLog();
  // The session has what was stored, and its account counts it.
  void Keep();

 private:
  absl::Status Read(storage::v1::ArchiveRecord& record);
  absl::Status Begin(const storage::v1::ArchiveHeader& header);
  absl::Status BeginBlob(const storage::v1::ArchiveBlob& blob);
  absl::Status AddChunk(const storage::v1::ArchiveChunk& chunk);
  absl::Status EndScan();
  absl::Status EndPlan();
  absl::Status EndSitePrior();
  // Memory for a prior of the site, beside what was taken for it. RESOURCE_EXHAUSTED (MEMORY_SHORT;
  // FILE_TOO_LARGE: the server never has so many).
  absl::StatusOr<MemoryAccount::Reservation> TakeForPrior(int64_t bytes) const;
  absl::Status AddEntry(storage::v1::LogEntry& entry);
  absl::Status End();
  std::string LogSpool() const;

  const Asked asked_;
  const std::string spools_;
  AccountShare account_;
  const SessionDependencies& dependencies_;
  ArchiveReader reader_;
  std::optional<storage::v1::ArchiveHeader> header_;
  std::string id_;
  absl::Duration rebase_;  // from the time seen by the other server to that seen by this one
  // The blob that is coming in.
  std::optional<storage::v1::ArchiveBlob> blob_;
  std::unique_ptr<Upload> scan_;  // of its kind
  std::string plan_;              // of its kind: what came of it
  const TenantMemory memory_;
  MemoryAccount::Reservation prior_memory_;  // of what came of a prior of the site
  int64_t blob_bytes_ = 0;
  int64_t chunks_ = 0;
  size_t blobs_begun_ = 0;
  // What is stored: the names that the log has for it (SHA-256, each as often as it came) to those
  // of the store. They differ where a plan names its session, which has another name here.
  std::multimap<std::string, std::string> stored_;
  SessionState state_;  // of the entries that came
  int64_t log_bytes_ = 0;
  bool whole_ = false;
  bool kept_ = false;
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_SESSION_IMPORT_H_

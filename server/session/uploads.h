// A session's uploads: from the announcement to the committed scan.
#ifndef VANTAGE_SERVER_SESSION_UPLOADS_H_
#define VANTAGE_SERVER_SESSION_UPLOADS_H_

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "server/session/scan_reconciler.h"
#include "server/session/session_context.h"
#include "server/session/upload.h"
#include "vantage/v1/scan_service.pb.h"

namespace vantage::session {

class Uploads;

// An upload as whoever sends its pieces holds it. It may end meanwhile, by whatever hand: then the
// answers are those of the log, as for one that had ended before. Thread safe. The session outlives
// it.
class HeldUpload {
 public:
  const std::string& name() const { return name_; }

  // Takes a piece, a total, both or neither, and commits the scan when all of it is there, which an
  // earlier call may have been refused. Returns the upload as far as it is durable. NOT_FOUND;
  // FAILED_PRECONDITION (UPLOAD_ENDED): it was ended without a scan; as Upload::Accept() and
  // SetTotal(); when committing, RESOURCE_EXHAUSTED (TOO_MANY_PENDING_SCANS), and what is wrong
  // with the whole.
  absl::StatusOr<v1::Upload> Take(const UnpackedPiece* piece, const v1::UploadTotal* total);
  // Makes durable what was taken.
  absl::StatusOr<v1::Upload> Sync();
  // Taken and not durable yet.
  int64_t UnsyncedBytes() const;
  // That is worth a sync.
  bool WindowFull() const;

 private:
  friend class Uploads;
  HeldUpload(Uploads& uploads, std::string name, std::shared_ptr<Upload> open)
      : uploads_(&uploads), name_(std::move(name)), open_(std::move(open)) {}
  // Null: it has ended.
  std::shared_ptr<Upload> Open() const;

  Uploads* uploads_;
  std::string name_;
  std::shared_ptr<Upload> open_;  // null: it was not open when it was looked for
};

// Thread safe.
class Uploads {
 public:
  Uploads(SessionContext& context, ScanReconciler& reconciler);

  absl::StatusOr<v1::Upload> Create(const v1::CreateUploadRequest& request);
  absl::StatusOr<v1::Upload> Get(const std::string& name);
  // For sending pieces; whether there is such an upload, the first of them tells.
  HeldUpload Hold(const std::string& name);
  // A piece, a total, both or neither, at once durable.
  absl::StatusOr<v1::Upload> Add(const std::string& name, const v1::Piece* piece,
                                 const v1::UploadTotal* total);

  // After a restart: those that were open go on from their last piece.
  void Resume();
  // Commits those of which all is there. What cannot be committed now is when its sender asks
  // again.
  void CommitComplete();
  // Ends those that were idle for too long.
  void Expire();
  // The session is closed: ends all. A piece that is being taken comes before that, or is refused.
  void Close();

  size_t OpenCount() const;
  // Of those that are open.
  std::vector<std::string> Names() const;
  // Infinitely long ago where none is open.
  absl::Time LastPiece() const;

 private:
  friend class HeldUpload;
  std::shared_ptr<Upload> FindOpen(const std::string& name) const;
  // `open` as it stands, or what the log has where it is null.
  absl::StatusOr<v1::Upload> Describe(const std::string& name,
                                      const std::shared_ptr<Upload>& open) const;
  // `open` is null where it was not found; else it was open lately.
  absl::StatusOr<v1::Upload> Take(const std::string& name, const std::shared_ptr<Upload>& open,
                                  const UnpackedPiece* piece, const v1::UploadTotal* total);
  absl::StatusOr<v1::Upload> Sync(const std::string& name, const std::shared_ptr<Upload>& open);
  // The upload leaves `open_`.
  void LetGo(Upload& upload, const std::string& name);
  absl::Status Commit(const std::shared_ptr<Upload>& upload);
  absl::Status Fail(Upload& upload, const absl::Status& why);

  SessionContext& context_;
  Journal& journal_;
  const SessionDependencies& dependencies_;
  ScanReconciler& reconciler_;

  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<Upload>> open_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_UPLOADS_H_

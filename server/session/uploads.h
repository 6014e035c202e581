// A session's uploads: from the announcement to the committed scan.
#ifndef VANTAGE_SERVER_SESSION_UPLOADS_H_
#define VANTAGE_SERVER_SESSION_UPLOADS_H_

#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "server/session/begun_work.h"
#include "server/session/file_reading.h"
#include "server/session/file_readings.h"
#include "server/session/scan_intake.h"
#include "server/session/scan_reconciler.h"
#include "server/session/session_context.h"
#include "server/session/upload.h"
#include "vantage/v1/scan_service.pb.h"

namespace vantage::session {

class Uploads;

// The handle by which pieces of one upload are sent. When the upload ends meanwhile, for any
// reason, calls are answered from the log, as for an upload that had ended before. Thread safe. The
// session outlives it.
class HeldUpload {
 public:
  const std::string& name() const { return name_; }

  // Takes a piece, a total, both or neither, and commits the scan when it is complete, also when an
  // earlier call could not commit it. Returns the upload as far as it is durable. NOT_FOUND;
  // FAILED_PRECONDITION (UPLOAD_ENDED): it was ended without a scan; as Upload::Accept() and
  // SetTotal(); when committing, RESOURCE_EXHAUSTED (TOO_MANY_PENDING_SCANS), and what is wrong
  // with the whole.
  absl::StatusOr<v1::Upload> Take(const UnpackedPiece* piece, const v1::UploadTotal* total);
  // Makes durable what was taken.
  absl::StatusOr<v1::Upload> Sync();
  // Bytes that were taken and are not durable yet.
  int64_t UnsyncedBytes() const;
  // True when they are worth a sync.
  bool WindowFull() const;

 private:
  friend class Uploads;
  HeldUpload(Uploads& uploads, std::string name, std::shared_ptr<Upload> open)
      : uploads_(&uploads), name_(std::move(name)), open_(std::move(open)) {}
  // Null when it has ended.
  std::shared_ptr<Upload> Open() const;

  Uploads* uploads_;
  std::string name_;
  std::shared_ptr<Upload> open_;  // null when it was not open at the look-up
};

// Thread safe.
class Uploads {
 public:
  Uploads(SessionContext& context, ScanReconciler& reconciler);

  // Takes the request as it came: its upload's message is what the log stores. Where there is no
  // room for it (TOO_MANY_UPLOADS, QUOTA_EXCEEDED), uploads that nothing was sent of for a minute,
  // or nothing for ten, give way to it.
  absl::StatusOr<v1::Upload> Create(const v1::CreateUploadRequest& request);
  absl::StatusOr<v1::Upload> Get(const std::string& name);
  // Those that are open, became a scan or are still known to have ended without one, of the states
  // that are asked for (none: of all), in pages as in Scans::List().
  absl::StatusOr<std::vector<v1::Upload>> List(const v1::ListUploadsRequest& request,
                                               absl::string_view after, size_t limit, bool& more);
  // Ends one that is open; returns it as it ended, now or before. NOT_FOUND; FAILED_PRECONDITION
  // (UPLOAD_ENDED): it has become a scan.
  absl::StatusOr<v1::Upload> Abort(const std::string& name, const RequestKey& key);
  // A handle for sending pieces. Only its first call tells whether the upload exists.
  HeldUpload Hold(const std::string& name);
  // Takes a piece, a total, both or neither, and makes them durable.
  absl::StatusOr<v1::Upload> Add(const std::string& name, const v1::Piece* piece,
                                 const v1::UploadTotal* total);

  // After a restart: open uploads continue after their last piece.
  void Resume();
  // Goes on reading files, once nothing that was stored is collected any more.
  void ResumeReading();
  // Reading that is under way is not counted as what brought the server to its end.
  void GiveUp() { work_.EndAll(); }
  // Commits those of which all is there. Uploads that cannot be committed now are committed when
  // their sender asks again.
  void CommitComplete();
  // Ends uploads that were idle for too long.
  void Expire();
  // Called when the session is closed: ends all uploads. A piece that arrives now is either stored
  // before that or refused.
  void Close();

  size_t OpenCount() const;
  // Of the open uploads.
  std::vector<std::string> Names() const;
  // By the time seen; 0 when none is open.
  absl::Duration LastPiece() const;

 private:
  friend class HeldUpload;
  absl::StatusOr<v1::Upload> CreateNow(const v1::CreateUploadRequest& request);
  // Ends the one that was idle for longest, if that was long enough; whether there was one.
  bool MakeWay();
  // Ends uploads that were let go.
  void EndIdle(const std::vector<std::shared_ptr<Upload>>& idle, const std::string& why);
  std::shared_ptr<Upload> FindOpen(const std::string& name) const;
  // The state of `open`, or, when it is null, of the log.
  absl::StatusOr<v1::Upload> Describe(const std::string& name,
                                      const std::shared_ptr<Upload>& open) const;
  // `open`: null when it was not found; otherwise it was open at the look-up.
  absl::StatusOr<v1::Upload> Take(const std::string& name, const std::shared_ptr<Upload>& open,
                                  const UnpackedPiece* piece, const v1::UploadTotal* total);
  absl::StatusOr<v1::Upload> Sync(const std::string& name, const std::shared_ptr<Upload>& open);
  // Whether piece and total, where there are any, are those that a scan came with.
  bool IsOfScan(const std::string& scan, const UnpackedPiece* piece,
                const v1::UploadTotal* total) const;
  // Removes the upload from `open_`.
  void LetGo(Upload& upload, const std::string& name);
  absl::Status Commit(const std::shared_ptr<Upload>& upload);
  // Whether there is a place for a file of that size among those on their way.
  absl::Status CheckFile(int64_t bytes);
  // All of a file is here: it is read from now on. The caller holds its commit_mutex().
  absl::Status BeginReading(const std::shared_ptr<Upload>& upload);
  void PostReading(const std::shared_ptr<Upload>& upload);
  // Reads it, or goes on with that, and ends it where that is done; when to call it again.
  std::chrono::milliseconds ReadFile(FileReading& reading, const std::shared_ptr<Upload>& upload,
                                     const FileReadings::GivenUp& given_up);
  void EndReading(const FileReading& reading, FileReading::Outcome outcome, Upload& upload);
  // Of a file that is read, or was: whether piece and total, where there are any, are of it.
  bool IsOfFile(const v1::Upload& upload, const UnpackedPiece* piece,
                const v1::UploadTotal* total) const;
  // Ends it and logs that. It was let go before, or the caller holds its commit_mutex(). `failure`:
  // of one that failed.
  absl::Status End(Upload& upload, v1::UploadState state, const std::string& why,
                   const RequestKey& key, const absl::Status& failure = absl::OkStatus());
  absl::Status Fail(Upload& upload, const absl::Status& why);

  SessionContext& context_;
  Journal& journal_;
  const SessionDependencies& dependencies_;
  ScanReconciler& reconciler_;
  ScanIntake intake_;
  BegunWork work_;  // on files, by the names of their uploads

  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<Upload>> open_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_UPLOADS_H_

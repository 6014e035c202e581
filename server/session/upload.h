// A scan that is being uploaded in pieces, in order. Each piece is checked, and the whole at the
// end.
#ifndef VANTAGE_SERVER_SESSION_UPLOAD_H_
#define VANTAGE_SERVER_SESSION_UPLOAD_H_

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/bytes/checksum.h"
#include "core/sensor/encoding.h"
#include "server/contract/limits.h"
#include "server/session/journal.h"
#include "server/session/tenant_account.h"
#include "server/store/store.h"
#include "vantage/storage/v1/log.pb.h"
#include "vantage/v1/upload.pb.h"

namespace vantage::session {

// A piece with its bytes decompressed and checked, or the error. It needs no upload, so it can be
// prepared while the previous piece is taken.
struct UnpackedPiece {
  UnpackedPiece(const v1::Piece& packed, const contract::Limits& limits);

  const v1::Piece& piece;  // outlives this
  absl::StatusOr<std::string> bytes;
  std::string digest;  // as in storage::v1::LastPieces; empty: there are no bytes
};

// Thread safe; pieces from several streams at once are taken one at a time.
class Upload {
 public:
  // `created` is the new resource, named and checked. `store` must outlive the upload. Room for its
  // bytes is taken from `account`, where there is one; `reserved` of them are taken already.
  // `seen`: when it was created, by the time seen.
  Upload(v1::Upload created, store::Store& store, const contract::Limits& limits,
         std::shared_ptr<AccountShare> account = nullptr, int64_t reserved = 0,
         absl::Duration seen = absl::ZeroDuration());

  // Loads what the store has of it after a restart; its idle time starts again. DATA_LOSS: it
  // cannot be continued. After any other error it can be continued once the medium works.
  absl::Status Resume(const Moment& now);

  // True when it is known how much of it is durable. After a failure of the medium this tries to
  // find out.
  absl::Status Check();

  // Takes a piece; it is durable after Sync. A piece that is already stored changes nothing.
  // ALREADY_EXISTS (PIECE_DIFFERS): another piece is in its place. OUT_OF_RANGE (UPLOAD_GAP): a
  // piece before it is missing; an ExpectedPiece says which. DATA_LOSS (PIECE_DAMAGED): the
  // checksum or the compression is wrong; send it again. INVALID_ARGUMENT: impossible sizes.
  // FAILED_PRECONDITION (UPLOAD_ENDED): committed, failed or expired. RESOURCE_EXHAUSTED
  // (QUOTA_EXCEEDED): it can go on when there is room.
  absl::Status Accept(const UnpackedPiece& unpacked, const Moment& now);
  absl::Status Accept(const v1::Piece& piece, const Moment& now) {
    return Accept(UnpackedPiece(piece, limits_), now);
  }

  // Sets size and SHA-256 of the whole. Harmless when the same was set before; ALREADY_EXISTS
  // (TOTAL_DIFFERS) when it differs.
  absl::Status SetTotal(const v1::UploadTotal& total);

  // Makes durable what was taken. On error, pieces that were not durable count as never received.
  absl::Status Sync();
  // Bytes of the range image that were taken and are not durable yet.
  int64_t Unsynced() const;
  // True when these are worth a sync: 4 MiB as stored, or half of what may be in flight.
  bool WindowFull() const;

  // True when all announced bytes have arrived, durable or not, and it is open.
  bool Complete() const;
  // True when what it brings is a file.
  bool OfFile() const;
  // Of a file that is complete: it is read from now on.
  void BeginReading();
  bool Reading() const;
  // What is known of a file while it is read: its set-ups, 0: not known yet; how far it was read,
  // and what it waits for, if it waits.
  void SetReading(int32_t setups, int64_t read_bytes, const std::string& waits_for);
  // A scan was made of it, for whose `bytes` room is taken: of what is reserved for the file, where
  // that is enough. RESOURCE_EXHAUSTED (QUOTA_EXCEEDED).
  absl::Status TakeRoomForScan(int64_t bytes);
  // The scan was received; or was not, and the room is given back.
  void ScanReceived(const std::string& scan, const Moment& now);
  void GiveBackRoomOfScan(int64_t bytes);
  // Room on the disk that it was promised, bytes; what it uses of it, and what is left in the end,
  // is told.
  void Promise(int64_t bytes, std::function<void(int64_t)> used);
  // When Complete(): number of samples, and the SHA-256 (32 bytes) under which the bytes are to be
  // stored; of a file nothing but its size and this. DATA_LOSS (SHA256_DIFFERS): they differ from
  // what was announced. INVALID_ARGUMENT: no valid range image.
  struct Content {
    size_t columns = 0;
    size_t rows = 0;
    size_t samples = 0;
    sensor::AppearanceKinds appearance;
    int64_t encoded_size = 0;
    std::string sha256;
  };
  absl::StatusOr<Content> Inspect();
  // What is known of it before it is complete: OK, or the error that Inspect() will come to, as
  // soon as a piece shows it.
  absl::Status CheckContent() const;
  // Its last pieces, as the log keeps them: as many as may be in flight.
  storage::v1::LastPieces LastPieces() const;

  // Ends it with `state`. The spool is dropped. The room goes to the scan when it was committed,
  // otherwise, and with a file, it is given back. `why`: of one that failed, with its reason.
  void End(v1::UploadState state, const std::string& message, const std::string& scan,
           const absl::Status& why = absl::OkStatus());

  // Its session has ended it; from now on the log has its state.
  void LetGo() { let_go_ = true; }
  bool let_go() const { return let_go_; }

  // By the time seen; so is the next.
  bool Idle(absl::Duration now) const;
  absl::Duration LastPiece() const;
  // The present resource; an interrupted upload continues after what is durable.
  v1::Upload Describe() const;

  // Held by the thread that completes it, so that only one does.
  std::mutex& commit_mutex() { return commit_mutex_; }

 private:
  struct Stored {
    int64_t offset;
    int64_t size;
    std::string digest;  // tells it from every other piece
    int64_t kept_end;    // bytes of it and all before it as stored, compressed
  };
  absl::Status CheckOpen() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status CheckWhole() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  int64_t Received() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  int64_t Durable() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  sensor::RangeImageDecoder Decoder() const;
  absl::Status Load() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status Reserve(int64_t bytes) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Use(int64_t bytes) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  int64_t MostBytes() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  store::Store& store_;
  const contract::Limits limits_;
  const std::shared_ptr<AccountShare> account_;
  std::atomic<bool> let_go_{false};
  std::mutex commit_mutex_;
  std::mutex sync_mutex_;  // one sync at a time; what arrives meanwhile is in the next
  mutable std::mutex mutex_;
  v1::Upload upload_ ABSL_GUARDED_BY(mutex_);
  std::vector<Stored> pieces_ ABSL_GUARDED_BY(mutex_);
  size_t records_ ABSL_GUARDED_BY(mutex_) = 0;          // in the spool: pieces and total
  size_t durable_records_ ABSL_GUARDED_BY(mutex_) = 0;  // of these
  size_t durable_pieces_ ABSL_GUARDED_BY(mutex_) = 0;
  bool created_with_total_ ABSL_GUARDED_BY(mutex_) = false;
  bool loaded_ ABSL_GUARDED_BY(mutex_) = true;    // the content of the spool is known
  bool broken_ ABSL_GUARDED_BY(mutex_) = false;   // a sync failed; the spool must be read again
  int64_t reserved_ ABSL_GUARDED_BY(mutex_);      // bytes of the account
  int64_t promised_ ABSL_GUARDED_BY(mutex_) = 0;  // bytes of the disk, not used yet
  std::function<void(int64_t)> used_ ABSL_GUARDED_BY(mutex_);  // null: nothing was promised
  // Hash of the bytes so far, so that nothing has to be read again at the end.
  bytes::Sha256 sha256_ ABSL_GUARDED_BY(mutex_);
  sensor::RangeImageDecoder decoder_ ABSL_GUARDED_BY(mutex_);
  absl::Duration last_piece_ ABSL_GUARDED_BY(mutex_);  // by the time seen
};

// Whether a piece is one of those.
bool IsOneOf(const storage::v1::LastPieces& last, const UnpackedPiece& unpacked);

// The error in a total of a range image, or of a file, if any.
absl::Status CheckTotal(const v1::UploadTotal& total, const std::string& field,
                        const contract::Limits& limits, bool of_file = false);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_UPLOAD_H_

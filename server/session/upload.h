// A scan on its way: pieces in order, each checked, the whole checked at the end.
#ifndef VANTAGE_SERVER_SESSION_UPLOAD_H_
#define VANTAGE_SERVER_SESSION_UPLOAD_H_

#include <atomic>
#include <cstdint>
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
#include "server/session/tenant_account.h"
#include "server/store/store.h"
#include "vantage/v1/upload.pb.h"

namespace vantage::session {

// A piece, and its bytes, decompressed and checked, or what is wrong with them: work that needs no
// upload and can be done while the piece before is taken.
struct UnpackedPiece {
  UnpackedPiece(const v1::Piece& packed, const contract::Limits& limits);

  const v1::Piece& piece;  // outlives this
  absl::StatusOr<std::string> bytes;
};

// Thread safe; pieces from several streams at once are taken one at a time.
class Upload {
 public:
  // `created` is the resource as it was made, named and with its fields checked. `store` must
  // outlive the upload. Room for its bytes is taken from `account`, where there is one; `reserved`
  // of them are taken already.
  Upload(v1::Upload created, store::Store& store, const contract::Limits& limits,
         std::shared_ptr<AccountShare> account = nullptr, int64_t reserved = 0);

  // Loads what the store has of it after a restart; its idle time begins anew. DATA_LOSS: it
  // cannot go on. With any other error it goes on when the medium does.
  absl::Status Resume(absl::Time now);

  // What of it is durable is known; after a failure of the medium, this tries to find out.
  absl::Status Check();

  // Takes a piece; it is durable after Sync. A piece that is already stored changes nothing.
  // ALREADY_EXISTS (PIECE_DIFFERS): another piece is in its place. OUT_OF_RANGE (UPLOAD_GAP): a
  // piece before it is missing; an ExpectedPiece says which. DATA_LOSS (PIECE_DAMAGED): the
  // checksum or the compression is wrong; send it again. INVALID_ARGUMENT: impossible sizes.
  // FAILED_PRECONDITION (UPLOAD_ENDED): committed, failed or expired. RESOURCE_EXHAUSTED
  // (QUOTA_EXCEEDED): it can go on when there is room.
  absl::Status Accept(const UnpackedPiece& unpacked, absl::Time now);
  absl::Status Accept(const v1::Piece& piece, absl::Time now) {
    return Accept(UnpackedPiece(piece, limits_), now);
  }

  // States the whole. Harmless when it was stated before and is the same; ALREADY_EXISTS
  // (TOTAL_DIFFERS) when it is another.
  absl::Status SetTotal(const v1::UploadTotal& total);

  // Makes durable what was taken. On error it is as if what was not durable had never come.
  absl::Status Sync();
  // Bytes of the range image that were taken and are not durable yet.
  int64_t Unsynced() const;
  // These are worth a sync: 4 MiB where they are kept, or half of what may be in flight.
  bool WindowFull() const;

  // Every byte that was announced is there, durable or not.
  bool Complete() const;
  // What they are, when Complete: size in samples, and the SHA-256 (32 bytes) under which they are
  // to be kept. DATA_LOSS (SHA256_DIFFERS): they are not what was announced. INVALID_ARGUMENT: no
  // valid range image.
  struct Content {
    size_t columns = 0;
    size_t rows = 0;
    size_t samples = 0;
    int64_t encoded_size = 0;
    std::string sha256;
  };
  absl::StatusOr<Content> Inspect();

  // Ends it: `state` is what it came to. The spool is dropped; the room of a committed scan is the
  // scan's, else it is given back.
  void End(v1::UploadState state, const std::string& message, const std::string& scan);

  // Its session has ended it: from now on the log says what there is to know.
  void LetGo() { let_go_ = true; }
  bool let_go() const { return let_go_; }

  bool Idle(absl::Time now) const;
  absl::Time LastPiece() const;
  // The resource as it stands: where to go on is behind what is durable.
  v1::Upload Describe() const;

  // Held by whoever completes it, so that only one does.
  std::mutex& commit_mutex() { return commit_mutex_; }

 private:
  struct Stored {
    int64_t offset;
    int64_t size;
    uint32_t crc32c;
    int64_t kept_end;  // bytes of it and all before it as they are kept, compressed
  };
  absl::Status CheckOpen() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status CheckWhole() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  int64_t Received() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  int64_t Durable() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  sensor::RangeImageDecoder Decoder() const;
  absl::Status Load() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status Reserve(int64_t bytes) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  store::Store& store_;
  const contract::Limits limits_;
  const std::shared_ptr<AccountShare> account_;
  std::atomic<bool> let_go_{false};
  std::mutex commit_mutex_;
  std::mutex sync_mutex_;  // one at a time; what comes meanwhile is in the next
  mutable std::mutex mutex_;
  v1::Upload upload_ ABSL_GUARDED_BY(mutex_);
  std::vector<Stored> pieces_ ABSL_GUARDED_BY(mutex_);
  size_t records_ ABSL_GUARDED_BY(mutex_) = 0;          // in the spool: pieces and total
  size_t durable_records_ ABSL_GUARDED_BY(mutex_) = 0;  // of these
  size_t durable_pieces_ ABSL_GUARDED_BY(mutex_) = 0;
  bool created_with_total_ ABSL_GUARDED_BY(mutex_) = false;
  bool loaded_ ABSL_GUARDED_BY(mutex_) = true;   // what the spool has is known
  bool broken_ ABSL_GUARDED_BY(mutex_) = false;  // a sync failed, and the spool is to be read anew
  int64_t reserved_ ABSL_GUARDED_BY(mutex_);     // bytes of the account
  // Of the bytes so far, so that nothing has to be read again at the end.
  bytes::Sha256 sha256_ ABSL_GUARDED_BY(mutex_);
  sensor::RangeImageDecoder decoder_ ABSL_GUARDED_BY(mutex_);
  absl::Time last_piece_ ABSL_GUARDED_BY(mutex_);
};

// What is wrong with a stated total.
absl::Status CheckTotal(const v1::UploadTotal& total, const std::string& field,
                        const contract::Limits& limits);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_UPLOAD_H_

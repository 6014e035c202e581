#include "server/session/upload.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/bytes/compression.h"
#include "server/contract/error.h"
#include "server/conversion/to_proto.h"
#include "server/store/piece_record.h"
#include "vantage/storage/v1/log.pb.h"
#include "vantage/v1/error.pb.h"

namespace vantage::session {
namespace {

using absl::StatusCode;

constexpr int64_t kWindowBytes = 4 << 20;

constexpr size_t kDigestBytes = 16;
// What may be in flight are this many pieces at most that are told from others after the commit.
constexpr size_t kMaxLastPieces = 1024;

// Not the checksum, for which other bytes are easily made.
std::string DigestOf(int64_t offset, absl::string_view bytes) {
  char place[sizeof(int64_t)];
  for (size_t i = 0; i < sizeof(place); ++i) place[i] = static_cast<char>(offset >> (8 * i));
  bytes::Sha256 sha256;
  sha256.Update(absl::string_view(place, sizeof(place)));
  sha256.Update(bytes);
  return sha256.Digest().substr(0, kDigestBytes);
}

// Decompresses and checks the bytes of a piece.
absl::StatusOr<std::string> Unpack(const v1::Piece& piece, const contract::Limits& limits) {
  contract::Violations violations;
  if (piece.data().empty()) violations.Add("piece.data", "must not be empty");
  if (piece.sequence() < 0) violations.Add("piece.sequence", "must not be negative");
  if (piece.offset() < 0) violations.Add("piece.offset", "must not be negative");
  const bool compressed = piece.compression() == v1::COMPRESSION_ZSTD;
  if (!compressed && piece.compression() != v1::COMPRESSION_NONE &&
      piece.compression() != v1::COMPRESSION_UNSPECIFIED) {
    violations.Add("piece.compression", "must be NONE or ZSTD");
  }
  const int64_t data_size = static_cast<int64_t>(piece.data().size());
  const int64_t size = compressed ? piece.uncompressed_size_bytes() : data_size;
  if (size < 1 || size > limits.piece_bytes) {
    violations.Add(compressed ? "piece.size" : "piece.data",
                   absl::StrCat("has ", size, " bytes, must have 1 to ", limits.piece_bytes));
  } else if (!compressed && piece.uncompressed_size_bytes() != 0 &&
             piece.uncompressed_size_bytes() != data_size) {
    violations.Add("piece.size",
                   absl::StrCat("is ", piece.uncompressed_size_bytes(), ", data has ", data_size));
  }
  if (!violations.empty()) return violations.ToStatus();

  std::string bytes;
  if (compressed) {
    absl::StatusOr<std::string> unpacked =
        bytes::ZstdDecompress(piece.data(), static_cast<size_t>(size));
    if (!unpacked.ok()) {
      return contract::ErrorWithReason(
          StatusCode::kDataLoss, "PIECE_DAMAGED",
          absl::StrCat("piece ", piece.sequence(), ": ", unpacked.status().message(),
                       "; send it again"));
    }
    bytes = *std::move(unpacked);
  } else {
    bytes = piece.data();
  }
  if (bytes::Crc32c(bytes) != piece.crc32c()) {
    return contract::ErrorWithReason(
        StatusCode::kDataLoss, "PIECE_DAMAGED",
        absl::StrCat("piece ", piece.sequence(),
                     ": crc32c (Castagnoli, of the bytes before compression) "
                     "does not match; send it again"));
  }
  return bytes;
}

}  // namespace

UnpackedPiece::UnpackedPiece(const v1::Piece& packed, const contract::Limits& limits)
    : piece(packed), bytes(Unpack(packed, limits)) {
  if (bytes.ok()) digest = DigestOf(piece.offset(), *bytes);
}

bool IsOneOf(const storage::v1::LastPieces& last, const UnpackedPiece& unpacked) {
  const int64_t index = unpacked.piece.sequence() - last.first_sequence();
  const auto count = static_cast<int64_t>(last.digests().size() / kDigestBytes);
  if (index < 0 || index >= count || unpacked.digest.empty()) return false;
  return last.digests().compare(static_cast<size_t>(index) * kDigestBytes, kDigestBytes,
                                unpacked.digest) == 0;
}

absl::Status CheckTotal(const v1::UploadTotal& total, const std::string& field,
                        const contract::Limits& limits, bool of_file) {
  contract::Violations violations;
  // How large a file may be is said with another reason, when it is announced.
  if (of_file && total.encoded_size_bytes() < 1) {
    violations.Add(field + ".encoded_size_bytes", "the file is empty");
  } else if (!of_file && (total.encoded_size_bytes() < 1 ||
                          total.encoded_size_bytes() > limits.encoded_scan_bytes)) {
    violations.Add(field + ".encoded_size_bytes",
                   absl::StrCat("is ", total.encoded_size_bytes(), " bytes, must be 1 to ",
                                limits.encoded_scan_bytes, "; thin the scan"));
  }
  if (total.sha256().size() != 32) {
    violations.Add(field + ".sha256",
                   absl::StrCat("has ", total.sha256().size(), " bytes, must have 32"));
  }
  return violations.ToStatus();
}

Upload::Upload(v1::Upload created, store::Store& store, const contract::Limits& limits,
               std::shared_ptr<AccountShare> account, int64_t reserved, absl::Duration seen)
    : store_(store),
      limits_(limits),
      account_(std::move(account)),
      upload_(std::move(created)),
      reserved_(reserved),
      decoder_(Decoder()),
      last_piece_(seen) {
  created_with_total_ = upload_.has_total();
}

absl::Status Upload::Resume(const Moment& now) {
  std::lock_guard<std::mutex> lock(mutex_);
  last_piece_ = now.seen;
  *upload_.mutable_expire_time() = conversion::WriteTime(now.time + limits_.upload_idle);
  loaded_ = false;
  return CheckWhole();
}

absl::Status Upload::Check() {
  std::lock_guard<std::mutex> lock(mutex_);
  return CheckWhole();
}

absl::Status Upload::CheckWhole() {
  if (!loaded_) {
    if (absl::Status taken = Load(); !taken.ok()) return taken;
    // Writes what the system had not written when the server was killed.
    if (records_ > 0) {
      if (absl::Status synced = store_.SyncSpool(upload_.name()); !synced.ok()) return synced;
    }
    durable_records_ = records_;
    durable_pieces_ = pieces_.size();
    loaded_ = true;
    // What arrived before the restart is kept, whatever the quota is now.
    const int64_t there = std::max(upload_.total().encoded_size_bytes(), Received());
    if (account_ != nullptr && there > reserved_) {
      account_->Add(there - reserved_);
      reserved_ = there;
    }
  }
  if (broken_) {
    // After a failed sync it is unknown what of the file is on the medium. What was durable before
    // is read again; the rest has to be sent again.
    absl::Status whole = store_.CutSpool(upload_.name(), durable_records_);
    if (whole.ok()) whole = Load();
    if (!whole.ok()) return whole;
    broken_ = false;
  }
  return absl::OkStatus();
}

absl::Status Upload::Sync() {
  std::lock_guard<std::mutex> one(sync_mutex_);
  size_t records = 0;
  size_t pieces = 0;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (absl::Status whole = CheckWhole(); !whole.ok()) return whole;
    if (upload_.state() != v1::UPLOAD_STATE_OPEN) return absl::OkStatus();
    records = records_;
    pieces = pieces_.size();
    if (records == durable_records_) return absl::OkStatus();
  }
  absl::Status synced = store_.SyncSpool(upload_.name());
  std::lock_guard<std::mutex> lock(mutex_);
  if (upload_.state() != v1::UPLOAD_STATE_OPEN) return absl::OkStatus();
  if (!synced.ok()) {
    broken_ = true;
    CheckWhole().IgnoreError();
    return synced;
  }
  durable_records_ = records;
  durable_pieces_ = pieces;
  return absl::OkStatus();
}

sensor::RangeImageDecoder Upload::Decoder() const {
  return sensor::RangeImageDecoder(limits_.scan_cells, sensor::RangeImageDecoder::Keep::kNothing);
}

int64_t Upload::Unsynced() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return Received() - Durable();
}

bool Upload::WindowFull() const {
  std::lock_guard<std::mutex> lock(mutex_);
  if (pieces_.size() == durable_pieces_) return false;
  const int64_t kept_durable = durable_pieces_ == 0 ? 0 : pieces_[durable_pieces_ - 1].kept_end;
  return pieces_.back().kept_end - kept_durable >= kWindowBytes ||
         Received() - Durable() >= limits_.credit_bytes / 2;
}

// Reads the whole spool.
absl::Status Upload::Load() {
  std::vector<Stored> pieces;
  bytes::Sha256 sha256;
  size_t records = 0;
  v1::Upload upload = upload_;
  if (!created_with_total_) upload.clear_total();
  int64_t offset = 0;
  sensor::RangeImageDecoder decoder = Decoder();
  absl::Status read = store_.ReadSpool(upload_.name(), [&](absl::string_view record) {
    absl::StatusOr<storage::v1::SpoolRecord> kept = store::ParseSpoolRecord(record);
    if (!kept.ok()) return kept.status();
    ++records;
    if (kept->has_total()) {
      *upload.mutable_total() = kept->total();
      return absl::OkStatus();
    }
    const auto kept_size = static_cast<int64_t>(record.size());
    const absl::StatusOr<std::string> bytes = store::PieceBytes(std::move(*kept->mutable_piece()));
    if (!bytes.ok()) return bytes.status();
    const int64_t kept_before = pieces.empty() ? 0 : pieces.back().kept_end;
    pieces.push_back({offset, static_cast<int64_t>(bytes->size()), DigestOf(offset, *bytes),
                      kept_before + kept_size});
    offset += pieces.back().size;
    sha256.Update(*bytes);
    // The decoder keeps the error.
    if (!upload.has_file()) decoder.Take(*bytes).IgnoreError();
    return absl::OkStatus();
  });
  if (!read.ok()) return read;
  upload_ = std::move(upload);
  pieces_ = std::move(pieces);
  sha256_ = std::move(sha256);
  decoder_ = std::move(decoder);
  records_ = records;
  // Fewer bytes than were synced: the medium lost some, and the client has to send them again.
  durable_records_ = std::min(durable_records_, records_);
  durable_pieces_ = std::min(durable_pieces_, pieces_.size());
  return absl::OkStatus();
}

absl::Status Upload::CheckOpen() const {
  if (upload_.state() == v1::UPLOAD_STATE_OPEN) return absl::OkStatus();
  return contract::ErrorWithReason(
      StatusCode::kFailedPrecondition, "UPLOAD_ENDED",
      absl::StrCat(upload_.name(), " is ", v1::UploadState_Name(upload_.state()),
                   upload_.scan().empty() ? absl::StrCat(": ", upload_.state_message())
                                          : absl::StrCat(": it became ", upload_.scan())),
      {{"state", v1::UploadState_Name(upload_.state())}, {"scan", upload_.scan()}});
}

int64_t Upload::Received() const {
  return pieces_.empty() ? 0 : pieces_.back().offset + pieces_.back().size;
}

int64_t Upload::Durable() const {
  if (durable_pieces_ == 0) return 0;
  const Stored& last = pieces_[durable_pieces_ - 1];
  return last.offset + last.size;
}

absl::Status Upload::Accept(const UnpackedPiece& unpacked, const Moment& now) {
  const auto& [piece, bytes, digest] = unpacked;
  if (!bytes.ok()) return bytes.status();
  Stored stored{piece.offset(), static_cast<int64_t>(bytes->size()), digest, 0};

  std::lock_guard<std::mutex> lock(mutex_);
  if (absl::Status whole = CheckWhole(); !whole.ok()) return whole;
  const auto count = static_cast<int64_t>(pieces_.size());
  if (piece.sequence() < count) {
    const Stored& known = pieces_[static_cast<size_t>(piece.sequence())];
    if (known.digest == stored.digest) return absl::OkStatus();
    if (absl::Status open = CheckOpen(); !open.ok()) return open;
    return contract::ErrorWithReason(
        StatusCode::kAlreadyExists, "PIECE_DIFFERS",
        absl::StrCat("piece ", piece.sequence(), " is stored with offset ", known.offset, ", ",
                     known.size,
                     " bytes and another content or place; start a new "
                     "upload for another scan"));
  }
  absl::Status open = CheckOpen();
  if (!open.ok()) return open;
  if (piece.sequence() > count || stored.offset != Received()) {
    absl::Status gap = contract::ErrorWithReason(
        StatusCode::kOutOfRange, "UPLOAD_GAP",
        absl::StrCat("piece ", count, " at offset ", Received(), " comes next, not piece ",
                     piece.sequence(), " at offset ", piece.offset()));
    v1::ExpectedPiece expected;
    expected.set_sequence(static_cast<int64_t>(count));
    expected.set_offset(Received());
    contract::AddDetail(gap, expected);
    return gap;
  }
  const int64_t end = stored.offset + stored.size;
  const int64_t most = MostBytes();
  if (end > most) {
    return contract::InvalidField("piece.data",
                                  absl::StrCat("ends at ", end, ", beyond the ", most,
                                               upload_.has_total() ? " announced" : " allowed"));
  }
  if (pieces_.size() >= limits_.pieces_per_upload) {
    return contract::ErrorWithReason(
        StatusCode::kResourceExhausted, "TOO_MANY_PIECES",
        absl::StrCat("an upload has at most ", limits_.pieces_per_upload,
                     " pieces; send larger ones"));
  }
  if (absl::Status room = Reserve(end); !room.ok()) return room;
  storage::v1::SpoolRecord record;
  record.mutable_piece()->set_crc32c(piece.crc32c());
  // A compressed frame longer than its piece is not stored as it is, so that no more is stored than
  // the account is charged for.
  if (piece.compression() == v1::COMPRESSION_ZSTD && piece.data().size() < bytes->size()) {
    record.mutable_piece()->set_compression(v1::COMPRESSION_ZSTD);
    record.mutable_piece()->set_uncompressed_size_bytes(stored.size);
    record.mutable_piece()->set_data(piece.data());
  } else {
    record.mutable_piece()->set_data(*bytes);
  }
  const std::string serialized = record.SerializeAsString();
  absl::Status kept = store_.AppendSpool(upload_.name(), serialized);
  if (!kept.ok()) return kept;
  sha256_.Update(*bytes);
  if (!upload_.has_file()) decoder_.Take(*bytes).IgnoreError();  // stays with it
  Use(static_cast<int64_t>(serialized.size()));
  stored.kept_end =
      (pieces_.empty() ? 0 : pieces_.back().kept_end) + static_cast<int64_t>(serialized.size());
  pieces_.push_back(stored);
  ++records_;
  last_piece_ = now.seen;
  *upload_.mutable_expire_time() = conversion::WriteTime(now.time + limits_.upload_idle);
  return absl::OkStatus();
}

absl::Status Upload::SetTotal(const v1::UploadTotal& total) {
  std::lock_guard<std::mutex> lock(mutex_);
  absl::Status valid = CheckTotal(total, "total", limits_, upload_.has_file());
  if (!valid.ok()) return valid;
  if (absl::Status whole = CheckWhole(); !whole.ok()) return whole;
  if (upload_.has_total()) {
    if (upload_.total().encoded_size_bytes() == total.encoded_size_bytes() &&
        upload_.total().sha256() == total.sha256()) {
      return absl::OkStatus();
    }
    if (absl::Status open = CheckOpen(); !open.ok()) return open;
    return contract::ErrorWithReason(
        StatusCode::kAlreadyExists, "TOTAL_DIFFERS",
        absl::StrCat(upload_.name(), " was announced with another total"));
  }
  absl::Status open = CheckOpen();
  if (!open.ok()) return open;
  if (total.encoded_size_bytes() < Received()) {
    return contract::InvalidField("total.encoded_size_bytes",
                                  absl::StrCat("is ", total.encoded_size_bytes(), ", ", Received(),
                                               " bytes are here already"));
  }
  if (absl::Status room = Reserve(total.encoded_size_bytes()); !room.ok()) return room;
  storage::v1::SpoolRecord record;
  *record.mutable_total() = total;
  absl::Status kept = store_.AppendSpool(upload_.name(), record.SerializeAsString());
  if (!kept.ok()) return kept;
  ++records_;
  *upload_.mutable_total() = total;
  return absl::OkStatus();
}

// Reserves room for this many bytes in all.
absl::Status Upload::Reserve(int64_t bytes) {
  if (account_ == nullptr || bytes <= reserved_) return absl::OkStatus();
  absl::Status taken = account_->Reserve(bytes - reserved_);
  if (taken.ok()) reserved_ = bytes;
  return taken;
}

bool Upload::Complete() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return loaded_ && !broken_ && upload_.state() == v1::UPLOAD_STATE_OPEN && upload_.has_total() &&
         Received() == upload_.total().encoded_size_bytes();
}

absl::StatusOr<Upload::Content> Upload::Inspect() {
  std::lock_guard<std::mutex> lock(mutex_);
  Content content;
  content.sha256 = sha256_.Digest();
  if (content.sha256 != upload_.total().sha256()) {
    return contract::ErrorWithReason(
        StatusCode::kDataLoss, "SHA256_DIFFERS",
        "the SHA-256 of the bytes is not the one announced; start a new upload");
  }
  content.encoded_size = Received();
  if (upload_.has_file()) return content;
  const auto image = decoder_.Finish();
  if (!image.ok()) {
    return contract::InvalidField("encoded range image", image.status().message());
  }
  content.columns = image->columns;
  content.rows = image->rows;
  content.samples = image->samples;
  content.appearance = image->appearance;
  return content;
}

absl::Status Upload::CheckContent() const {
  std::lock_guard<std::mutex> lock(mutex_);
  if (decoder_.status().ok()) return absl::OkStatus();
  return contract::InvalidField("encoded range image", decoder_.status().message());
}

storage::v1::LastPieces Upload::LastPieces() const {
  std::lock_guard<std::mutex> lock(mutex_);
  const int64_t from = Received() - limits_.credit_bytes;
  size_t first = pieces_.size() - std::min(pieces_.size(), kMaxLastPieces);
  while (first < pieces_.size() && pieces_[first].offset < from) ++first;
  storage::v1::LastPieces last;
  last.set_first_sequence(static_cast<int64_t>(first));
  for (size_t i = first; i < pieces_.size(); ++i) last.mutable_digests()->append(pieces_[i].digest);
  return last;
}

void Upload::End(v1::UploadState state, const std::string& message, const std::string& scan,
                 const absl::Status& why) {
  std::lock_guard<std::mutex> lock(mutex_);
  upload_.set_state(state);
  upload_.set_state_message(message);
  if (!upload_.has_file()) upload_.set_scan(scan);
  upload_.set_state_reason(contract::ReasonOf(why));
  upload_.set_state_code(static_cast<int32_t>(why.code()));
  if (upload_.has_file()) upload_.clear_read_size_bytes();
  const bool to_the_scan = state == v1::UPLOAD_STATE_COMMITTED && !upload_.has_file();
  if (account_ != nullptr && !to_the_scan) account_->GiveBack(reserved_);
  reserved_ = 0;
  Use(promised_);
  // An error of the spool does not change the answer.
  store_.DropSpool(upload_.name()).IgnoreError();
}

bool Upload::Idle(absl::Duration now) const {
  std::lock_guard<std::mutex> lock(mutex_);
  const bool waits =
      upload_.state() == v1::UPLOAD_STATE_OPEN || upload_.state() == v1::UPLOAD_STATE_READING;
  return waits && now - last_piece_ > limits_.upload_idle;
}

bool Upload::OfFile() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return upload_.has_file();
}

void Upload::BeginReading() {
  std::lock_guard<std::mutex> lock(mutex_);
  upload_.set_state(v1::UPLOAD_STATE_READING);
}

bool Upload::Reading() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return upload_.state() == v1::UPLOAD_STATE_READING;
}

void Upload::SetReading(int32_t setups, int64_t read_bytes, const std::string& waits_for) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (upload_.state() != v1::UPLOAD_STATE_READING) return;
  if (setups > 0) upload_.set_setup_count(setups);
  upload_.set_read_size_bytes(read_bytes);
  upload_.set_state_message(waits_for);
}

absl::Status Upload::TakeRoomForScan(int64_t bytes) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (absl::Status room = Reserve(bytes); !room.ok()) return room;
  reserved_ = std::max<int64_t>(0, reserved_ - bytes);
  return absl::OkStatus();
}

void Upload::ScanReceived(const std::string& scan, const Moment& now) {
  std::lock_guard<std::mutex> lock(mutex_);
  upload_.add_scans(scan);
  if (upload_.scan().empty()) upload_.set_scan(scan);
  last_piece_ = now.seen;
  *upload_.mutable_expire_time() = conversion::WriteTime(now.time + limits_.upload_idle);
}

void Upload::GiveBackRoomOfScan(int64_t bytes) {
  std::lock_guard<std::mutex> lock(mutex_);
  reserved_ += bytes;
}

void Upload::Promise(int64_t bytes, std::function<void(int64_t)> used) {
  std::lock_guard<std::mutex> lock(mutex_);
  promised_ = bytes;
  used_ = std::move(used);
}

void Upload::Use(int64_t bytes) {
  const int64_t of_promise = std::min(bytes, promised_);
  promised_ -= of_promise;
  if (used_ && of_promise > 0) used_(of_promise);
}

int64_t Upload::MostBytes() const {
  if (upload_.has_total()) return upload_.total().encoded_size_bytes();
  return upload_.has_file() ? limits_.file_bytes : limits_.encoded_scan_bytes;
}

absl::Duration Upload::LastPiece() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return last_piece_;
}

v1::Upload Upload::Describe() const {
  std::lock_guard<std::mutex> lock(mutex_);
  v1::Upload out = upload_;
  out.set_next_sequence(static_cast<int64_t>(durable_pieces_));
  out.set_next_offset(Durable());
  out.set_credit_offset(Durable() + limits_.credit_bytes);
  out.set_max_piece_size_bytes(limits_.piece_bytes);
  // After a restart nothing of what is only read is loaded.
  if (upload_.state() == v1::UPLOAD_STATE_READING) {
    out.set_next_offset(upload_.total().encoded_size_bytes());
    out.set_credit_offset(out.next_offset());
  }
  return out;
}

}  // namespace vantage::session

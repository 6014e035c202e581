// Sending a scan: pieces under the server's credit, resumed after every break.
#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "client/library/client.h"
#include "client/library/piece.h"
#include "client/library/resumption.h"
#include "client/library/wire.h"
#include "core/bytes/checksum.h"
#include "core/sensor/encoding.h"

namespace vantage::client {
namespace {

// Large enough to compress well, small enough to lose little when a link breaks.
constexpr int64_t kPieceBytes = 256 << 10;
// The server speaks at least every 5 s: a link silent for longer than this is dead.
constexpr double kSilenceSeconds = 9;
// How often one asks how far the server has read a file.
constexpr double kLookSeconds = 0.5;

using UploadStream = grpc::ClientReaderWriter<v1::UploadScanRequest, v1::UploadScanResponse>;

// The server's answers so far, shared between the thread that reads and the one that writes.
class Acknowledged {
 public:
  struct Snapshot {
    int64_t stored = 0;  // every byte before this offset
    int64_t credit = 0;  // may be sent up to here
    v1::UploadState state = v1::UPLOAD_STATE_OPEN;
    std::string message;
    std::string scan;
    bool ended = false;   // the stream has ended
    bool silent = false;  // nothing was heard for too long
  };

  Acknowledged(int64_t stored, int64_t credit) {
    now_.stored = stored;
    now_.credit = credit;
  }

  void Hear(const v1::UploadScanResponse& response) {
    const std::lock_guard lock(mutex_);
    now_.stored = std::max(now_.stored, response.next_offset());
    now_.credit = std::max(now_.credit, response.credit_offset());
    if (response.state() != v1::UPLOAD_STATE_UNSPECIFIED) now_.state = response.state();
    now_.message = response.state_message();
    now_.scan = response.scan();
    heard_ = SteadyClock::now();
    changed_.notify_all();
  }

  void End() {
    const std::lock_guard lock(mutex_);
    now_.ended = true;
    changed_.notify_all();
  }

  // Waits until `ready` accepts the server's answers, or the stream ends or falls silent.
  template <typename Ready>
  Snapshot Wait(Ready&& ready) {
    std::unique_lock lock(mutex_);
    while (!now_.ended && !ready(now_)) {
      const auto silent_at = heard_ + std::chrono::duration_cast<SteadyClock::duration>(
                                          std::chrono::duration<double>(kSilenceSeconds));
      if (changed_.wait_until(lock, silent_at) == std::cv_status::timeout &&
          SteadyClock::now() >= silent_at) {
        now_.silent = true;
        break;
      }
    }
    return now_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  Snapshot now_;                                        // guarded by mutex_
  SteadyClock::time_point heard_ = SteadyClock::now();  // guarded by mutex_
};

// Sends what the server lacks over one stream.
class StreamAttempt {
 public:
  StreamAttempt(std::unique_ptr<grpc::ClientContext> context, v1::ScanService::Stub& stub,
                const v1::Upload& upload, absl::string_view bytes, UploadProgress& progress,
                absl::FunctionRef<void(const UploadProgress&)> on_progress)
      : upload_(upload),
        bytes_(bytes),
        piece_bytes_(upload.max_piece_size_bytes() > 0
                         ? std::min(kPieceBytes, upload.max_piece_size_bytes())
                         : kPieceBytes),
        progress_(progress),
        on_progress_(on_progress),
        acknowledged_(upload.next_offset(), upload.credit_offset()),
        context_(std::move(context)),
        stream_(stub.UploadScan(context_.get())) {}

  // Returns how the stream ended; `outcome` is the server's last answer.
  grpc::Status Run(Acknowledged::Snapshot& outcome) {
    std::thread reader([this] {
      v1::UploadScanResponse response;
      while (stream_->Read(&response)) acknowledged_.Hear(response);
      acknowledged_.End();
    });
    SendPieces();
    // The final answer comes after the last piece: committed, or not what was announced.
    outcome = WaitFor(
        [](const Acknowledged::Snapshot& now) { return now.state != v1::UPLOAD_STATE_OPEN; });
    if (outcome.silent) context_->TryCancel();
    stream_->WritesDone();
    reader.join();
    grpc::Status status = stream_->Finish();
    outcome = acknowledged_.Wait([](const auto&) { return true; });
    return status;
  }

 private:
  template <typename Ready>
  Acknowledged::Snapshot WaitFor(Ready&& ready) {
    while (true) {
      const int64_t reported = progress_.acknowledged_bytes;
      Acknowledged::Snapshot now = acknowledged_.Wait(
          [&](const Acknowledged::Snapshot& s) { return ready(s) || s.stored > reported; });
      if (now.stored > reported) {
        progress_.acknowledged_bytes = now.stored;
        on_progress_(progress_);
      }
      if (now.ended || now.silent || ready(now)) return now;
    }
  }

  void SendPieces() {
    int64_t sequence = upload_.next_sequence();
    int64_t offset = upload_.next_offset();
    const auto total = static_cast<int64_t>(bytes_.size());
    bool first = true;
    do {
      const int64_t wanted = std::min(piece_bytes_, total - offset);
      // A short piece is sent only when no acknowledgement is on its way that would bring more
      // credit.
      const Acknowledged::Snapshot now = WaitFor([&](const Acknowledged::Snapshot& s) {
        return s.state != v1::UPLOAD_STATE_OPEN || s.credit - offset >= wanted ||
               (s.credit > offset && s.stored >= offset);
      });
      if (now.ended || now.silent || now.state != v1::UPLOAD_STATE_OPEN) return;
      v1::UploadScanRequest request;
      if (first) request.set_upload(upload_.name());
      first = false;
      const int64_t size = std::min(wanted, now.credit - offset);
      if (size > 0) {
        *request.mutable_piece() = MakePiece(bytes_.substr(offset, size), sequence, offset);
        progress_.sent_bytes += static_cast<int64_t>(request.piece().data().size());
      }
      if (!stream_->Write(request)) return;
      ++sequence;
      offset += size;
    } while (offset < total);
  }

  const v1::Upload& upload_;
  absl::string_view bytes_;
  int64_t piece_bytes_;
  UploadProgress& progress_;
  absl::FunctionRef<void(const UploadProgress&)> on_progress_;
  Acknowledged acknowledged_;
  const std::unique_ptr<grpc::ClientContext> context_;
  std::unique_ptr<UploadStream> stream_;
};

// Faults of one stream that leave the upload as it is.
bool EndsOnlyTheStream(const absl::Status& status) {
  return absl::IsUnavailable(status) || absl::IsOutOfRange(status) || absl::IsDataLoss(status) ||
         absl::IsCancelled(status) || absl::IsInternal(status);
}

absl::Status UploadFailed(const v1::Upload& upload) {
  return WithFix(absl::FailedPreconditionError(
                     absl::StrCat("the server refused the scan: ", upload.state_message())),
                 "push the scan again; if it is refused again, the file or its import is at fault");
}

// The server's words name the file, and what helps.
absl::Status FileRefused(const v1::Upload& upload) {
  return absl::FailedPreconditionError(upload.state_message().empty()
                                           ? "the server took no scan from the file"
                                           : upload.state_message());
}

// True when the scan has to be sent once more, since the upload or the scan that it became is gone.
absl::StatusOr<bool> MayComeAgain(Client& client, const v1::Upload& upload) {
  if (upload.state() == v1::UPLOAD_STATE_OPEN || upload.state() == v1::UPLOAD_STATE_READING) {
    return false;
  }
  if (upload.state() != v1::UPLOAD_STATE_COMMITTED) return true;
  // Those of a file are all in the list, the one of a range image is not.
  std::vector<std::string> scans(upload.scans().begin(), upload.scans().end());
  if (scans.empty()) scans.push_back(upload.scan());
  for (const std::string& name : scans) {
    v1::GetScanRequest get;
    get.set_name(name);
    const auto scan = client.Call(get);
    if (!scan.ok()) return scan.status();
    if (scan->scan().state() != v1::SCAN_STATE_WITHDRAWN) return false;
  }
  return true;
}

// The upload is named by its content. So the same scan for the same session is the same upload,
// however often its sender starts anew: it continues where it was, and arrives once.
absl::StatusOr<v1::Upload> BeginOrFind(Client& client, v1::CreateUploadRequest create) {
  constexpr int kMostTimes = 1000;
  const std::string content =
      absl::BytesToHexString(bytes::Sha256::Of(create.SerializeAsString()).substr(0, 16));
  for (int times = 0; times < kMostTimes; ++times) {
    create.set_request_id(absl::StrCat("scan-", content, "-", times));
    auto created = client.Call(create);
    if (!created.ok()) return created.status();
    const auto again = MayComeAgain(client, created->upload());
    if (!again.ok()) return again.status();
    if (!*again) return std::move(*created->mutable_upload());
  }
  return absl::ResourceExhaustedError(
      absl::StrCat("this scan was sent and withdrawn ", kMostTimes, " times"));
}

}  // namespace

absl::StatusOr<std::string> Client::Upload(
    const std::string& session, v1::Upload upload, const sensor::RangeImage& image,
    absl::FunctionRef<void(const UploadProgress&)> on_progress) {
  if (absl::Status valid = image.Validate(); !valid.ok()) return valid;
  const auto sent = Send(session, std::move(upload), sensor::EncodeRangeImage(image), on_progress);
  if (!sent.ok()) return sent.status();
  return sent->scan();
}

absl::StatusOr<v1::Upload> Client::UploadFile(
    const std::string& session, v1::Upload upload, absl::string_view bytes,
    absl::FunctionRef<void(const UploadProgress&)> on_progress,
    absl::FunctionRef<void(const v1::Upload&)> reading) {
  absl::StatusOr<v1::Upload> state = Send(session, std::move(upload), bytes, on_progress);
  Resumption resumption(*wire_);
  while (state.ok() && state->state() == v1::UPLOAD_STATE_READING) {
    reading(*state);
    SleepSeconds(kLookSeconds);
    v1::GetUploadRequest get;
    get.set_name(state->name());
    auto now = Call(get);
    if (now.ok()) {
      resumption.Progress();
      *state = std::move(*now->mutable_upload());
    } else if (absl::Status resumed = resumption.AfterBreak(now.status()); !resumed.ok()) {
      return resumed;
    }
  }
  if (state.ok() && state->state() != v1::UPLOAD_STATE_COMMITTED) return FileRefused(*state);
  return state;
}

absl::StatusOr<v1::Upload> Client::Send(
    const std::string& session, v1::Upload upload, absl::string_view bytes,
    absl::FunctionRef<void(const UploadProgress&)> on_progress) {
  upload.mutable_total()->set_encoded_size_bytes(static_cast<int64_t>(bytes.size()));
  upload.mutable_total()->set_sha256(bytes::Sha256::Of(bytes));
  v1::CreateUploadRequest create;
  create.set_parent(session);
  const bool upload_has_file = upload.has_file();
  *create.mutable_upload() = std::move(upload);

  UploadProgress progress;
  progress.total_bytes = static_cast<int64_t>(bytes.size());
  Resumption resumption(*wire_);
  auto begun = BeginOrFind(*this, create);
  while (!begun.ok()) {
    if (IsTransient(begun.status())) {
      ++progress.reconnects;
      on_progress(progress);
    }
    if (absl::Status resumed = resumption.AfterBreak(begun.status()); !resumed.ok()) {
      return resumed;
    }
    begun = BeginOrFind(*this, create);
  }
  v1::Upload state = *std::move(begun);
  while (true) {
    if (state.state() == v1::UPLOAD_STATE_COMMITTED || state.state() == v1::UPLOAD_STATE_READING) {
      progress.acknowledged_bytes = progress.total_bytes;
      progress.committed = true;
      on_progress(progress);
      return state;
    }
    if (upload_has_file && state.state() == v1::UPLOAD_STATE_FAILED) return state;
    if (state.state() != v1::UPLOAD_STATE_OPEN) return UploadFailed(state);

    const int64_t before = state.next_offset();
    Acknowledged::Snapshot outcome;
    auto context = std::make_unique<grpc::ClientContext>();
    if (absl::Status prepared = wire_->Prepare(*context); !prepared.ok()) return prepared;
    StreamAttempt attempt(std::move(context), *wire_->scans, state, bytes, progress, on_progress);
    const grpc::Status ended = attempt.Run(outcome);
    if (outcome.stored > before) resumption.Progress();
    if (outcome.state == v1::UPLOAD_STATE_OPEN) {
      ++progress.reconnects;
      absl::Status failure = ended.ok() ? absl::UnavailableError("the server closed the stream")
                                        : wire_->Failure(ended);
      if (EndsOnlyTheStream(failure) && !IsTransient(failure)) {
        failure = absl::UnavailableError(failure.message());
      }
      if (absl::Status resumed = resumption.AfterBreak(failure); !resumed.ok()) return resumed;
    }
    v1::GetUploadRequest get;
    get.set_name(state.name());
    auto where = Call(get);
    while (!where.ok()) {
      if (absl::Status resumed = resumption.AfterBreak(where.status()); !resumed.ok()) {
        return resumed;
      }
      where = Call(get);
    }
    state = std::move(*where->mutable_upload());
  }
}

}  // namespace vantage::client

#include "server/session/uploads.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "server/contract/error.h"
#include "server/contract/resource_names.h"
#include "server/conversion/from_proto.h"
#include "server/conversion/to_proto.h"
#include "server/session/file_allowance.h"
#include "server/session/list_filter.h"
#include "server/session/session_origin.h"

namespace vantage::session {
namespace {

constexpr char kUploadType[] = "vantage/Upload";
constexpr absl::Duration kRetryUploadAfter = absl::Seconds(2);
// After so long without a piece, an upload gives way to a new one: where nothing was sent of it,
// and where something was.
constexpr absl::Duration kEmptyGivesWay = absl::Minutes(1);
constexpr absl::Duration kIdleGivesWay = absl::Minutes(10);

// Completes the scanner that an upload or a plan names. INVALID_ARGUMENT: it is unknown or
// impossible.
absl::StatusOr<v1::ScannerModel> ScannerOf(const SessionState& state, const v1::Upload& upload) {
  if (upload.has_scanner_model()) {
    v1::ScannerModel scanner = upload.scanner_model();
    conversion::FillDefaults(scanner);
    return scanner;
  }
  std::string id = upload.scanner_model_id();
  const auto named = state.scanners.find(upload.scanner());
  if (id.empty() && named != state.scanners.end()) id = named->second.scanner_model_id();
  for (const v1::ScannerModel& scanner : state.session.scanner_models()) {
    if (id.empty() || scanner.id() == id) return scanner;
  }
  return contract::InvalidField(
      "upload.scanner_model_id",
      absl::StrCat("'", upload.scanner_model_id(), "' is none of the session's scanner models"));
}

}  // namespace

std::shared_ptr<Upload> HeldUpload::Open() const {
  if (open_ == nullptr) return uploads_->FindOpen(name_);
  return open_->let_go() ? nullptr : open_;
}

absl::StatusOr<v1::Upload> HeldUpload::Take(const UnpackedPiece* piece,
                                            const v1::UploadTotal* total) {
  return uploads_->Take(name_, Open(), piece, total);
}

absl::StatusOr<v1::Upload> HeldUpload::Sync() { return uploads_->Sync(name_, Open()); }

int64_t HeldUpload::UnsyncedBytes() const {
  const std::shared_ptr<Upload> open = Open();
  return open == nullptr ? 0 : open->Unsynced();
}

bool HeldUpload::WindowFull() const {
  const std::shared_ptr<Upload> open = Open();
  return open != nullptr && open->WindowFull();
}

Uploads::Uploads(SessionContext& context, ScanReconciler& reconciler)
    : context_(context),
      journal_(context.journal()),
      dependencies_(context.dependencies()),
      reconciler_(reconciler),
      intake_(context),
      work_(context) {}

absl::StatusOr<v1::Upload> Uploads::Create(const v1::CreateUploadRequest& request) {
  while (true) {
    absl::StatusOr<v1::Upload> created = CreateNow(request);
    const std::string reason = contract::ReasonOf(created.status());
    const bool no_room = reason == "TOO_MANY_UPLOADS" || reason == "QUOTA_EXCEEDED";
    if (!no_room || !MakeWay()) return created;
  }
}

bool Uploads::MakeWay() {
  std::shared_ptr<Upload> idle;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    const auto now = journal_.Seen();
    for (const auto& [name, upload] : open_) {
      if (upload->Reading()) continue;
      const bool empty = upload->Describe().next_sequence() == 0;
      if (now - upload->LastPiece() < (empty ? kEmptyGivesWay : kIdleGivesWay)) continue;
      if (idle == nullptr || upload->LastPiece() < idle->LastPiece()) idle = upload;
    }
    if (idle == nullptr) return false;
    idle->LetGo();
    open_.erase(idle->Describe().name());
  }
  EndIdle({idle}, "no piece came for a while, and another upload needed its place");
  return true;
}

absl::StatusOr<v1::Upload> Uploads::CreateNow(const v1::CreateUploadRequest& request) {
  const v1::Upload& asked = request.upload();
  Expire();

  int64_t reserved = 0;
  int64_t promised = 0;
  absl::StatusOr<std::string> name = journal_.Execute(
      RequestKey::Of(request.request_id(), "CreateUpload", request),
      [&](const SessionState& state) -> absl::StatusOr<Draft> {
        if (absl::Status room = context_.CheckLog(); !room.ok()) return room;
        {
          std::lock_guard<std::mutex> lock(mutex_);
          if (open_.size() >= dependencies_.limits.open_uploads_per_session) {
            return contract::Retryable(
                absl::StatusCode::kResourceExhausted, "TOO_MANY_UPLOADS",
                absl::StrCat("the session has ", open_.size(), " open uploads, the most it may"),
                kRetryUploadAfter);
          }
        }
        if (state.scans.size() >= dependencies_.limits.scans_per_session) {
          return contract::ErrorWithReason(
              absl::StatusCode::kResourceExhausted, "TOO_MANY_SCANS",
              absl::StrCat("the session has ", state.scans.size(),
                           " scans, the most it may; open another session"));
        }
        if (!asked.scanner().empty() && state.scanners.count(asked.scanner()) == 0) {
          return contract::InvalidField(
              "upload.scanner",
              absl::StrCat("'", asked.scanner(), "' is no scanner of this session"));
        }
        if (!asked.replaces().empty()) {
          if (absl::Status preview = PreviewOf(state, asked).status(); !preview.ok()) {
            return preview;
          }
        }
        // Of a file, where nobody says what made it, the scans in it do.
        const bool by_file =
            asked.has_file() && !asked.has_scanner_model() && asked.scanner_model_id().empty();
        absl::StatusOr<v1::ScannerModel> scanner =
            by_file ? v1::ScannerModel() : ScannerOf(state, asked);
        if (!scanner.ok()) return scanner.status();
        const int64_t bytes = asked.total().encoded_size_bytes();
        if (asked.has_file()) {
          if (absl::Status fits = CheckFile(bytes); !fits.ok()) return fits;
        }
        // The whole size is reserved, so that an accepted upload can be completed.
        absl::Status room = context_.account()->Reserve(asked.total().encoded_size_bytes());
        if (!room.ok()) return room;
        reserved = asked.total().encoded_size_bytes();
        if (asked.has_file()) {
          // The file, and as much again while it is read.
          const absl::Status disk = dependencies_.files->Promise(
              2 * bytes, [&] { return dependencies_.store.FreeBytes(); });
          if (!disk.ok()) return disk;
          promised = 2 * bytes;
        }
        Draft draft;
        v1::Upload& upload = *draft.event.mutable_upload_created()->mutable_upload();
        upload.set_name(contract::ChildName(context_.id(), "uploads",
                                            absl::StrCat("upload-", state.upload_count + 1)));
        upload.set_display_name(asked.display_name());
        upload.set_scanner_model_id(scanner->id());
        upload.set_scanner(asked.scanner());
        if (!by_file) *upload.mutable_scanner_model() = *scanner;
        if (asked.has_file()) *upload.mutable_file() = asked.file();
        if (asked.has_prior()) *upload.mutable_prior() = asked.prior();
        *upload.mutable_targets() = asked.targets();
        if (asked.has_total()) *upload.mutable_total() = asked.total();
        upload.set_preview(asked.preview());
        upload.set_replaces(asked.replaces());
        upload.set_state(v1::UPLOAD_STATE_OPEN);
        const absl::Time now = journal_.Now();
        *upload.mutable_create_time() = conversion::WriteTime(now);
        *upload.mutable_expire_time() =
            conversion::WriteTime(now + dependencies_.limits.upload_idle);
        return draft;
      });
  if (!name.ok()) {
    context_.account()->GiveBack(reserved);
    if (promised > 0) dependencies_.files->Use(promised);
    return name.status();
  }
  {
    // A repeated request finds the upload in the map, or ended.
    v1::Upload created;
    journal_.Read([&](const SessionState& state) {
      const auto it = state.uploads.find(*name);
      if (it != state.uploads.end()) created = it->second;  // else it ended long ago
    });
    std::lock_guard<std::mutex> lock(mutex_);
    if (created.state() == v1::UPLOAD_STATE_OPEN && open_.count(*name) == 0) {
      auto upload = std::make_shared<Upload>(created, dependencies_.store, dependencies_.limits,
                                             context_.account(), reserved, journal_.Seen());
      if (promised > 0) {
        upload->Promise(promised,
                        [files = dependencies_.files](int64_t bytes) { files->Use(bytes); });
      }
      open_[*name] = std::move(upload);
    }
  }
  return Get(*name);
}

absl::Status Uploads::CheckFile(int64_t bytes) {
  const auto gibibytes = [](int64_t n) {
    return absl::StrFormat("%.2f GiB", static_cast<double>(n) / (1 << 30));
  };
  const contract::Limits& limits = dependencies_.limits;
  if (dependencies_.files == nullptr) {
    return absl::UnimplementedError("this server reads no files; send range images");
  }
  if (bytes > limits.file_bytes) {
    return contract::ErrorWithReason(
        absl::StatusCode::kResourceExhausted, "FILE_TOO_LARGE",
        absl::StrCat("the file has ", gibibytes(bytes), ", and this server reads files of up to ",
                     gibibytes(limits.file_bytes),
                     ": export each station to a file of its own, send it with 'vantage scan push' "
                     "from a computer, or have the operator raise max-file-mib"),
        {{"size_bytes", absl::StrCat(bytes)}, {"max_bytes", absl::StrCat(limits.file_bytes)}});
  }
  int64_t on_their_way = 0;
  std::lock_guard<std::mutex> lock(mutex_);
  for (const auto& [name, upload] : open_) {
    if (upload->OfFile()) on_their_way += upload->Describe().total().encoded_size_bytes();
  }
  if (bytes <= limits.file_bytes_per_session - on_their_way) return absl::OkStatus();
  return contract::Retryable(
      absl::StatusCode::kResourceExhausted, "TOO_MANY_UPLOADS",
      absl::StrCat("files of ", gibibytes(on_their_way), " are on their way in the session, ",
                   gibibytes(limits.file_bytes_per_session),
                   " may be; send this one when they have been read"),
      kRetryUploadAfter);
}

absl::StatusOr<v1::Upload> Uploads::Get(const std::string& name) {
  Expire();
  return Describe(name, FindOpen(name));
}

absl::StatusOr<std::vector<v1::Upload>> Uploads::List(const v1::ListUploadsRequest& request,
                                                      absl::string_view after, size_t limit,
                                                      bool& more) {
  Expire();
  absl::StatusOr<int64_t> last = 0;
  std::map<int64_t, v1::Upload> in_order;
  journal_.Read([&](const SessionState& state) {
    last = NumberAfter(after, state.upload_count);
    if (!last.ok()) return;
    for (const auto& [name, upload] : state.uploads) {
      const int64_t number = contract::NumberOf(name);
      if (number > *last) in_order.emplace(number, upload);
    }
  });
  if (!last.ok()) return last.status();
  std::vector<v1::Upload> uploads;
  more = false;
  for (const auto& [number, logged] : in_order) {
    // What is open has come farther than the log says.
    const absl::StatusOr<v1::Upload> described = Describe(logged.name(), FindOpen(logged.name()));
    const v1::Upload& upload = described.ok() ? *described : logged;
    if (!LetsThrough(request.states(), upload.state())) continue;
    if (uploads.size() == limit) {
      more = true;
      break;
    }
    uploads.push_back(upload);
  }
  return uploads;
}

absl::StatusOr<v1::Upload> Uploads::Abort(const std::string& name, const RequestKey& key) {
  Expire();
  if (const std::shared_ptr<Upload> open = FindOpen(name); open != nullptr) {
    std::lock_guard<std::mutex> only_one(open->commit_mutex());
    if (!open->let_go()) {
      const absl::Status ended =
          End(*open, v1::UPLOAD_STATE_ABORTED, "it was given up by its sender", key);
      if (!ended.ok()) return ended;
    }
  }
  absl::StatusOr<v1::Upload> ended = Describe(name, nullptr);
  if (!ended.ok() || ended->state() != v1::UPLOAD_STATE_COMMITTED) return ended;
  return contract::ErrorWithReason(
      absl::StatusCode::kFailedPrecondition, "UPLOAD_ENDED",
      absl::StrCat(name, " has become ", ended->scan(), "; withdraw that scan instead"),
      {{"state", v1::UploadState_Name(ended->state())}, {"scan", ended->scan()}});
}

HeldUpload Uploads::Hold(const std::string& name) { return {*this, name, FindOpen(name)}; }

absl::StatusOr<v1::Upload> Uploads::Add(const std::string& name, const v1::Piece* piece,
                                        const v1::UploadTotal* total) {
  std::optional<UnpackedPiece> unpacked;
  if (piece != nullptr) unpacked.emplace(*piece, dependencies_.limits);
  HeldUpload upload = Hold(name);
  absl::StatusOr<v1::Upload> taken =
      upload.Take(unpacked.has_value() ? &*unpacked : nullptr, total);
  if (!taken.ok() || taken->state() != v1::UPLOAD_STATE_OPEN) return taken;
  return upload.Sync();
}

std::shared_ptr<Upload> Uploads::FindOpen(const std::string& name) const {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto open = open_.find(name);
  return open == open_.end() ? nullptr : open->second;
}

absl::StatusOr<v1::Upload> Uploads::Describe(const std::string& name,
                                             const std::shared_ptr<Upload>& open) const {
  if (open != nullptr && !open->let_go()) {
    if (absl::Status known = open->Check(); !known.ok()) return known;
    return open->Describe();
  }
  absl::StatusOr<v1::Upload> ended = contract::ResourceNotFound(kUploadType, name);
  journal_.Read([&](const SessionState& state) {
    const auto it = state.uploads.find(name);
    if (it != state.uploads.end()) ended = it->second;
  });
  return ended;
}

absl::StatusOr<v1::Upload> Uploads::Take(const std::string& name,
                                         const std::shared_ptr<Upload>& open,
                                         const UnpackedPiece* piece, const v1::UploadTotal* total) {
  if (context_.closed()) return contract::ResourceNotFound(kUploadType, name);
  if (open == nullptr) {
    absl::StatusOr<v1::Upload> ended = Get(name);
    if (!ended.ok()) return ended;
    // Only the state is asked for, or a piece is sent again, since its answer was lost.
    if (piece == nullptr && total == nullptr) return ended;
    if (ended->has_file() && IsOfFile(*ended, piece, total)) return ended;
    const bool committed = ended->state() == v1::UPLOAD_STATE_COMMITTED;
    if (committed && piece != nullptr && !piece->bytes.ok()) return piece->bytes.status();
    if (committed && !ended->has_file() && IsOfScan(ended->scan(), piece, total)) return ended;
    const std::string state = v1::UploadState_Name(ended->state());
    if (!committed) {
      return contract::ErrorWithReason(
          absl::StatusCode::kFailedPrecondition, "UPLOAD_ENDED",
          absl::StrCat(name, " is ", state, ": ", ended->state_message()));
    }
    return contract::ErrorWithReason(
        absl::StatusCode::kFailedPrecondition, "UPLOAD_ENDED",
        absl::StrCat(name, " has become ", ended->scan(),
                     ", and this is no part of it; start a new upload for another scan"),
        {{"state", state}, {"scan", ended->scan()}});
  }
  if (open->Reading()) {
    v1::Upload described = open->Describe();
    if (piece != nullptr && !piece->bytes.ok()) return piece->bytes.status();
    if (IsOfFile(described, piece, total)) return described;
    return contract::ErrorWithReason(
        absl::StatusCode::kFailedPrecondition, "UPLOAD_ENDED",
        absl::StrCat(
            "all of ", name,
            " is here and is being read, and this is no part of it; start a new upload for "
            "another file"),
        {{"state", v1::UploadState_Name(described.state())}});
  }
  if (total != nullptr) {
    absl::Status stated = open->SetTotal(*total);
    if (!stated.ok()) return stated;
  }
  if (piece != nullptr) {
    absl::Status accepted = open->Accept(*piece, journal_.At());
    if (!accepted.ok()) return accepted;
    if (absl::Status sound = open->CheckContent(); !sound.ok()) {
      std::lock_guard<std::mutex> only_one(open->commit_mutex());
      return open->let_go() ? sound : Fail(*open, sound);
    }
  }
  if (open->Complete()) {
    absl::Status committed = Commit(open);
    if (!committed.ok()) return committed;
    Expire();
    return Describe(name, open);
  }
  return open->Describe();
}

bool Uploads::IsOfScan(const std::string& scan, const UnpackedPiece* piece,
                       const v1::UploadTotal* total) const {
  bool is = false;
  journal_.Read([&](const SessionState& state) {
    const auto it = state.scans.find(scan);
    if (it == state.scans.end()) return;
    const ScanRecord& record = it->second;
    // Nothing is known of the pieces of scans that came to an earlier release.
    const bool known = !record.last_pieces.digests().empty();
    is = (piece == nullptr || !known || IsOneOf(record.last_pieces, *piece)) &&
         (total == nullptr || (total->encoded_size_bytes() == record.received_bytes &&
                               total->sha256() == record.scan.sha256()));
  });
  return is;
}

bool Uploads::IsOfFile(const v1::Upload& upload, const UnpackedPiece* piece,
                       const v1::UploadTotal* total) const {
  bool is = false;
  journal_.Read([&](const SessionState& state) {
    const auto file = state.files.find(upload.name());
    if (file == state.files.end()) return;
    is = (piece == nullptr || IsOneOf(file->second.last_pieces, *piece)) &&
         (total == nullptr || (total->encoded_size_bytes() == upload.total().encoded_size_bytes() &&
                               total->sha256() == upload.total().sha256()));
  });
  return is;
}

absl::StatusOr<v1::Upload> Uploads::Sync(const std::string& name,
                                         const std::shared_ptr<Upload>& open) {
  if (open != nullptr) {
    if (absl::Status synced = open->Sync(); !synced.ok()) return synced;
  }
  Expire();
  return Describe(name, open != nullptr ? open : FindOpen(name));
}

void Uploads::LetGo(Upload& upload, const std::string& name) {
  std::lock_guard<std::mutex> lock(mutex_);
  upload.LetGo();
  open_.erase(name);
}

void Uploads::CommitComplete() {
  std::vector<std::shared_ptr<Upload>> complete;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& [name, upload] : open_) {
      if (upload->Complete()) complete.push_back(upload);
    }
  }
  for (const auto& upload : complete) Commit(upload).IgnoreError();
}

void Uploads::Close() {
  std::map<std::string, std::shared_ptr<Upload>> open;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    open.swap(open_);
    for (const auto& [name, upload] : open) upload->LetGo();
  }
  if (dependencies_.files != nullptr) dependencies_.files->Forget(context_.id());
  for (const auto& [name, upload] : open) {
    upload->End(v1::UPLOAD_STATE_FAILED, "the session was deleted", "");
  }
}

size_t Uploads::OpenCount() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return open_.size();
}

std::vector<std::string> Uploads::Names() const {
  std::lock_guard<std::mutex> lock(mutex_);
  std::vector<std::string> names;
  for (const auto& [name, upload] : open_) names.push_back(name);
  return names;
}

absl::Duration Uploads::LastPiece() const {
  std::lock_guard<std::mutex> lock(mutex_);
  absl::Duration last;
  for (const auto& [name, upload] : open_) last = std::max(last, upload->LastPiece());
  return last;
}

void Uploads::Resume() {
  std::vector<v1::Upload> open;
  journal_.Read([&](const SessionState& state) {
    for (const auto& [name, upload] : state.uploads) {
      if (upload.state() == v1::UPLOAD_STATE_OPEN || upload.state() == v1::UPLOAD_STATE_READING) {
        open.push_back(upload);
      }
    }
  });
  for (const v1::Upload& created : open) {
    // What was promised of the disk is counted again.
    const auto promise = [&](Upload& upload) {
      if (!created.has_file() || dependencies_.files == nullptr) return;
      const int64_t bytes = 2 * created.total().encoded_size_bytes();
      if (!dependencies_.files->Promise(bytes, [] { return std::numeric_limits<int64_t>::max(); })
               .ok()) {
        return;
      }
      upload.Promise(bytes, [files = dependencies_.files](int64_t used) { files->Use(used); });
    };
    if (created.state() == v1::UPLOAD_STATE_READING) {
      // It is whole, and nothing of it is loaded before it is read.
      const int64_t bytes = created.total().encoded_size_bytes();
      context_.account()->Add(bytes);
      auto reading = std::make_shared<Upload>(created, dependencies_.store, dependencies_.limits,
                                              context_.account(), bytes, journal_.Seen());
      promise(*reading);
      std::lock_guard<std::mutex> lock(mutex_);
      open_[created.name()] = std::move(reading);
      continue;
    }
    auto upload = std::make_shared<Upload>(created, dependencies_.store, dependencies_.limits,
                                           context_.account());
    promise(*upload);
    absl::Status resumed = upload->Resume(journal_.At());
    if (resumed.ok()) resumed = upload->CheckContent();
    if (!resumed.ok()) {
      dependencies_.log.Error("an upload cannot go on",
                              {{"upload", created.name()}, {"error", resumed.ToString()}});
      if (absl::IsDataLoss(resumed) || absl::IsInvalidArgument(resumed)) {
        Fail(*upload, resumed).IgnoreError();
        continue;
      }
    }
    std::lock_guard<std::mutex> lock(mutex_);
    open_[created.name()] = std::move(upload);
  }
}

absl::Status Uploads::Commit(const std::shared_ptr<Upload>& upload) {
  std::lock_guard<std::mutex> only_one(upload->commit_mutex());
  if (!upload->Complete()) return absl::OkStatus();
  const v1::Upload described = upload->Describe();
  const absl::StatusOr<Upload::Content> content = upload->Inspect();
  if (!content.ok()) return Fail(*upload, content.status());
  // If this fails, the pieces have to be sent again.
  if (absl::Status synced = upload->Sync(); !synced.ok()) return synced;
  if (described.has_file()) return BeginReading(upload);
  absl::Status kept = dependencies_.store.PutSpool(described.name(), content->sha256);
  if (!kept.ok()) return kept;

  const absl::StatusOr<std::string> name =
      intake_.Take({described, *content, upload->LastPieces()}, "");
  if (!name.ok()) {
    // What it should replace is gone meanwhile, and does not come back.
    if (absl::IsFailedPrecondition(name.status())) return Fail(*upload, name.status());
    return name.status();
  }
  upload->End(v1::UPLOAD_STATE_COMMITTED, "", *name);
  LetGo(*upload, described.name());
  dependencies_.log.Info(
      described.replaces().empty() ? "scan received" : "scan replaced",
      {{"session", context_.id()}, {"scan", *name}, {"bytes", content->encoded_size}});
  reconciler_.Post(*name);
  return absl::OkStatus();
}

absl::Status Uploads::BeginReading(const std::shared_ptr<Upload>& upload) {
  absl::StatusOr<std::string> logged =
      journal_.Execute({}, [&](const SessionState&) -> absl::StatusOr<Draft> {
        Draft draft;
        v1::Upload& received = *draft.event.mutable_upload_received()->mutable_upload();
        received = upload->Describe();
        received.set_state(v1::UPLOAD_STATE_READING);
        draft.last_pieces = upload->LastPieces();
        return draft;
      });
  if (!logged.ok()) return logged.status();
  upload->BeginReading();
  dependencies_.log.Info("file received",
                         {{"session", context_.id()},
                          {"upload", *logged},
                          {"bytes", upload->Describe().total().encoded_size_bytes()}});
  PostReading(upload);
  return absl::OkStatus();
}

void Uploads::ResumeReading() {
  std::vector<std::shared_ptr<Upload>> reading;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& [name, upload] : open_) {
      if (upload->Reading()) reading.push_back(upload);
    }
  }
  for (const std::shared_ptr<Upload>& upload : reading) PostReading(upload);
}

void Uploads::PostReading(const std::shared_ptr<Upload>& upload) {
  if (dependencies_.files == nullptr) return;  // the next server reads it
  dependencies_.files->Post(
      ReaderOf(context_), context_.id(),
      [this, upload, keep = context_.weak_from_this(),
       reading = std::make_shared<FileReading>(context_, reconciler_, intake_, upload)](
          const FileReadings::GivenUp& given_up) {
        const std::shared_ptr<SessionContext> session = keep.lock();
        if (session == nullptr) return std::chrono::milliseconds(0);
        return ReadFile(*reading, upload, given_up);
      });
}

std::chrono::milliseconds Uploads::ReadFile(FileReading& reading,
                                            const std::shared_ptr<Upload>& upload,
                                            const FileReadings::GivenUp& given_up) {
  constexpr std::chrono::milliseconds kDone(0);
  if (upload->let_go() || context_.closed() || given_up()) return kDone;
  const std::string name = upload->Describe().name();
  if (absl::Status begun = work_.Begin(name); !begun.ok()) {
    if (!absl::IsFailedPrecondition(begun)) return FileReading::kAgain;
    std::lock_guard<std::mutex> only_one(upload->commit_mutex());
    if (!upload->let_go()) Fail(*upload, begun).IgnoreError();
    return kDone;
  }
  const FileReading::Outcome outcome = reading.Run(given_up);
  work_.End(name);
  if (outcome == FileReading::Outcome::kGivenUp) return kDone;
  if (outcome == FileReading::Outcome::kLater) {
    Expire();
    return upload->let_go() ? kDone : FileReading::kAgain;
  }
  std::lock_guard<std::mutex> only_one(upload->commit_mutex());
  if (upload->let_go()) return kDone;
  EndReading(reading, outcome, *upload);
  return upload->let_go() ? kDone : FileReading::kAgain;
}

// Where the end cannot be logged, the file stays, and is read again; its scans are known.
void Uploads::EndReading(const FileReading& reading, FileReading::Outcome outcome, Upload& upload) {
  const bool failed = outcome == FileReading::Outcome::kFailed;
  const absl::Status why = failed ? reading.why() : absl::OkStatus();
  v1::Upload now = upload.Describe();
  now.set_state(failed ? v1::UPLOAD_STATE_FAILED : v1::UPLOAD_STATE_COMMITTED);
  now.set_state_message(failed ? std::string(why.message()) : reading.Notes());
  now.set_state_reason(contract::ReasonOf(why));
  now.set_state_code(static_cast<int32_t>(why.code()));
  now.clear_read_size_bytes();
  const absl::StatusOr<std::string> ended =
      journal_.Execute({}, [&](const SessionState&) -> absl::StatusOr<Draft> {
        Draft draft;
        *draft.event.mutable_upload_ended()->mutable_upload() = now;
        return draft;
      });
  if (ended.ok()) {
    upload.End(now.state(), now.state_message(), "", why);
    LetGo(upload, now.name());
  }
  dependencies_.log.Info(failed ? "a file was refused" : "file read",
                         {{"session", context_.id()},
                          {"upload", now.name()},
                          {"setups", now.setup_count()},
                          {"scans", now.scans_size()},
                          {"reason", contract::ReasonOf(reading.why())},
                          {"logged", ended.ok()}});
}

// Ends an upload and logs that.
absl::Status Uploads::End(Upload& upload, v1::UploadState state, const std::string& why,
                          const RequestKey& key, const absl::Status& failure) {
  upload.End(state, why, "", failure);
  const v1::Upload ended = upload.Describe();
  absl::StatusOr<std::string> logged =
      journal_.Execute(key, [&](const SessionState&) -> absl::StatusOr<Draft> {
        Draft draft;
        *draft.event.mutable_upload_ended()->mutable_upload() = ended;
        return draft;
      });
  if (!logged.ok()) return logged.status();
  LetGo(upload, ended.name());
  return absl::OkStatus();
}

absl::Status Uploads::Fail(Upload& upload, const absl::Status& why) {
  const absl::Status ended =
      End(upload, v1::UPLOAD_STATE_FAILED, std::string(why.message()), {}, why);
  return ended.ok() ? why : ended;
}

void Uploads::Expire() {
  std::vector<std::shared_ptr<Upload>> idle;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    const absl::Duration now = journal_.Seen();
    for (auto it = open_.begin(); it != open_.end();) {
      if (it->second->Idle(now)) {
        it->second->LetGo();
        idle.push_back(it->second);
        it = open_.erase(it);
      } else {
        ++it;
      }
    }
  }
  EndIdle(idle, "no piece came for too long");
}

void Uploads::EndIdle(const std::vector<std::shared_ptr<Upload>>& idle, const std::string& why) {
  for (const std::shared_ptr<Upload>& upload : idle) {
    const absl::Status ended = End(*upload, v1::UPLOAD_STATE_EXPIRED, why, {});
    if (!ended.ok()) {
      dependencies_.log.Error("could not log the end of an upload",
                              {{"upload", upload->Describe().name()}, {"error", ended.ToString()}});
    }
  }
}

}  // namespace vantage::session

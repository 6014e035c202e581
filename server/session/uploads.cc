#include "server/session/uploads.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/contract/error.h"
#include "server/contract/resource_names.h"
#include "server/conversion/from_proto.h"
#include "server/conversion/to_proto.h"
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

// The preview that an upload replaces. FAILED_PRECONDITION (SCAN_STATE): that scan is none, or was
// withdrawn. INVALID_ARGUMENT: there is no such scan.
absl::StatusOr<ScanRecord> PreviewOf(const SessionState& state, const v1::Upload& upload) {
  const auto it = state.scans.find(upload.replaces());
  if (it == state.scans.end()) {
    return contract::InvalidField(
        "upload.replaces", absl::StrCat("'", upload.replaces(), "' is no scan of this session"));
  }
  const v1::Scan& scan = it->second.scan;
  if (scan.preview() && scan.state() != v1::SCAN_STATE_WITHDRAWN) return it->second;
  return contract::ErrorWithReason(
      absl::StatusCode::kFailedPrecondition, "SCAN_STATE",
      absl::StrCat(scan.name(), scan.preview() ? " was withdrawn" : " is no preview",
                   ", and nothing can come in its place; send this scan as one of its own"),
      {{"state", v1::ScanState_Name(scan.state())}});
}

v1::Scan ReceivedScan(const v1::Upload& upload, const Upload::Content& content, absl::Time now) {
  v1::Scan scan;
  scan.set_display_name(upload.display_name());
  scan.set_state(v1::SCAN_STATE_RECEIVED);
  *scan.mutable_scanner_model() = upload.scanner_model();
  if (upload.has_prior()) *scan.mutable_prior() = upload.prior();
  *scan.mutable_targets() = upload.targets();
  scan.set_column_count(static_cast<int32_t>(content.columns));
  scan.set_row_count(static_cast<int32_t>(content.rows));
  scan.set_sample_count(static_cast<int64_t>(content.samples));
  scan.set_intensity(content.appearance.intensity);
  scan.set_colour(content.appearance.colour);
  scan.set_encoded_size_bytes(content.encoded_size);
  scan.set_sha256(content.sha256);
  *scan.mutable_create_time() = conversion::WriteTime(now);
  *scan.mutable_update_time() = scan.create_time();
  scan.set_upload(upload.name());
  scan.set_scanner(upload.scanner());
  scan.set_preview(upload.preview());
  return scan;
}

// The preview with the samples of the scan that was received in its place: placed as it is, or
// aligned anew where it had not registered.
v1::Scan Replaced(const v1::Scan& preview, v1::Scan received) {
  received.set_name(preview.name());
  *received.mutable_replace_time() = received.create_time();
  *received.mutable_create_time() = preview.create_time();
  if (received.display_name().empty()) received.set_display_name(preview.display_name());
  if (received.scanner().empty()) received.set_scanner(preview.scanner());
  if (received.targets().empty()) *received.mutable_targets() = preview.targets();
  if (!received.has_prior() && preview.has_prior()) *received.mutable_prior() = preview.prior();
  const bool placed = preview.has_pose() && (preview.state() == v1::SCAN_STATE_MERGED ||
                                             preview.state() == v1::SCAN_STATE_MERGING);
  if (!placed) return received;
  received.set_state(v1::SCAN_STATE_MERGING);
  if (preview.has_prior()) *received.mutable_prior() = preview.prior();
  *received.mutable_pose() = preview.pose();
  received.set_pose_source(preview.pose_source());
  if (preview.has_registration()) *received.mutable_registration() = preview.registration();
  if (preview.has_levelling()) *received.mutable_levelling() = preview.levelling();
  if (preview.has_adjustment()) *received.mutable_adjustment() = preview.adjustment();
  if (preview.has_pose_reference()) *received.mutable_pose_reference() = preview.pose_reference();
  if (preview.has_merge()) *received.mutable_merge() = preview.merge();
  return received;
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
      reconciler_(reconciler) {}

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
        absl::StatusOr<v1::ScannerModel> scanner = ScannerOf(state, asked);
        if (!scanner.ok()) return scanner.status();
        // The whole size is reserved, so that an accepted upload can be completed.
        absl::Status room = context_.account()->Reserve(asked.total().encoded_size_bytes());
        if (!room.ok()) return room;
        reserved = asked.total().encoded_size_bytes();
        Draft draft;
        v1::Upload& upload = *draft.event.mutable_upload_created()->mutable_upload();
        upload.set_name(contract::ChildName(context_.id(), "uploads",
                                            absl::StrCat("upload-", state.upload_count + 1)));
        upload.set_display_name(asked.display_name());
        upload.set_scanner_model_id(scanner->id());
        upload.set_scanner(asked.scanner());
        *upload.mutable_scanner_model() = *scanner;
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
      open_[*name] = std::make_shared<Upload>(created, dependencies_.store, dependencies_.limits,
                                              context_.account(), reserved, journal_.Seen());
    }
  }
  return Get(*name);
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
    const bool committed = ended->state() == v1::UPLOAD_STATE_COMMITTED;
    if (committed && piece != nullptr && !piece->bytes.ok()) return piece->bytes.status();
    if (committed && IsOfScan(ended->scan(), piece, total)) return ended;
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
      if (upload.state() == v1::UPLOAD_STATE_OPEN) open.push_back(upload);
    }
  });
  for (const v1::Upload& created : open) {
    auto upload = std::make_shared<Upload>(created, dependencies_.store, dependencies_.limits,
                                           context_.account());
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

absl::Status Uploads::PlaceOrigin(const v1::Upload& upload) {
  const auto origin = [&](const SessionState& state) {
    return state.scans.empty() ? OriginByFirstScan(state.session, upload) : std::nullopt;
  };
  bool wanted = false;
  journal_.Read([&](const SessionState& state) { wanted = origin(state).has_value(); });
  if (!wanted) return absl::OkStatus();
  const absl::Status forestalled = absl::AlreadyExistsError("another scan came first");
  const absl::StatusOr<std::string> placed =
      journal_.Execute({}, [&](const SessionState& state) -> absl::StatusOr<Draft> {
        const std::optional<v1::Vector3> found = origin(state);
        if (!found.has_value()) return forestalled;
        Draft draft;
        v1::SessionUpdatedEvent& updated = *draft.event.mutable_session_updated();
        *updated.mutable_session() = state.session;
        *updated.mutable_session()->mutable_origin() = *found;
        updated.mutable_update_mask()->add_paths("origin");
        return draft;
      });
  if (!placed.ok() && placed.status() != forestalled) return placed.status();
  context_.ReadOrigin();
  return absl::OkStatus();
}

absl::Status Uploads::Commit(const std::shared_ptr<Upload>& upload) {
  std::lock_guard<std::mutex> only_one(upload->commit_mutex());
  if (!upload->Complete()) return absl::OkStatus();
  const v1::Upload described = upload->Describe();
  const absl::StatusOr<Upload::Content> content = upload->Inspect();
  if (!content.ok()) return Fail(*upload, content.status());
  // If this fails, the pieces have to be sent again.
  if (absl::Status synced = upload->Sync(); !synced.ok()) return synced;
  absl::Status kept = dependencies_.store.PutSpool(described.name(), content->sha256);
  if (!kept.ok()) return kept;

  if (absl::Status placed = PlaceOrigin(described); !placed.ok()) {
    dependencies_.store.ReleaseBlob(content->sha256).IgnoreError();
    return placed;
  }

  std::string before;  // the blob of a preview that it replaces and that is of no more use
  int64_t before_bytes = 0;
  absl::StatusOr<std::string> name =
      journal_.Execute({}, [&](const SessionState& state) -> absl::StatusOr<Draft> {
        if (static_cast<size_t>(state.PendingScans()) >=
            dependencies_.limits.pending_scans_per_session) {
          return contract::Retryable(
              absl::StatusCode::kResourceExhausted, "TOO_MANY_PENDING_SCANS",
              absl::StrCat(state.PendingScans(),
                           " scans wait to be registered and merged; send the last "
                           "piece again later"),
              kRetryUploadAfter);
        }
        Draft draft;
        draft.blob = content->sha256;
        draft.last_pieces = upload->LastPieces();
        v1::Scan scan = ReceivedScan(described, *content, journal_.Now());
        if (described.replaces().empty()) {
          scan.set_name(contract::ChildName(context_.id(), "scans",
                                            absl::StrCat("scan-", state.scan_order.size() + 1)));
          *draft.event.mutable_scan_received()->mutable_scan() = std::move(scan);
          return draft;
        }
        absl::StatusOr<ScanRecord> preview = PreviewOf(state, described);
        if (!preview.ok()) return preview.status();
        // One that is in the model is kept until the other is merged in its place.
        if (!preview->in_model || !preview->preview_blob.empty()) {
          before = preview->blob;
          before_bytes = preview->scan.encoded_size_bytes();
        }
        *draft.event.mutable_scan_replaced()->mutable_scan() =
            Replaced(preview->scan, std::move(scan));
        return draft;
      });
  if (!name.ok()) {
    dependencies_.store.ReleaseBlob(content->sha256).IgnoreError();
    // What it should replace is gone meanwhile, and does not come back.
    if (absl::IsFailedPrecondition(name.status())) return Fail(*upload, name.status());
    return name.status();
  }
  if (!before.empty()) {
    context_.account()->GiveBack(before_bytes);
    // What cannot be removed now is removed at the next start.
    dependencies_.store.ReleaseBlob(before).IgnoreError();
  }
  upload->End(v1::UPLOAD_STATE_COMMITTED, "", *name);
  LetGo(*upload, described.name());
  dependencies_.log.Info(
      described.replaces().empty() ? "scan received" : "scan replaced",
      {{"session", context_.id()}, {"scan", *name}, {"bytes", content->encoded_size}});
  reconciler_.Post(*name);
  return absl::OkStatus();
}

// Ends an upload that failed and returns the reason.
absl::Status Uploads::End(Upload& upload, v1::UploadState state, const std::string& why,
                          const RequestKey& key) {
  upload.End(state, why, "");
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
  const absl::Status ended = End(upload, v1::UPLOAD_STATE_FAILED, std::string(why.message()), {});
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

#include "server/session/session_import.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "server/contract/error.h"
#include "server/contract/resource_names.h"
#include "server/conversion/from_proto.h"
#include "server/conversion/to_proto.h"
#include "server/session/imported_entry.h"
#include "server/session/renaming.h"
#include "server/session/site_prior_use.h"
#include "server/store/upgrade.h"

namespace vantage::session {
namespace {

// Bytes of a plan's details: 100,000 viewcells of the map of scores and 8,000 patches are a tenth.
constexpr int64_t kMaxPlanBytes = int64_t{64} << 20;

absl::Status Newer(absl::string_view what) {
  return contract::ErrorWithReason(
      absl::StatusCode::kFailedPrecondition, "ARCHIVE_NEWER",
      absl::StrCat("a newer release wrote the archive (", what,
                   "); import it where that release runs, or update this server"));
}

// What nothing can be done with any more: it was withdrawn, and is not in the model.
bool NeedsNoData(const ScanRecord& record) {
  return record.scan.state() == v1::SCAN_STATE_WITHDRAWN && !record.in_model;
}

}  // namespace

SessionImport::SessionImport(Asked asked, std::string spools,
                             std::shared_ptr<TenantAccount> account,
                             const SessionDependencies& dependencies)
    : asked_(std::move(asked)),
      spools_(std::move(spools)),
      account_(std::move(account)),
      dependencies_(dependencies),
      memory_(dependencies.memory, asked_.tenant) {}

SessionImport::~SessionImport() {
  scan_.reset();
  dependencies_.store.DropSpool(LogSpool()).IgnoreError();
  if (blob_.has_value()) {
    dependencies_.store.DropSpool(absl::StrCat(spools_, blobs_begun_)).IgnoreError();
  }
  if (kept_) return;
  // What cannot be removed now is removed at the next start, since no log names it.
  for (const auto& [named, blob] : stored_) dependencies_.store.ReleaseBlob(blob).IgnoreError();
}

std::string SessionImport::LogSpool() const { return absl::StrCat(spools_, "log"); }

absl::Status SessionImport::Take(absl::string_view bytes) {
  reader_.Add(bytes);
  while (true) {
    absl::StatusOr<std::optional<storage::v1::ArchiveRecord>> record = reader_.Next();
    if (!record.ok()) return record.status();
    if (!record->has_value()) return absl::OkStatus();
    if (absl::Status read = Read(**record); !read.ok()) return read;
  }
}

absl::Status SessionImport::Read(storage::v1::ArchiveRecord& record) {
  using Kind = storage::v1::ArchiveRecord;
  const Kind::KindCase kind = record.kind_case();
  if (kind == Kind::KIND_NOT_SET) return Newer("a record of a kind that is not known");
  if (header_.has_value() == record.has_header()) {
    return ArchiveDamaged("it has no header, or two");
  }
  if (blob_.has_value() != record.has_chunk()) {
    return ArchiveDamaged("bytes of a scan or a plan are missing or too many");
  }
  const bool entries = state_.last_sequence > 0;
  switch (kind) {
    case Kind::kHeader:
      return Begin(record.header());
    case Kind::kBlob:
      if (entries) return ArchiveDamaged("its parts are in another order");
      return BeginBlob(record.blob());
    case Kind::kChunk:
      return AddChunk(record.chunk());
    case Kind::kEntry:
      return AddEntry(*record.mutable_entry());
    case Kind::kEnd:
      return End();
    case Kind::KIND_NOT_SET:
      break;
  }
  return absl::OkStatus();
}

absl::Status SessionImport::Begin(const storage::v1::ArchiveHeader& header) {
  if (header.format_version() > kArchiveFormatVersion) {
    return Newer(absl::StrCat("format ", header.format_version()));
  }
  const absl::StatusOr<std::string> id = contract::ParseSessionName(header.session(), "session");
  if (!id.ok() || header.format_version() == 0) return ArchiveDamaged("its header is none");
  header_ = header;
  id_ = asked_.session_id.empty() ? *id : asked_.session_id;
  rebase_ = dependencies_.seen->Now() - absl::Seconds(header.seen().seconds()) -
            absl::Nanoseconds(header.seen().nanos());
  return absl::OkStatus();
}

absl::Status SessionImport::BeginBlob(const storage::v1::ArchiveBlob& blob) {
  const contract::Limits& limits = dependencies_.limits;
  if (blob.sha256().size() != 32 || blob.size_bytes() < 1) {
    return ArchiveDamaged("a scan or a plan without size or SHA-256");
  }
  ++blobs_begun_;
  // A scan may have a preview beside it.
  if (blobs_begun_ > 2 * limits.scans_per_session + limits.full_plans_per_session + 1) {
    return ArchiveDamaged("it has more scans than a session may");
  }
  switch (blob.kind()) {
    case storage::v1::ARCHIVE_BLOB_KIND_SCAN: {
      v1::Upload upload;
      upload.set_name(absl::StrCat(spools_, blobs_begun_));
      upload.set_state(v1::UPLOAD_STATE_OPEN);
      upload.mutable_total()->set_encoded_size_bytes(blob.size_bytes());
      upload.mutable_total()->set_sha256(blob.sha256());
      if (absl::Status fits = CheckTotal(upload.total(), "scan", limits); !fits.ok()) return fits;
      if (absl::Status room = account_.Reserve(blob.size_bytes()); !room.ok()) return room;
      scan_ = std::make_unique<Upload>(upload, dependencies_.store, limits, nullptr, 0,
                                       dependencies_.seen->Now());
      break;
    }
    case storage::v1::ARCHIVE_BLOB_KIND_SITE_PRIOR:
      if (blob.size_bytes() > kMostPriorBlob) {
        return ArchiveDamaged("a prior of the site that is larger than one may be");
      }
      if (absl::Status room = account_.Reserve(blob.size_bytes()); !room.ok()) return room;
      if (auto taken = TakeForPrior(blob.size_bytes()); taken.ok()) {
        prior_memory_ = *std::move(taken);
      } else {
        return taken.status();
      }
      plan_.clear();
      break;
    case storage::v1::ARCHIVE_BLOB_KIND_PLAN:
      if (blob.size_bytes() > kMaxPlanBytes) return ArchiveDamaged("a plan that is too large");
      if (absl::Status room = account_.Reserve(blob.size_bytes()); !room.ok()) return room;
      plan_.clear();
      break;
    default:
      return Newer("a part of a kind that is not known");
  }
  blob_ = blob;
  blob_bytes_ = 0;
  chunks_ = 0;
  return absl::OkStatus();
}

absl::Status SessionImport::AddChunk(const storage::v1::ArchiveChunk& chunk) {
  absl::StatusOr<std::string> bytes = ReadArchiveChunk(chunk);
  if (!bytes.ok()) return bytes.status();
  const int64_t at = blob_bytes_;
  blob_bytes_ += static_cast<int64_t>(bytes->size());
  if (blob_bytes_ > blob_->size_bytes()) return ArchiveDamaged("a part is larger than it states");
  const bool last = blob_bytes_ == blob_->size_bytes();
  if (scan_ == nullptr) {
    plan_ += *bytes;
    if (!last) return absl::OkStatus();
    return blob_->kind() == storage::v1::ARCHIVE_BLOB_KIND_SITE_PRIOR ? EndSitePrior() : EndPlan();
  }
  v1::Piece piece;
  piece.set_sequence(chunks_++);
  piece.set_offset(at);
  piece.set_data(chunk.data());
  piece.set_compression(v1::COMPRESSION_ZSTD);
  piece.set_uncompressed_size_bytes(chunk.uncompressed_size_bytes());
  piece.set_crc32c(chunk.crc32c());
  const Moment now{dependencies_.clock(), dependencies_.seen->Now()};
  if (absl::Status taken = scan_->Accept(piece, now); !taken.ok()) return taken;
  if (absl::Status sound = scan_->CheckContent(); !sound.ok()) {
    return ArchiveDamaged(sound.message());
  }
  return last ? EndScan() : absl::OkStatus();
}

absl::Status SessionImport::EndScan() {
  const absl::StatusOr<Upload::Content> content = scan_->Inspect();
  if (!content.ok()) return ArchiveDamaged(content.status().message());
  if (absl::Status synced = scan_->Sync(); !synced.ok()) return synced;
  absl::Status kept =
      dependencies_.store.PutSpool(absl::StrCat(spools_, blobs_begun_), content->sha256);
  if (!kept.ok()) return kept;
  stored_.emplace(content->sha256, content->sha256);
  scan_->End(v1::UPLOAD_STATE_COMMITTED, "", "");
  scan_.reset();
  blob_.reset();
  return absl::OkStatus();
}

absl::StatusOr<MemoryAccount::Reservation> SessionImport::TakeForPrior(int64_t bytes) const {
  const int64_t all = bytes + prior_memory_.bytes();
  if (const auto most = memory_.Most(); most.has_value() && all > *most) {
    return contract::ErrorWithReason(
        absl::StatusCode::kResourceExhausted, "FILE_TOO_LARGE",
        absl::StrCat("the archive's prior of the site takes some ", all >> 20,
                     " MiB to read, and the server has ", *most >> 20,
                     " MiB for all models and plans: take the prior out before the export, or have "
                     "the server's operator give it more (--memory-mib)"));
  }
  return memory_.Reserve(bytes);
}

absl::Status SessionImport::EndSitePrior() {
  if (bytes::Sha256::Of(plan_) != blob_->sha256()) {
    return ArchiveDamaged("a prior of the site whose SHA-256 is not the one that it states");
  }
  {
    const auto unfolding = TakeForPrior(UnfoldingBytes(plan_));
    if (!unfolding.ok()) return unfolding.status();
    if (const auto read = ReadPriorBlob(plan_); !read.ok()) {
      return ArchiveDamaged(read.status().message());
    }
  }
  const absl::StatusOr<std::string> kept = dependencies_.store.PutBlob(plan_);
  if (!kept.ok()) return kept.status();
  plan_ = std::string();
  prior_memory_.Release();
  stored_.emplace(blob_->sha256(), *kept);
  blob_.reset();
  return absl::OkStatus();
}

absl::Status SessionImport::EndPlan() {
  if (bytes::Sha256::Of(plan_) != blob_->sha256()) {
    return ArchiveDamaged("a plan whose SHA-256 is not the one that it states");
  }
  v1::PlanResult result;
  if (!result.ParseFromString(plan_)) return ArchiveDamaged("a plan that cannot be read");
  store::Upgrade(result);
  RenameSession(header_->session(), contract::NameOfSession(id_), result);
  const absl::StatusOr<std::string> kept = dependencies_.store.PutBlob(result.SerializeAsString());
  if (!kept.ok()) return kept.status();
  stored_.emplace(blob_->sha256(), *kept);
  blob_.reset();
  return absl::OkStatus();
}

absl::Status SessionImport::AddEntry(storage::v1::LogEntry& entry) {
  store::Upgrade(entry);
  const bool first = state_.last_sequence == 0;
  if (first && !entry.event().has_session_created()) return ArchiveDamaged("its log has no begin");
  if (!first && entry.event().has_session_created()) return ArchiveDamaged("its log begins twice");
  if (entry.event().event_case() == v1::SessionEvent::EVENT_NOT_SET) {
    return Newer(absl::StrCat("entry ", entry.event().sequence()));
  }
  RenameSession(header_->session(), contract::NameOfSession(id_), entry);
  if (first) {
    entry.set_tenant(asked_.tenant);
    entry.mutable_request()->set_id(asked_.request_id);
    entry.mutable_request()->set_method("ImportSession");
    entry.mutable_request()->clear_fingerprint();
  }
  // Callers of the other server are nobody here: a claim is everybody's.
  entry.clear_caller();
  const absl::Duration seen =
      absl::Seconds(entry.seen().seconds()) + absl::Nanoseconds(entry.seen().nanos()) + rebase_;
  *entry.mutable_seen() = conversion::WriteDuration(absl::ToDoubleSeconds(seen));
  // A SHA-256 alone must not give data that others stored.
  const auto stored = stored_.find(entry.blob());
  entry.set_blob(stored == stored_.end() ? "" : stored->second);
  if (absl::Status sound = CheckImportedEntry(entry, id_, dependencies_.limits); !sound.ok()) {
    return ArchiveDamaged(absl::StrCat("entry ", entry.event().sequence(), ": ", sound.message()));
  }
  if (absl::Status fits = state_.Apply(entry); !fits.ok()) {
    return absl::IsFailedPrecondition(fits) ? Newer(fits.message())
                                            : ArchiveDamaged(fits.message());
  }
  const std::string bytes = entry.SerializeAsString();
  log_bytes_ += static_cast<int64_t>(bytes.size());
  if (log_bytes_ > dependencies_.limits.log_bytes_per_session) {
    return ArchiveDamaged("its log is longer than a session's may be");
  }
  account_.AddLog(static_cast<int64_t>(bytes.size()));
  return dependencies_.store.AppendSpool(LogSpool(), bytes);
}

absl::Status SessionImport::End() {
  if (!reader_.whole()) return ArchiveDamaged("something follows its end");
  if (state_.last_sequence != header_->last_sequence()) {
    return ArchiveDamaged("entries of its log are missing");
  }
  // Every blob has the holders that the log gives it.
  std::multimap<std::string, std::string> unused;  // by the name in the store
  for (const auto& [named, blob] : stored_) unused.emplace(blob, named);
  const auto use = [&](const std::string& blob) {
    const auto it = unused.find(blob);
    if (it == unused.end()) return false;
    unused.erase(it);
    return true;
  };
  for (const auto& [name, record] : state_.scans) {
    const bool there = !record.blob.empty() && use(record.blob);
    if (!there && !NeedsNoData(record)) {
      return ArchiveDamaged(absl::StrCat("it lacks the data of ", name));
    }
    if (!record.preview_blob.empty() && !use(record.preview_blob)) {
      return ArchiveDamaged(absl::StrCat("it lacks the preview of ", name));
    }
  }
  for (const auto& [name, record] : state_.plans) {
    if (!record.blob.empty() && !use(record.blob)) {
      return ArchiveDamaged(absl::StrCat("it lacks the details of ", name));
    }
  }
  const bool prior = !state_.site_prior.name().empty() || !state_.site_prior_blob.empty();
  if (prior && (state_.site_prior_blob.empty() || !use(state_.site_prior_blob))) {
    return ArchiveDamaged("it lacks its prior of the site");
  }
  if (!unused.empty()) return ArchiveDamaged("it has data that its log does not name");
  if (state_.scans.size() > dependencies_.limits.scans_per_session) {
    return ArchiveDamaged("it has more scans than a session may");
  }
  whole_ = true;
  return absl::OkStatus();
}

absl::Status SessionImport::PutLog() { return dependencies_.store.PutLog(id_, LogSpool()); }

void SessionImport::Keep() {
  kept_ = true;
  account_.Close();
}

}  // namespace vantage::session

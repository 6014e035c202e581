#include "server/session/archive_writer.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/bytes/compression.h"
#include "core/model/view/algorithm_version.h"
#include "server/contract/error.h"
#include "server/conversion/to_proto.h"
#include "server/session/archive_reader.h"
#include "server/store/left_out.h"

namespace vantage::session {
namespace {

constexpr size_t kEntriesAtOnce = 256;

absl::Status Changed() {
  return contract::Retryable(absl::StatusCode::kUnavailable, "SESSION_CHANGED",
                             "the session was tidied up while it was exported; export it again",
                             absl::Seconds(1));
}

}  // namespace

ArchiveWriter::ArchiveWriter(Session& session) : session_(session) {
  storage::v1::ArchiveHeader& header = *header_.mutable_header();
  header.set_format_version(kArchiveFormatVersion);
  header.set_session(session.name());
  header.set_algorithm_version(model::kModelAlgorithmVersion);
  const Moment now = session.journal().At();
  *header.mutable_time() = conversion::WriteTime(now.time);
  *header.mutable_seen() = conversion::WriteDuration(absl::ToDoubleSeconds(now.seen));
  const std::vector<std::string> kept = session.plans().Blobs();
  session.journal().Read([&](const SessionState& state) {
    last_sequence_ = state.last_sequence;
    for (const std::string& name : state.scan_order) {
      const ScanRecord& record = state.scans.at(name);
      const bool over = record.scan.state() == v1::SCAN_STATE_WITHDRAWN && !record.in_model;
      for (const std::string& blob : {record.blob, record.preview_blob}) {
        if (!blob.empty()) {
          blobs_.push_back({blob, storage::v1::ARCHIVE_BLOB_KIND_SCAN, name, over});
        }
      }
    }
    if (!state.site_prior_blob.empty()) {
      blobs_.push_back({state.site_prior_blob, storage::v1::ARCHIVE_BLOB_KIND_SITE_PRIOR,
                        state.site_prior.name(), true});
    }
    for (const std::string& name : state.plan_order) {
      const std::string& blob = state.plans.at(name).blob;
      if (std::find(kept.begin(), kept.end(), blob) != kept.end()) {
        blobs_.push_back({blob, storage::v1::ARCHIVE_BLOB_KIND_PLAN, name, true});
      }
    }
  });
  header.set_last_sequence(last_sequence_);
}

std::string ArchiveWriter::Written(const storage::v1::ArchiveRecord& record) {
  std::string bytes = WriteArchiveRecord(record);
  sha256_.Update(bytes);
  return bytes;
}

absl::StatusOr<std::string> ArchiveWriter::Next() {
  if (!began_) {
    began_ = true;
    return Written(header_);
  }
  while (next_blob_ < blobs_.size()) {
    absl::StatusOr<std::string> part = NextBlob();
    if (!part.ok() || !part->empty()) return part;
  }
  if (after_ < last_sequence_) return NextEntries();
  if (ended_) return std::string();
  ended_ = true;
  storage::v1::ArchiveRecord end;
  end.mutable_end()->set_sha256(sha256_.Digest());
  return Written(end);
}

// Empty: it is left out.
absl::StatusOr<std::string> ArchiveWriter::NextBlob() {
  const Blob& blob = blobs_[next_blob_++];
  const absl::StatusOr<std::string> bytes = session_.dependencies().store.GetBlob(blob.sha256);
  if (!bytes.ok()) {
    const bool lost = absl::IsNotFound(bytes.status()) || absl::IsDataLoss(bytes.status());
    if (lost && blob.may_be_lost) return std::string();
    if (!lost) return bytes.status();
    // It may have been withdrawn, and its data erased, since this began.
    bool gone = true;
    session_.journal().Read([&](const SessionState& state) {
      const auto it = state.scans.find(blob.owner);
      gone = it == state.scans.end() ||
             (it->second.blob != blob.sha256 && it->second.preview_blob != blob.sha256);
    });
    if (gone) return Changed();
    return contract::ErrorWithReason(
        absl::StatusCode::kDataLoss, "SCAN_LOST",
        absl::StrCat(blob.owner,
                     ": the server has lost its data; have its operator restore a backup, or "
                     "withdraw it, before the session is exported"));
  }
  storage::v1::ArchiveRecord begin;
  begin.mutable_blob()->set_kind(blob.kind);
  begin.mutable_blob()->set_sha256(blob.sha256);
  begin.mutable_blob()->set_size_bytes(static_cast<int64_t>(bytes->size()));
  std::string part = Written(begin);
  const absl::string_view all = *bytes;
  for (size_t at = 0; at < all.size(); at += kArchiveChunk) {
    const absl::string_view some = all.substr(at, kArchiveChunk);
    storage::v1::ArchiveRecord record;
    storage::v1::ArchiveChunk& chunk = *record.mutable_chunk();
    chunk.set_data(bytes::ZstdCompress(some));
    chunk.set_uncompressed_size_bytes(static_cast<int64_t>(some.size()));
    chunk.set_crc32c(bytes::Crc32c(some));
    part += Written(record);
  }
  return part;
}

absl::StatusOr<std::string> ArchiveWriter::NextEntries() {
  const absl::StatusOr<std::vector<storage::v1::LogEntry>> entries =
      session_.dependencies().store.Read(session_.id(), after_, kEntriesAtOnce);
  if (!entries.ok()) return entries.status();
  std::string part;
  for (const storage::v1::LogEntry& entry : *entries) {
    if (entry.event().sequence() > last_sequence_) break;
    // The log was compacted since, and one entry stands for some that were written and some that
    // were not.
    if (store::FirstSequence(entry.event()) != after_ + 1) return Changed();
    storage::v1::ArchiveRecord record;
    *record.mutable_entry() = entry;
    part += Written(record);
    after_ = entry.event().sequence();
  }
  if (part.empty()) return Changed();
  return part;
}

}  // namespace vantage::session

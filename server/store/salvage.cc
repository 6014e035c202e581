#include "server/store/salvage.h"

#include <filesystem>
#include <map>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "google/protobuf/util/json_util.h"
#include "server/store/blob_folder.h"
#include "server/store/disk_store.h"
#include "server/store/durable_file.h"
#include "server/store/log_database.h"
#include "server/store/piece_record.h"
#include "server/store/spool_folder.h"
#include "server/store/store_folder.h"
#include "server/store/upgrade.h"
#include "vantage/storage/v1/log.pb.h"

namespace vantage::store {
namespace {

namespace fs = std::filesystem;

// The scan that an event tells of, where it does: any of them names its range image.
const v1::Scan* ScanIn(const v1::SessionEvent& event) {
  switch (event.event_case()) {
    case v1::SessionEvent::kScanReceived:
      return &event.scan_received().scan();
    case v1::SessionEvent::kScanReplaced:
      return &event.scan_replaced().scan();
    case v1::SessionEvent::kScanRegistered:
      return &event.scan_registered().scan();
    case v1::SessionEvent::kScanRefused:
      return &event.scan_refused().scan();
    case v1::SessionEvent::kScanAccepted:
      return &event.scan_accepted().scan();
    case v1::SessionEvent::kScanPoseSet:
      return &event.scan_pose_set().scan();
    case v1::SessionEvent::kScanMerged:
      return &event.scan_merged().scan();
    case v1::SessionEvent::kScanWithdrawn:
      return &event.scan_withdrawn().scan();
    case v1::SessionEvent::kScanRemoved:
      return &event.scan_removed().scan();
    default:
      return nullptr;
  }
}

std::string LastPart(const std::string& name) { return name.substr(name.rfind('/') + 1); }

absl::Status WriteNew(const std::string& path, absl::string_view bytes) {
  if (absl::Status made = MakeFolder(fs::path(path).parent_path().string()); !made.ok()) {
    return made;
  }
  return ReplaceFile(path, path + ".new", bytes);
}

}  // namespace

absl::StatusOr<Salvaged> SalvageSession(const std::string& folder, const std::string& session,
                                        const std::string& to) {
  if (absl::Status empty = CheckNewFolder(to); !empty.ok()) return empty;
  const absl::StatusOr<std::unique_ptr<LogDatabase>> logs =
      LogDatabase::OpenToRead(DatabaseIn(folder));
  if (!logs.ok()) return logs.status();
  Salvaged salvaged;
  const absl::StatusOr<std::vector<std::string>> sound =
      (*logs)->ReadSound(session, salvaged.faults);
  if (!sound.ok()) return sound.status();

  std::string lines;
  std::map<std::string, std::string> scans;  // blobs by name
  for (const std::string& bytes : *sound) {
    storage::v1::LogEntry entry;
    std::string json;
    if (!entry.ParseFromString(bytes)) {
      salvaged.faults.push_back("an entry is no entry of a log");
      continue;
    }
    Upgrade(entry);
    if (!google::protobuf::util::MessageToJsonString(entry, &json).ok()) {
      salvaged.faults.push_back(
          absl::StrCat("entry ", entry.event().sequence(), " cannot be written as text"));
      continue;
    }
    absl::StrAppend(&lines, json, "\n");
    ++salvaged.entries;
    const v1::Scan* const scan = ScanIn(entry.event());
    if (scan != nullptr && !scan->sha256().empty()) scans[scan->name()] = scan->sha256();
    // Erased some time after it was withdrawn.
    if (entry.event().has_scan_withdrawn() && scan->encoded_size_bytes() == 0) {
      scans.erase(scan->name());
    }
  }
  if (absl::Status written = WriteNew(absl::StrCat(to, "/log.jsonl"), lines); !written.ok()) {
    return written;
  }

  const BlobFolder blobs(BlobsIn(folder));
  for (const auto& [name, sha256] : scans) {
    const absl::StatusOr<std::string> image = blobs.Get(sha256);
    if (!image.ok()) {
      salvaged.faults.push_back(absl::StrCat(name, ", SHA-256 ", absl::BytesToHexString(sha256),
                                             ": ", image.status().message()));
      continue;
    }
    const std::string path = absl::StrCat(to, "/scans/", LastPart(name), ".vrim");
    if (absl::Status written = WriteNew(path, *image); !written.ok()) return written;
    ++salvaged.scans;
  }

  const SpoolFolder spools(SpoolsIn(folder));
  const absl::StatusOr<std::vector<std::string>> uploads = spools.List();
  if (!uploads.ok()) return uploads.status();
  for (const std::string& upload : *uploads) {
    if (!absl::StartsWith(upload, absl::StrCat("sessions/", session, "/"))) continue;
    std::string begun;
    const absl::Status read = spools.Read(
        upload, [&begun](absl::string_view record) { return AppendPiece(record, begun); });
    if (!read.ok()) salvaged.faults.push_back(absl::StrCat(upload, ": ", read.message()));
    if (begun.empty()) continue;
    const std::string path = absl::StrCat(to, "/uploads/", LastPart(upload), ".vrim");
    if (absl::Status written = WriteNew(path, begun); !written.ok()) return written;
    ++salvaged.uploads;
  }
  return salvaged;
}

absl::Status RemoveSession(const std::string& folder, const std::string& session) {
  if (!fs::exists(DatabaseIn(folder))) {
    return absl::NotFoundError(absl::StrCat("no sessions are kept in ", folder));
  }
  const absl::StatusOr<std::unique_ptr<DiskStore>> store = DiskStore::Open(folder);
  if (!store.ok()) return store.status();
  return (*store)->Drop(session);
}

}  // namespace vantage::store

#include "server/session/stored_scans.h"

#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/sensor/encoding.h"
#include "server/contract/error.h"
#include "server/conversion/from_proto.h"

namespace vantage::session {
namespace {

template <typename Read>
absl::StatusOr<Read> SayLost(const std::string& scan, absl::StatusOr<Read> read) {
  const bool missing = absl::IsNotFound(read.status());
  if (!missing && !absl::IsDataLoss(read.status())) return read;
  return contract::ErrorWithReason(
      absl::StatusCode::kDataLoss, "SCAN_LOST",
      absl::StrCat(scan, missing ? ": the server has lost its data" : ": its data are damaged",
                   "; have its operator restore a backup, or withdraw it and send it again"));
}

}  // namespace

absl::StatusOr<sensor::RangeImage> LoadImage(const SessionContext& context, const std::string& scan,
                                             absl::string_view sha256,
                                             sensor::RangeImageDecoder::Keep keep) {
  std::string blob;
  bool known = false;
  bool before = false;  // of the preview, which is of no use for long
  context.journal().Read([&](const SessionState& state) {
    const auto it = state.scans.find(scan);
    known = it != state.scans.end();
    if (!known) return;
    const ScanRecord& record = it->second;
    before = !sha256.empty() && record.preview_blob == sha256;
    blob = before ? record.preview_blob : record.blob;
  });
  if (!known) return contract::ResourceNotFound("vantage/Scan", scan);
  if (blob.empty()) {
    return contract::ErrorWithReason(
        absl::StatusCode::kFailedPrecondition, "SCAN_ERASED",
        absl::StrCat(scan,
                     " was withdrawn, and its data have been erased since; "
                     "send it again"));
  }
  absl::StatusOr<std::string> bytes = context.dependencies().store.GetBlob(blob);
  bytes = SayLost(scan, std::move(bytes));
  if (!before) context.lost_scans().Note(scan, bytes.status());
  if (!bytes.ok()) return bytes.status();
  return sensor::DecodeRangeImage(*bytes, context.dependencies().limits.scan_cells, keep);
}

void FindLostScans(const SessionContext& context) {
  std::map<std::string, std::string> blobs;
  context.journal().Read([&](const SessionState& state) {
    for (const auto& [name, record] : state.scans) {
      if (!record.blob.empty()) blobs[name] = record.blob;
    }
  });
  for (const auto& [name, blob] : blobs) {
    const absl::Status there = SayLost(name, context.dependencies().store.BlobSize(blob)).status();
    // Its size says nothing of its contents.
    if (absl::IsDataLoss(there)) context.lost_scans().Note(name, there);
  }
}

absl::StatusOr<sensor::Scan> LoadScan(const SessionContext& context, const v1::Scan& scan) {
  absl::StatusOr<sensor::RangeImage> image = LoadImage(context, scan.name(), scan.sha256());
  if (!image.ok()) return image.status();
  sensor::Scan data;
  data.image = *std::move(image);
  contract::Violations violations;
  data.scanner = conversion::ReadScannerModel(scan.scanner_model(), "scanner_model", violations);
  if (scan.has_prior()) {
    data.prior = conversion::ReadPosePrior(scan.prior(), context.origin(), "prior", violations);
  }
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return valid;
  return data;
}

}  // namespace vantage::session

#include "server/session/scan_intake.h"

#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/contract/error.h"
#include "server/contract/resource_names.h"
#include "server/conversion/to_proto.h"
#include "server/session/session_origin.h"

namespace vantage::session {
namespace {

constexpr absl::Duration kRetryScanAfter = absl::Seconds(2);

v1::Scan ReceivedScan(const ScanIntake::Arrival& arrival, absl::Time now) {
  const auto& [upload, content, last_pieces, file_setup] = arrival;
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
  scan.set_file_setup(file_setup);
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

// The newest preview that is called as a scan of a file; empty: there is none.
std::string PreviewCalled(const SessionState& state, const std::string& display_name) {
  for (auto name = state.scan_order.rbegin(); name != state.scan_order.rend(); ++name) {
    const v1::Scan& scan = state.scans.at(*name).scan;
    if (scan.preview() && scan.state() != v1::SCAN_STATE_WITHDRAWN &&
        scan.display_name() == display_name) {
      return scan.name();
    }
  }
  return "";
}

}  // namespace

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

absl::Status ScanIntake::PlaceOrigin(const v1::Upload& upload) {
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

absl::StatusOr<std::string> ScanIntake::Take(const Arrival& arrival, const std::string& of_file) {
  const std::string& sha256 = arrival.content.sha256;
  if (absl::Status placed = PlaceOrigin(arrival.upload); !placed.ok()) {
    dependencies_.store.ReleaseBlob(sha256).IgnoreError();
    return placed;
  }
  std::string before;  // the blob of a preview that it replaces and that is of no more use
  int64_t before_bytes = 0;
  absl::StatusOr<std::string> name =
      journal_.Execute({}, [&](const SessionState& state) -> absl::StatusOr<Draft> {
        if (absl::Status room = CheckRoom(state, of_file); !room.ok()) return room;
        Draft draft;
        draft.blob = sha256;
        draft.last_pieces = arrival.last_pieces;
        v1::Upload upload = arrival.upload;
        if (!of_file.empty()) {
          const auto file = state.files.find(of_file);
          if (file == state.files.end() || file->second.setups.count(arrival.file_setup) != 0) {
            return absl::AlreadyExistsError("this scan of the file came already");
          }
          if (upload.replaces().empty() && !upload.preview()) {
            upload.set_replaces(PreviewCalled(state, upload.display_name()));
          }
        }
        v1::Scan scan =
            ReceivedScan({upload, arrival.content, {}, arrival.file_setup}, journal_.Now());
        if (upload.replaces().empty()) {
          scan.set_name(contract::ChildName(context_.id(), "scans",
                                            absl::StrCat("scan-", state.scan_order.size() + 1)));
          *draft.event.mutable_scan_received()->mutable_scan() = std::move(scan);
          return draft;
        }
        absl::StatusOr<ScanRecord> preview = PreviewOf(state, upload);
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
    dependencies_.store.ReleaseBlob(sha256).IgnoreError();
    return name;
  }
  if (!before.empty()) {
    context_.account()->GiveBack(before_bytes);
    // What cannot be removed now is removed at the next start.
    dependencies_.store.ReleaseBlob(before).IgnoreError();
  }
  return name;
}

absl::Status ScanIntake::CheckRoom(const SessionState& state, const std::string& of_file) const {
  if (static_cast<size_t>(state.PendingScans()) >= dependencies_.limits.pending_scans_per_session) {
    return contract::Retryable(absl::StatusCode::kResourceExhausted, "TOO_MANY_PENDING_SCANS",
                               absl::StrCat(state.PendingScans(),
                                            " scans wait to be registered and merged; send the "
                                            "last piece again later"),
                               kRetryScanAfter);
  }
  // How many uploads there may be bounds the others.
  if (!of_file.empty() && state.scans.size() >= dependencies_.limits.scans_per_session) {
    return contract::ErrorWithReason(absl::StatusCode::kResourceExhausted, "TOO_MANY_SCANS",
                                     absl::StrCat("the session has ", state.scans.size(),
                                                  " scans, the most it may; open another session"));
  }
  return absl::OkStatus();
}

}  // namespace vantage::session

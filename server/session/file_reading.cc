#include "server/session/file_reading.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "core/bytes/byte_source.h"
#include "core/bytes/checksum.h"
#include "core/bytes/compression.h"
#include "core/sensor/encoding.h"
#include "core/sensor/oddities.h"
#include "core/sensor/thinning.h"
#include "server/contract/error.h"
#include "server/contract/out_of_memory.h"
#include "server/contract/valid_text.h"
#include "server/conversion/check_request.h"
#include "server/conversion/to_proto.h"
#include "server/session/file_allowance.h"

namespace vantage::session {
namespace {

// As the command line sends range images, so that the same bytes are stored.
constexpr size_t kStoredPieceBytes = 256 << 10;
constexpr size_t kMostNameBytes = 200;
constexpr size_t kMostNotesBytes = 4096;
// Of loose points that lie apart: five times what one station has at its edges (point_cloud.cc).
constexpr double kSeveralStations = 0.01;
constexpr double kUsualPreviewStep = sensor::Radians(0.25);
// A reader that the system ends for lack of memory is tried again so often.
constexpr int kMostDeaths = 3;

// What reading takes here and in the reader, of what the file holds: once, and of loose points
// eight times; measured were 0.8 and 6.3 times (server/experiments.md, 'Files that the server
// reads'). And beside it, bytes.
constexpr int64_t kBytesBeside = 64 << 20;
constexpr int64_t kTimesLoosePoints = 8;

absl::string_view StemOf(absl::string_view name) {
  const size_t dot = name.rfind('.');
  return dot == absl::string_view::npos || dot == 0 ? name : name.substr(0, dot);
}

const char* ReasonOf(sensor::FileRefusal refusal) {
  switch (refusal) {
    case sensor::FileRefusal::kNotAScan:
      return "NOT_A_SCAN";
    case sensor::FileRefusal::kCutOff:
      return "FILE_CUT_OFF";
    case sensor::FileRefusal::kEncrypted:
      return "FILE_ENCRYPTED";
    case sensor::FileRefusal::kFormatNotRead:
      return "FORMAT_NOT_READ";
    case sensor::FileRefusal::kStationMissing:
      return "STATION_MISSING";
    case sensor::FileRefusal::kNone:
      break;
  }
  return "FILE_UNSOUND";
}

// Of an error of the reader beyond what kind of file it is.
std::string ReasonOf(const absl::Status& status) {
  if (std::string reason = contract::ReasonOf(status); !reason.empty()) return reason;
  if (absl::IsFailedPrecondition(status)) return "FILE_NOT_READ";
  return confinement::IsBeyondAllowance(status) ? "FILE_TOO_COSTLY" : "FILE_UNSOUND";
}

absl::Status Lost(absl::string_view what) {
  return contract::ErrorWithReason(absl::StatusCode::kDataLoss, "FILE_LOST", what);
}

bool IsGivenUp(const absl::Status& status) { return absl::IsCancelled(status); }

v1::Piece PieceOf(absl::string_view bytes, int64_t sequence, int64_t offset) {
  v1::Piece piece;
  piece.set_sequence(sequence);
  piece.set_offset(offset);
  piece.set_uncompressed_size_bytes(static_cast<int64_t>(bytes.size()));
  piece.set_crc32c(bytes::Crc32c(bytes));
  std::string compressed = bytes::ZstdCompress(bytes);
  if (compressed.size() < bytes.size()) {
    piece.set_data(std::move(compressed));
    piece.set_compression(v1::COMPRESSION_ZSTD);
  } else {
    piece.set_data(bytes.data(), bytes.size());
  }
  return piece;
}

}  // namespace

FileReading::Outcome FileReading::Fail(absl::StatusCode code, const std::string& reason,
                                       absl::string_view message) {
  why_ = contract::ErrorWithReason(code, reason, contract::ValidText(message, kMostNotesBytes));
  return Outcome::kFailed;
}

FileReading::Outcome FileReading::Later(const absl::Status& why) {
  why_ = why;
  upload_->SetReading(0, 0, std::string(why.message()));
  return Outcome::kLater;
}

void FileReading::Note(const std::string& name, const std::string& what) {
  std::string note = name.empty() ? what : absl::StrCat(name, ": ", what);
  // What is read again after a wait is told once.
  if (std::find(notes_.begin(), notes_.end(), note) == notes_.end()) {
    notes_.push_back(std::move(note));
  }
}

void FileReading::Refuse(const std::string& name, const absl::Status& why) {
  if (first_refusal_.ok()) first_refusal_ = why;
  Note(name, absl::StrCat("not taken: ", why.message()));
}

std::string FileReading::Notes() const {
  return contract::ValidText(absl::StrJoin(notes_, "; "), kMostNotesBytes);
}

bool FileReading::IsScan(size_t setup) const {
  bool is = false;
  context_.journal().Read([&](const SessionState& state) {
    const auto file = state.files.find(asked_.name());
    is = file != state.files.end() &&
         file->second.setups.count(static_cast<int32_t>(setup) + 1) != 0;
  });
  return is;
}

size_t FileReading::Scans() const {
  size_t count = 0;
  context_.journal().Read([&](const SessionState& state) {
    const auto file = state.files.find(asked_.name());
    if (file != state.files.end()) count = file->second.setups.size();
  });
  return count;
}

absl::Status FileReading::CheckRoom() const {
  absl::Status room;
  context_.journal().Read([&](const SessionState& state) {
    room = intake_.CheckRoom(state, asked_.name());
    // Once it has waited, half of the places are to be free, so that the file is not opened for
    // each.
    const auto most = static_cast<int>(dependencies_.limits.pending_scans_per_session);
    if (room.ok() && waited_ && state.PendingScans() > most / 2) {
      room = absl::ResourceExhaustedError(
          absl::StrCat(state.PendingScans(), " scans wait to be registered and merged"));
    }
  });
  if (contract::ReasonOf(room) == "TOO_MANY_PENDING_SCANS") {
    return absl::ResourceExhaustedError("other scans wait to be registered and merged");
  }
  return room;
}

FileReading::Outcome FileReading::Run(const FileReadings::GivenUp& given_up) {
  if (absl::Status room = CheckRoom();
      absl::IsResourceExhausted(room) && contract::ReasonOf(room) != "TOO_MANY_SCANS") {
    waited_ = true;
    return Later(room);
  }
  waited_ = false;
  std::optional<MemoryAccount::Reservation> memory;
  if (dependencies_.memory != nullptr) {
    const int64_t times = asked_.file().has_station() ? kTimesLoosePoints : 1;
    memory = dependencies_.memory->Take(context_.tenant(),
                                        kBytesBeside + times * asked_.total().encoded_size_bytes());
    if (!memory.has_value()) {
      return Later(absl::ResourceExhaustedError("it waits for memory, which others have"));
    }
  }
  Outcome outcome = Outcome::kGivenUp;
  const absl::Status remembered = contract::UnlessOutOfMemory([&] {
    outcome = Read(given_up);
    return absl::OkStatus();
  });
  if (remembered.ok()) return outcome;
  if (++deaths_ < kMostDeaths) return Later(remembered);
  return Fail(absl::StatusCode::kInvalidArgument, "FILE_TOO_COSTLY",
              "there is not enough memory to read the file; export it at a lower resolution");
}

absl::StatusOr<sensor::ConfinedScanFile> FileReading::Open(const FileReadings::GivenUp& given_up,
                                                           sensor::FileRefusal& refusal) {
  const absl::StatusOr<store::FileDescriptor> whole = dependencies_.store.OpenSpool(asked_.name());
  if (absl::IsNotFound(whole.status())) {
    return Lost("the file did not come along to this server; send it again");
  }
  if (absl::IsDataLoss(whole.status())) {
    return Lost("a part of the file is damaged on the server's disk; send it again");
  }
  if (!whole.ok()) return whole.status();
  struct stat about {};
  const bool there = fstat(whole->get(), &about) == 0;
  if (!there || about.st_size != asked_.total().encoded_size_bytes()) {
    return Lost("a part of the file is missing on the server's disk; send it again");
  }
  const int descriptor = fcntl(whole->get(), F_DUPFD_CLOEXEC, 0);
  if (descriptor < 0) return absl::UnavailableError("no descriptor is left to read it with");
  const std::string name =
      !asked_.file().name().empty()
          ? asked_.file().name()
          : (asked_.display_name().empty() ? "the file" : asked_.display_name());
  std::optional<Eigen::Vector3d> station;
  if (asked_.file().has_station()) {
    const v1::Vector3& at = asked_.file().station();
    station.emplace(at.x(), at.y(), at.z());
  }
  const confinement::AllowanceSettings allowance =
      FileAllowance(dependencies_, [this, given_up] { return given_up() || upload_->let_go(); });
  return sensor::ConfinedScanFile::OfContent(
      name, bytes::ByteSource::Adopt(descriptor, static_cast<uint64_t>(about.st_size), name),
      station, allowance, refusal, [this](uint64_t position, uint64_t) {
        upload_->SetReading(0, static_cast<int64_t>(position), "");
      });
}

FileReading::Outcome FileReading::Read(const FileReadings::GivenUp& given_up) {
  sensor::FileRefusal refusal = sensor::FileRefusal::kNone;
  absl::StatusOr<sensor::ConfinedScanFile> file = Open(given_up, refusal);
  if (!file.ok()) {
    const absl::Status& why = file.status();
    if (IsGivenUp(why)) return Outcome::kGivenUp;
    // The store has no room for a copy to read from, or fails.
    if (absl::IsResourceExhausted(why) || absl::IsUnavailable(why)) return Later(why);
    const bool ended = absl::IsFailedPrecondition(why) && refusal == sensor::FileRefusal::kNone;
    if (ended && ++deaths_ < kMostDeaths) return Later(why);
    return Fail(
        why.code(),
        refusal == sensor::FileRefusal::kNone ? ReasonOf(why) : std::string(ReasonOf(refusal)),
        why.message());
  }
  const size_t count = file->setups().size();
  upload_->SetReading(static_cast<int32_t>(std::min<size_t>(count, 1'000'000'000)), 0, "");
  if (count > 1 && (asked_.has_prior() || !asked_.targets().empty())) {
    Note("", absl::StrCat("the file has ", count, " set-ups, so the ",
                          asked_.has_prior() ? "place" : "targets",
                          " that came along, which one scan has, went unused"));
  }
  for (size_t setup = 0; setup < count; ++setup) {
    if (IsScan(setup) || refused_.count(setup) != 0) continue;
    if (given_up() || upload_->let_go()) return Outcome::kGivenUp;
    if (absl::Status room = CheckRoom(); !room.ok()) {
      if (contract::ReasonOf(room) == "TOO_MANY_SCANS") {
        Refuse(NameOf(file->setups(), setup), room);
        break;
      }
      waited_ = true;
      return Later(room);
    }
    const absl::Status read = ReadSetup(*file, setup);
    if (read.ok()) continue;
    if (IsGivenUp(read) || absl::IsAborted(read)) return Outcome::kGivenUp;
    return Later(read);
  }
  if (Scans() > 0) return Outcome::kRead;
  return Fail(first_refusal_.code(), ReasonOf(first_refusal_),
              count == 1 ? std::string(first_refusal_.message()) : Notes());
}

absl::Status FileReading::ReadSetup(sensor::ConfinedScanFile& file, size_t setup) {
  const std::string name = NameOf(file.setups(), setup);
  sensor::ImportLimits limits;
  if (asked_.file().unit_m() > 0) limits.unit = asked_.file().unit_m();
  limits.appearance = {asked_.file().intensity(), asked_.file().colour()};
  absl::StatusOr<sensor::ImportedScan> scan = file.Read(setup, limits);
  if (!scan.ok()) {
    if (IsGivenUp(scan.status())) return scan.status();
    if (absl::IsFailedPrecondition(scan.status()) && ++deaths_ < kMostDeaths) return scan.status();
    refused_.insert(setup);
    Refuse(name, contract::ErrorWithReason(
                     scan.status().code(), ReasonOf(scan.status()),
                     contract::ValidText(scan.status().message(), kMostNotesBytes)));
    return absl::OkStatus();
  }
  if (limits.appearance.intensity && !scan->appearance.intensity) {
    Note(name, "there is no intensity in it");
  }
  if (limits.appearance.colour && !scan->appearance.colour) Note(name, "there is no colour in it");
  if (scan->far > 0) {
    Note(name, absl::StrCat(scan->far,
                            " points farther than 1 km are taken as rays without a "
                            "return"));
  }
  for (const std::string& oddity : sensor::Oddities(*scan)) Note(name, oddity);
  if (scan->loose && scan->apart > kSeveralStations) {
    Note(name, absl::StrFormat("%.1f %% of the points lie far before or behind others: if the file "
                               "has the points of several stations, send those of each by "
                               "themselves",
                               100 * scan->apart));
  }
  ScanIntake::Arrival arrival;
  arrival.upload = Describe(file, setup, *scan);
  arrival.file_setup = static_cast<int32_t>(setup) + 1;
  if (asked_.preview()) {
    const double step =
        asked_.file().preview_step_rad() > 0 ? asked_.file().preview_step_rad() : kUsualPreviewStep;
    sensor::RangeImage thin = sensor::Thinned(scan->image, step);
    arrival.upload.set_preview(thin.cells() < scan->image.cells());
    if (arrival.upload.preview()) scan->image = std::move(thin);
  }
  v1::CreateUploadRequest as_request;
  *as_request.mutable_upload() = arrival.upload;
  if (absl::Status fits = conversion::CheckRequest(as_request, dependencies_.limits); !fits.ok()) {
    refused_.insert(setup);
    Refuse(name, contract::ErrorWithReason(fits.code(), "FILE_UNSOUND", fits.message()));
    return absl::OkStatus();
  }
  absl::StatusOr<Upload::Content> content = Store(scan->image, setup);
  if (absl::IsInvalidArgument(content.status())) {
    refused_.insert(setup);
    Refuse(name, contract::ErrorWithReason(content.status().code(), "FILE_UNSOUND",
                                           content.status().message()));
    return absl::OkStatus();
  }
  if (!content.ok()) return content.status();
  arrival.content = *std::move(content);
  return Receive(arrival);
}

std::string FileReading::NameOf(const std::vector<std::string>& setups, size_t setup) const {
  std::string stem(asked_.display_name().empty() ? StemOf(asked_.file().name())
                                                 : asked_.display_name());
  if (stem.empty()) stem = "scan";
  if (setups.size() == 1) return stem;
  const std::string& own = setups[setup];
  const bool unique = !own.empty() && std::count(setups.begin(), setups.end(), own) == 1;
  return contract::ValidText(unique ? own : absl::StrCat(stem, "-", setup + 1), kMostNameBytes);
}

v1::Upload FileReading::Describe(const sensor::ConfinedScanFile& file, size_t setup,
                                 const sensor::ImportedScan& scan) const {
  const bool alone = file.setups().size() == 1;
  v1::Upload upload;
  upload.set_name(asked_.name());
  upload.set_display_name(NameOf(file.setups(), setup));
  upload.set_scanner(asked_.scanner());
  if (asked_.has_scanner_model()) {
    *upload.mutable_scanner_model() = asked_.scanner_model();
  } else {
    *upload.mutable_scanner_model() = conversion::WriteScannerModel(scan.scanner, "from-file");
  }
  upload.set_scanner_model_id(upload.scanner_model().id());
  if (alone && asked_.has_prior()) {
    *upload.mutable_prior() = asked_.prior();
  } else if (scan.T_world_scan.has_value() && !asked_.file().ignore_poses()) {
    *upload.mutable_prior() = conversion::WriteStatedPose(*scan.T_world_scan);
  }
  if (alone) {
    *upload.mutable_targets() = asked_.targets();
    upload.set_replaces(asked_.replaces());
  }
  return upload;
}

absl::StatusOr<Upload::Content> FileReading::Store(const sensor::RangeImage& image, size_t setup) {
  const std::string bytes = sensor::EncodeRangeImage(image);
  v1::Upload created;
  created.set_name(absl::StrCat(asked_.name(), "/setup-", setup + 1));
  created.set_state(v1::UPLOAD_STATE_OPEN);
  created.mutable_total()->set_encoded_size_bytes(static_cast<int64_t>(bytes.size()));
  created.mutable_total()->set_sha256(bytes::Sha256::Of(bytes));
  const absl::Status fits = CheckTotal(created.total(), "scan", dependencies_.limits);
  if (!fits.ok()) return fits;
  // What an earlier try left.
  if (absl::Status dropped = dependencies_.store.DropSpool(created.name()); !dropped.ok()) {
    return dropped;
  }
  Upload pieces(created, dependencies_.store, dependencies_.limits);
  const auto store = [&]() -> absl::StatusOr<Upload::Content> {
    int64_t sequence = 0;
    for (size_t at = 0; at < bytes.size(); at += kStoredPieceBytes) {
      const v1::Piece piece = PieceOf(absl::string_view(bytes).substr(at, kStoredPieceBytes),
                                      sequence++, static_cast<int64_t>(at));
      const absl::Status taken = pieces.Accept(piece, context_.journal().At());
      if (!taken.ok()) return taken;
    }
    absl::StatusOr<Upload::Content> content = pieces.Inspect();
    if (!content.ok()) return content;
    if (absl::Status synced = pieces.Sync(); !synced.ok()) return synced;
    const absl::Status kept = dependencies_.store.PutSpool(created.name(), content->sha256);
    if (!kept.ok()) return kept;
    return content;
  };
  absl::StatusOr<Upload::Content> content = store();
  pieces.End(v1::UPLOAD_STATE_COMMITTED, "", "");
  return content;
}

absl::Status FileReading::Receive(const ScanIntake::Arrival& arrival) {
  const int64_t bytes = arrival.content.encoded_size;
  std::lock_guard<std::mutex> only_one(upload_->commit_mutex());
  const auto let_go = [&](const absl::Status& why) {
    dependencies_.store.ReleaseBlob(arrival.content.sha256).IgnoreError();
    return why;
  };
  if (upload_->let_go()) return let_go(absl::AbortedError("the upload has ended"));
  if (absl::Status room = upload_->TakeRoomForScan(bytes); !room.ok()) return let_go(room);
  const absl::StatusOr<std::string> name = intake_.Take(arrival, asked_.name());
  if (!name.ok()) {
    upload_->GiveBackRoomOfScan(bytes);
    if (absl::IsFailedPrecondition(name.status()) || absl::IsInvalidArgument(name.status())) {
      refused_.insert(static_cast<size_t>(arrival.file_setup) - 1);
      Refuse(arrival.upload.display_name(), name.status());
      return absl::OkStatus();
    }
    return absl::IsAlreadyExists(name.status()) ? absl::OkStatus() : name.status();
  }
  upload_->ScanReceived(*name, context_.journal().At());
  dependencies_.log.Info("scan received", {{"session", context_.id()},
                                           {"scan", *name},
                                           {"file", asked_.name()},
                                           {"setup", arrival.file_setup},
                                           {"bytes", bytes}});
  reconciler_.Post(*name);
  return absl::OkStatus();
}

}  // namespace vantage::session

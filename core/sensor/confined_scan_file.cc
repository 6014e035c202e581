#include "core/sensor/confined_scan_file.h"

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/confinement/allowance.h"
#include "core/confinement/answer.h"
#include "core/confinement/bulk.h"
#include "core/sensor/scan_answer.h"

namespace vantage::sensor {
namespace {

constexpr char kReaderName[] = "scan-file";

// The most memory that a reader takes for a point that no grid holds, in all its steps, bytes; for
// what does not depend on the file; and times the file, of formats that are read as a whole.
// Measured: 96 of a cloud of loose points and 100 of a leaning grid, of four million each.
constexpr uint64_t kBytesOfPoint = 160;
constexpr uint64_t kBytesInAnyCase = 256 << 20;
constexpr uint64_t kTimesTheFile = 2;

uint64_t MemoryFor(uint64_t file_bytes) {
  // No format has a point in less than a byte but for tricks, which the first 256 MB are room for.
  const uint64_t points = std::min<uint64_t>(file_bytes, ImportLimits().max_points);
  return kBytesInAnyCase + kTimesTheFile * file_bytes + kBytesOfPoint * points;
}

// The two questions, trusted by the reader: the first opens, all others read.
struct Opening {
  uint32_t has_station = 0;
  uint32_t path_bytes = 0;
  uint32_t by_content = 0;
  uint32_t unused = 0;
  double station[3] = {};
};

struct Reading {
  uint64_t setup = 0;
  uint64_t max_points = 0;
  double range_min = 0;
  double blind_zone = 0;
  double unit = 0;
  uint32_t intensity = 0;
  uint32_t colour = 0;
};

template <typename T>
std::string Packed(const T& value) {
  return {reinterpret_cast<const char*>(&value), sizeof(value)};
}

// Nothing where it is of another size.
template <typename T>
std::optional<T> Unpacked(absl::string_view bytes) {
  if (bytes.size() != sizeof(T)) return std::nullopt;
  T value;
  std::memcpy(&value, bytes.data(), sizeof(T));
  return value;
}

// `refusal` is set where the content was asked for.
absl::StatusOr<ScanFile> OpenAsAsked(const std::string& question, confinement::Asker& asker,
                                     std::optional<FileRefusal>& refusal) {
  const auto opening = Unpacked<Opening>(absl::string_view(question).substr(0, sizeof(Opening)));
  if (!opening || question.size() != sizeof(Opening) + opening->path_bytes) {
    return absl::InternalError("asked to open nothing");
  }
  const std::string path = question.substr(sizeof(Opening));
  std::optional<Eigen::Vector3d> station;
  if (opening->has_station != 0) {
    station.emplace(opening->station[0], opening->station[1], opening->station[2]);
  }
  bytes::ByteSource source = bytes::ByteSource::Adopt(asker.file(), asker.file_bytes(), path);
  const auto reached = [&asker](uint64_t position, uint64_t) { asker.Reached(position); };
  if (opening->by_content == 0) {
    return ScanFile::OfSource(path, station, std::move(source), reached);
  }
  return ScanFile::OfContent(path, station, std::move(source), refusal.emplace(FileRefusal::kNone),
                             reached);
}

void ReadAsAsked(confinement::Asker& asker) {
  const std::optional<std::string> first = asker.Next();
  if (!first) return;
  std::optional<FileRefusal> refusal;
  const absl::StatusOr<ScanFile> file = OpenAsAsked(*first, asker, refusal);
  const auto say = [&](absl::string_view bytes) { asker.Say(bytes); };
  if (refusal) confinement::SayValue(static_cast<uint32_t>(*refusal), say);
  if (file.ok()) SaySetups(file->setups(), say);
  asker.End(file.status());
  if (!file.ok()) return;
  while (const std::optional<std::string> next = asker.Next()) {
    const auto reading = Unpacked<Reading>(*next);
    if (!reading) return;
    ImportLimits limits;
    limits.max_points = reading->max_points;
    limits.range_min = reading->range_min;
    limits.blind_zone = reading->blind_zone;
    limits.unit = reading->unit;
    limits.appearance = {reading->intensity != 0, reading->colour != 0};
    const absl::StatusOr<ImportedScan> scan = file->Read(reading->setup, limits);
    if (scan.ok()) SayScan(*scan, say);
    asker.End(scan.status());
  }
}

}  // namespace

confinement::Reader ScanFileReader() { return {kReaderName, ReadAsAsked}; }

absl::StatusOr<ConfinedScanFile> ConfinedScanFile::Open(
    const std::string& path, const std::optional<Eigen::Vector3d>& station,
    const confinement::AllowanceSettings& allowance, const ScanFile::Reached& reached) {
  absl::StatusOr<bytes::ByteSource> source = ScanFile::OpenSource(path, station);
  if (!source.ok()) return source.status();
  const uint64_t size = source->size();
  ConfinedScanFile file(path, station, confinement::AllowanceOf(size, MemoryFor(size), allowance),
                        reached, *std::move(source));
  absl::StatusOr<std::vector<std::string>> setups = file.Start(nullptr);
  if (!setups.ok()) return setups.status();
  file.setups_ = *std::move(setups);
  return file;
}

absl::StatusOr<ConfinedScanFile> ConfinedScanFile::OfContent(
    const std::string& name, bytes::ByteSource source,
    const std::optional<Eigen::Vector3d>& station, const confinement::AllowanceSettings& allowance,
    FileRefusal& refusal, const ScanFile::Reached& reached) {
  const uint64_t size = source.size();
  ConfinedScanFile file(name.substr(0, kMaxName), station,
                        confinement::AllowanceOf(size, MemoryFor(size), allowance), reached,
                        std::move(source));
  file.by_content_ = true;
  absl::StatusOr<std::vector<std::string>> setups = file.Start(&refusal);
  if (!setups.ok()) return setups.status();
  file.setups_ = *std::move(setups);
  return file;
}

absl::StatusOr<std::vector<std::string>> ConfinedScanFile::Start(FileRefusal* refusal) {
  absl::StatusOr<confinement::Child> reader =
      confinement::Child::Start(kReaderName, source_.descriptor(), allowance_);
  if (!reader.ok()) {
    return absl::Status(reader.status().code(),
                        absl::StrCat(path_, ": ", reader.status().message()));
  }
  reader_.emplace(*std::move(reader));
  Opening opening;
  opening.path_bytes = static_cast<uint32_t>(path_.size());
  opening.by_content = by_content_ ? 1 : 0;
  if (station_) {
    opening.has_station = 1;
    std::copy(station_->data(), station_->data() + 3, opening.station);
  }
  std::vector<std::string> setups;
  const absl::Status asked = Ask(Packed(opening) + path_, [&](confinement::Answer& answer) {
    const auto hear = [&](char* to, size_t size) { return answer.Read(to, size); };
    if (by_content_) {
      uint32_t said = 0;
      if (absl::Status heard = confinement::HearValue(hear, said); !heard.ok()) return heard;
      if (said > static_cast<uint32_t>(FileRefusal::kStationMissing)) {
        return absl::InvalidArgumentError("a refusal that there is not");
      }
      if (refusal != nullptr) *refusal = static_cast<FileRefusal>(said);
    }
    auto heard = HearSetups(hear, answer.left());
    if (!heard.ok()) return heard.status();
    setups = *std::move(heard);
    return absl::OkStatus();
  });
  if (!asked.ok()) return asked;
  return setups;
}

absl::Status ConfinedScanFile::Ask(const std::string& question, confinement::Child::Take take) {
  const auto reached = [&](uint64_t position) {
    if (reached_) reached_(std::min(position, source_.size()), source_.size());
  };
  absl::Status asked = reader_->Ask(question, reached, take);
  // The reader's own words name the file already.
  if (asked.ok() || absl::StartsWith(asked.message(), path_)) return asked;
  return confinement::Reworded(asked, absl::StrCat(path_, ": ", asked.message()));
}

absl::StatusOr<ImportedScan> ConfinedScanFile::Read(size_t setup, const ImportLimits& limits) {
  if (!reader_->alive()) {
    const absl::StatusOr<std::vector<std::string>> setups = Start(nullptr);
    if (!setups.ok()) return setups.status();
    if (*setups != setups_) {
      return absl::InvalidArgumentError(
          absl::StrCat(path_, ": it has changed while it was read; read it again"));
    }
  }
  Reading reading;
  reading.setup = setup;
  reading.max_points = limits.max_points;
  reading.range_min = limits.range_min;
  reading.blind_zone = limits.blind_zone;
  reading.unit = limits.unit;
  reading.intensity = limits.appearance.intensity ? 1 : 0;
  reading.colour = limits.appearance.colour ? 1 : 0;
  absl::StatusOr<ImportedScan> scan = absl::InternalError("nothing was read");
  const absl::Status asked = Ask(Packed(reading), [&](confinement::Answer& answer) {
    scan = HearScan([&](char* to, size_t size) { return answer.Read(to, size); }, answer.left());
    return scan.status();
  });
  if (!asked.ok()) return asked;
  return scan;
}

}  // namespace vantage::sensor

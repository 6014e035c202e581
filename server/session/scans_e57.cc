#include "server/session/scans_e57.h"

#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/bytes/checksum.h"
#include "server/conversion/to_proto.h"

namespace vantage::session {
namespace {

constexpr size_t kRecordsPerPart = 1 << 16;  // 2 MiB

std::string GuidOf(const std::string& bytes) {
  const std::string hex = absl::BytesToHexString(bytes::Sha256::Of(bytes).substr(0, 16));
  return absl::StrCat("{", hex.substr(0, 8), "-", hex.substr(8, 4), "-", hex.substr(12, 4), "-",
                      hex.substr(16, 4), "-", hex.substr(20), "}");
}

e57::Writer WriterOf(const std::vector<v1::Scan>& scans) {
  std::vector<e57::SetupToWrite> setups;
  std::string all;
  for (const v1::Scan& scan : scans) {
    e57::SetupToWrite& setup = setups.emplace_back();
    setup.name = scan.display_name().empty() ? scan.name() : scan.display_name();
    setup.guid = GuidOf(absl::StrCat(scan.name(), "\n", scan.sha256()));
    // Its pose as it is in the log, to the bit.
    const v1::Quaternion& q = scan.pose().rotation();
    setup.R_file_setup = Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z());
    setup.t_file_setup = conversion::ReadOwnVector(scan.pose().translation());
    setup.columns = static_cast<uint32_t>(scan.column_count());
    setup.rows = static_cast<uint32_t>(scan.row_count());
    setup.records = static_cast<uint64_t>(scan.sample_count());
    setup.intensity = scan.intensity();
    setup.colour = scan.colour();
    absl::StrAppend(&all, setup.guid);
  }
  return {std::move(setups), GuidOf(all)};
}

}  // namespace

ScansE57::ScansE57(const Scans& stored, const std::vector<v1::Scan>& scans)
    : stored_(stored), scans_(scans), writer_(WriterOf(scans)) {}

absl::StatusOr<std::string> ScansE57::Next() {
  std::string bytes;
  if (!begun_) {
    begun_ = true;
    bytes = writer_.Begin();
  }
  while (bytes.empty() && scan_ < scans_.size()) {
    if (!image_.has_value()) {
      absl::StatusOr<sensor::RangeImage> loaded = stored_.LoadImage(scans_[scan_].name());
      if (!loaded.ok()) return loaded.status();
      image_ = *std::move(loaded);
      cell_ = 0;
      written_ = 0;
    }
    std::vector<e57::SphericalRecord> records;
    const size_t rows = image_->elevation.size();
    for (; cell_ < image_->cells() && records.size() < kRecordsPerPart; ++cell_) {
      if (!sensor::RangeImage::IsRange(image_->range[cell_])) continue;
      e57::SphericalRecord& record = records.emplace_back();
      record.range = static_cast<double>(image_->range[cell_]);
      record.column = static_cast<uint32_t>(cell_ / rows);
      record.row = static_cast<uint32_t>(cell_ % rows);
      record.azimuth = image_->azimuth[record.column];
      record.elevation = image_->elevation[record.row];
      const sensor::Appearance& looks = image_->appearance;
      if (!looks.intensity.empty()) record.intensity = looks.intensity[cell_];
      if (!looks.colour.empty()) record.colour = looks.colour[cell_];
    }
    written_ += records.size();
    bytes = writer_.Add(records);
    if (cell_ < image_->cells()) continue;
    if (written_ != static_cast<uint64_t>(scans_[scan_].sample_count())) {
      return absl::AbortedError(
          absl::StrCat(scans_[scan_].name(), " changed while it was exported; try again"));
    }
    image_.reset();
    ++scan_;
    if (scan_ == scans_.size()) bytes += writer_.End();
  }
  return bytes;
}

}  // namespace vantage::session

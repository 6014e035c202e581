#include "core/sensor/encoding.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/bytes/byte_order.h"

namespace vantage::sensor {
namespace {

constexpr absl::string_view kMagic = "VRIM";
constexpr uint16_t kVersion = 1;
constexpr uint16_t kFullTurn = 1;
constexpr uint16_t kIntensity = 2;
constexpr uint16_t kColour = 4;
constexpr size_t kIntensityPlanes = 2;  // of a byte a cell
constexpr size_t kColourPlanes = 3;
constexpr uint64_t kMaxLines = 1 << 18;  // columns or rows; bounds the memory of a decoder
constexpr uint32_t kMaxUnits = 10'000'000;
constexpr uint32_t kNoReturnCode = 0;
constexpr uint32_t kNoInformationCode = 1;
constexpr uint32_t kFirstDifferenceCode = 2;

// The range in units; 0 is no return.
uint32_t Units(float range) {
  if (!RangeImage::IsRange(range)) return 0;
  const double units = std::round(static_cast<double>(range) / kEncodedRangeUnit);
  if (units > kMaxUnits) return 0;
  return units < 1 ? 1 : static_cast<uint32_t>(units);
}

uint32_t ZigZag(int32_t d) {
  return d >= 0 ? 2 * static_cast<uint32_t>(d) : 2 * static_cast<uint32_t>(-(d + 1)) + 1;
}

int64_t UnZigZag(uint32_t z) {
  return (z & 1) != 0 ? -static_cast<int64_t>(z >> 1) - 1 : static_cast<int64_t>(z >> 1);
}

// The codes of a column, whose bytes lie in four planes. The compiler turns the loop into vector
// instructions.
void GatherCodes(const char* planes, size_t rows, uint32_t* codes) {
  const auto* lowest = reinterpret_cast<const uint8_t*>(planes);
  const uint8_t* second = lowest + rows;
  const uint8_t* third = second + rows;
  const uint8_t* highest = third + rows;
  for (size_t row = 0; row < rows; ++row) {
    codes[row] = static_cast<uint32_t>(lowest[row]) | static_cast<uint32_t>(second[row]) << 8 |
                 static_cast<uint32_t>(third[row]) << 16 |
                 static_cast<uint32_t>(highest[row]) << 24;
  }
}

// The number of ranges in a column, or none when one is out of bounds. Unless it is null, `cells`
// gets what the codes stand for.
std::optional<size_t> DecodeColumn(const std::vector<uint32_t>& codes, float* cells) {
  int64_t before = 0;
  size_t ranges = 0;
  for (size_t row = 0; row < codes.size(); ++row) {
    const uint32_t code = codes[row];
    if (code < kFirstDifferenceCode) {
      if (cells != nullptr) {
        cells[row] = code == kNoReturnCode ? RangeImage::kNoReturn : RangeImage::kNoInformation;
      }
      continue;
    }
    before += UnZigZag(code - kFirstDifferenceCode);
    if (before < 1 || before > kMaxUnits) return std::nullopt;
    ++ranges;
    if (cells != nullptr) {
      cells[row] = static_cast<float>(static_cast<double>(before) * kEncodedRangeUnit);
    }
  }
  return ranges;
}

absl::Status NoHeader(size_t size) {
  return absl::InvalidArgumentError(
      absl::StrCat("range image: ", size, " bytes that do not begin with a header (magic ", kMagic,
                   "); send an encoded range image, not a PTX or PCD file"));
}

size_t PlanesOf(const AppearanceKinds& appearance) {
  return 4 + (appearance.intensity ? kIntensityPlanes : 0) +
         (appearance.colour ? kColourPlanes : 0);
}

absl::Status WrongSize(size_t size, uint64_t columns, uint64_t rows,
                       const AppearanceKinds& appearance) {
  return absl::InvalidArgumentError(
      absl::StrCat("range image: ", size, " bytes, but ", columns, " columns x ", rows,
                   " rows take ", EncodedSize(columns, rows, appearance),
                   "; the data are truncated or padded: send them again"));
}

}  // namespace

size_t EncodedSize(size_t columns, size_t rows, AppearanceKinds appearance) {
  return RangeImageDecoder::kHeaderBytes + 8 * rows + columns * (8 + PlanesOf(appearance) * rows);
}

std::string EncodeRangeImage(const RangeImage& image) {
  const size_t rows = image.elevation.size();
  std::string out;
  const AppearanceKinds appearance = image.appearance.kinds();
  out.reserve(EncodedSize(image.azimuth.size(), rows, appearance));
  out.append(kMagic.data(), kMagic.size());
  bytes::AppendLittleEndian(kVersion, out);
  bytes::AppendLittleEndian(static_cast<uint16_t>((image.full_turn ? kFullTurn : 0) |
                                                  (appearance.intensity ? kIntensity : 0) |
                                                  (appearance.colour ? kColour : 0)),
                            out);
  bytes::AppendLittleEndian(static_cast<uint32_t>(image.azimuth.size()), out);
  bytes::AppendLittleEndian(static_cast<uint32_t>(rows), out);
  bytes::AppendLittleEndian(image.native_azimuth_step, out);
  bytes::AppendLittleEndian(image.native_elevation_step, out);
  for (const double elevation : image.elevation) bytes::AppendLittleEndian(elevation, out);
  for (size_t column = 0; column < image.azimuth.size(); ++column) {
    bytes::AppendLittleEndian(image.azimuth[column], out);
    const size_t planes = out.size();
    out.resize(planes + PlanesOf(appearance) * rows);
    const size_t intensities = planes + 4 * rows;
    const size_t colours = intensities + (appearance.intensity ? kIntensityPlanes * rows : 0);
    int32_t before = 0;
    for (size_t row = 0; row < rows; ++row) {
      const float range = image.range[column * rows + row];
      uint32_t code = kNoReturnCode;
      if (range == RangeImage::kNoInformation) {
        code = kNoInformationCode;
      } else if (const auto units = static_cast<int32_t>(Units(range)); units > 0) {
        code = kFirstDifferenceCode + ZigZag(units - before);
        before = units;
        const size_t cell = column * rows + row;
        if (appearance.intensity) {
          const uint16_t value = image.appearance.intensity[cell];
          out[intensities + row] = static_cast<char>(value);
          out[intensities + rows + row] = static_cast<char>(value >> 8);
        }
        for (size_t part = 0; appearance.colour && part < kColourPlanes; ++part) {
          out[colours + part * rows + row] = static_cast<char>(image.appearance.colour[cell][part]);
        }
      }
      for (size_t plane = 0; plane < 4; ++plane) {
        out[planes + plane * rows + row] = static_cast<char>(code >> (8 * plane));
      }
    }
  }
  return out;
}

absl::Status RangeImageDecoder::Take(absl::string_view bytes) {
  while (status_.ok() && !bytes.empty()) {
    if (part_ == Part::kEnd) {
      taken_ += bytes.size();
      status_ = WrongSize(taken_, announced_columns_, announced_rows_, appearance_);
      break;
    }
    // A part that is complete in these bytes is read in place.
    const size_t size = std::min(part_bytes_ - begun_.size(), bytes.size());
    absl::string_view part = bytes.substr(0, size);
    bytes.remove_prefix(size);
    taken_ += size;
    if (!begun_.empty() || size < part_bytes_) {
      begun_.append(part.data(), part.size());
      if (begun_.size() < part_bytes_) break;
      part = begun_;
    }
    status_ = TakePart(part);
    begun_.clear();
  }
  return status_;
}

absl::StatusOr<RangeImageDecoder::Contents> RangeImageDecoder::Finish() {
  if (!status_.ok()) return status_;
  if (part_ == Part::kHeader) {
    status_ = NoHeader(taken_);
  } else if (part_ != Part::kEnd) {
    status_ = WrongSize(taken_, announced_columns_, announced_rows_, appearance_);
  } else if (absl::Status axes = image_.ValidateAxes(); !axes.ok()) {
    status_ = axes;
  } else if (samples_ == 0) {
    status_ = absl::InvalidArgumentError("range image: no cell holds a range");
  }
  if (!status_.ok()) return status_;
  return Contents{image_.azimuth.size(), image_.elevation.size(), samples_, appearance_};
}

absl::StatusOr<RangeImage> RangeImageDecoder::FinishImage() && {
  if (absl::Status whole = Finish().status(); !whole.ok()) return whole;
  return std::move(image_);
}

absl::Status RangeImageDecoder::TakePart(absl::string_view bytes) {
  switch (part_) {
    case Part::kHeader:
      return TakeHeader(bytes);
    case Part::kElevations:
      for (size_t row = 0; row < announced_rows_; ++row) {
        image_.elevation.push_back(bytes::LoadLittleEndian<double>(bytes.data() + 8 * row));
      }
      part_ = Part::kColumn;
      part_bytes_ = 8 + PlanesOf(appearance_) * announced_rows_;
      codes_.resize(announced_rows_);
      return absl::OkStatus();
    case Part::kColumn:
      return TakeColumn(bytes);
    case Part::kEnd:
      break;
  }
  return absl::OkStatus();
}

absl::Status RangeImageDecoder::TakeHeader(absl::string_view bytes) {
  if (bytes.substr(0, kMagic.size()) != kMagic) return NoHeader(taken_);
  const auto version = bytes::LoadLittleEndian<uint16_t>(bytes.data() + 4);
  if (version != kVersion) {
    return absl::InvalidArgumentError(absl::StrCat("range image: version ", version,
                                                   " is not known; this build reads ", kVersion));
  }
  const auto flags = bytes::LoadLittleEndian<uint16_t>(bytes.data() + 6);
  if ((flags & ~(kFullTurn | kIntensity | kColour)) != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("range image: flags ", flags, " are not known; only bits 0 to 2 may be set"));
  }
  appearance_ = {(flags & kIntensity) != 0, (flags & kColour) != 0};
  const uint64_t columns = bytes::LoadLittleEndian<uint32_t>(bytes.data() + 8);
  const uint64_t rows = bytes::LoadLittleEndian<uint32_t>(bytes.data() + 12);
  if (columns < 2 || rows < 2) {
    return absl::InvalidArgumentError(absl::StrCat("range image: ", columns, " columns x ", rows,
                                                   " rows; at least 2 x 2 are needed"));
  }
  if (columns > max_cells_ || rows > max_cells_ / columns) {
    return absl::InvalidArgumentError(absl::StrCat(
        "range image: ", columns, " columns x ", rows, " rows are more than the limit of ",
        max_cells_, " cells; thin the scan (and keep the native steps)"));
  }
  if (columns > kMaxLines || rows > kMaxLines) {
    return absl::InvalidArgumentError(absl::StrCat("range image: ", columns, " columns x ", rows,
                                                   " rows; no more than ", kMaxLines,
                                                   " of each; thin the scan"));
  }
  announced_columns_ = columns;
  announced_rows_ = rows;
  image_.full_turn = (flags & kFullTurn) != 0;
  image_.native_azimuth_step = bytes::LoadLittleEndian<double>(bytes.data() + 16);
  image_.native_elevation_step = bytes::LoadLittleEndian<double>(bytes.data() + 24);
  part_ = Part::kElevations;
  part_bytes_ = 8 * rows;
  return absl::OkStatus();
}

absl::Status RangeImageDecoder::TakeColumn(absl::string_view bytes) {
  GatherCodes(bytes.data() + 8, announced_rows_, codes_.data());
  float* cells = nullptr;
  if (keep_ != Keep::kNothing) {
    image_.range.resize(image_.range.size() + announced_rows_);
    cells = &image_.range[image_.range.size() - announced_rows_];
  }
  const std::optional<size_t> samples = DecodeColumn(codes_, cells);
  if (!samples.has_value()) {
    return absl::InvalidArgumentError(absl::StrCat("range image: column ", image_.azimuth.size(),
                                                   " holds a range outside 0.1 mm to 1 km"));
  }
  image_.azimuth.push_back(bytes::LoadLittleEndian<double>(bytes.data()));
  samples_ += *samples;
  if (appearance_.any()) {
    absl::Status taken = TakeAppearance(bytes.substr(8 + 4 * announced_rows_));
    if (!taken.ok()) return taken;
  }
  if (image_.azimuth.size() == announced_columns_) part_ = Part::kEnd;
  return absl::OkStatus();
}

absl::Status RangeImageDecoder::TakeAppearance(absl::string_view bytes) {
  const size_t rows = announced_rows_;
  const auto plane = [&](size_t number) {
    return reinterpret_cast<const uint8_t*>(bytes.data()) + number * rows;
  };
  const size_t planes = PlanesOf(appearance_) - 4;
  for (size_t number = 0; number < planes; ++number) {
    const uint8_t* values = plane(number);
    for (size_t row = 0; row < rows; ++row) {
      if (codes_[row] >= kFirstDifferenceCode || values[row] == 0) continue;
      return absl::InvalidArgumentError(absl::StrCat("range image: column ",
                                                     image_.azimuth.size() - 1, " row ", row,
                                                     " has intensity or colour and no range"));
    }
  }
  if (keep_ != Keep::kAll) return absl::OkStatus();
  if (appearance_.intensity) {
    for (size_t row = 0; row < rows; ++row) {
      image_.appearance.intensity.push_back(
          static_cast<uint16_t>(plane(0)[row] | plane(1)[row] << 8));
    }
  }
  if (appearance_.colour) {
    const size_t red = appearance_.intensity ? kIntensityPlanes : 0;
    for (size_t row = 0; row < rows; ++row) {
      image_.appearance.colour.push_back(
          {plane(red)[row], plane(red + 1)[row], plane(red + 2)[row]});
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<RangeImage> DecodeRangeImage(absl::string_view bytes, size_t max_cells,
                                            RangeImageDecoder::Keep keep) {
  RangeImageDecoder decoder(max_cells, keep);
  decoder.Take(bytes).IgnoreError();  // the decoder keeps the error
  return std::move(decoder).FinishImage();
}

}  // namespace vantage::sensor

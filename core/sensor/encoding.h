// A range image as bytes, as it is sent and stored. Little-endian throughout.
//
//   offset  size      what
//        0     4      magic "VRIM"
//        4     2      version, 1 (u16)
//        6     2      flags (u16): bit 0 full turn, bit 1 intensity, bit 2 colour; all others 0
//        8     4      columns (u32), 2 to 262,144
//       12     4      rows (u32), 2 to 262,144
//       16     8      native azimuth step, rad (f64)
//       24     8      native elevation step, rad (f64)
//       32     8 rows elevations, rad (f64), rising
//   then, for each column in order of rising azimuth, 8 + 4 rows bytes (and 2 rows of intensity,
//   3 rows of colour):
//        0     8      azimuth, rad (f64)
//        8     4 rows its cells from bottom to top, one u32 code each, as four planes: the lowest
//                     bytes of all codes, then the second lowest, the third, the highest
//      ...     2 rows intensities of the same cells (u16), as two planes: the lower bytes, the
//      upper
//      ...     3 rows colours of the same cells, as three planes: red, green, blue
//
// A range is a whole number of 0.1 mm from 1 to 10,000,000 (1 km). The code of a cell is
//   0      no return
//   1      no information
//   2 + z  a range that differs by d from the range before it in the same column (0 before the
//          first one); z = 2 d for d >= 0 and -2 d - 1 for d < 0
// Differences are small and split into planes their upper bytes are runs of zeros, which general
// compressors shorten well. Nothing refers back beyond its column: a scanner can send each column
// as soon as it has turned past it, and pieces may be cut anywhere.
//
// A cell without a range has no intensity or colour: 0.
//
// Every valid image has exactly one encoding, so equal bytes and equal images mean the same.
#ifndef VANTAGE_CORE_SENSOR_ENCODING_H_
#define VANTAGE_CORE_SENSOR_ENCODING_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/sensor/appearance.h"
#include "core/sensor/range_image.h"

namespace vantage::sensor {

inline constexpr double kEncodedRangeUnit = 1e-4;  // m

// The size of an encoding, bytes.
size_t EncodedSize(size_t columns, size_t rows, AppearanceKinds appearance = {});

// `image` must be valid. Ranges are rounded to 0.1 mm, but never to 0; beyond 1 km they become no
// return.
std::string EncodeRangeImage(const RangeImage& image);

// Decodes an encoding that arrives in pieces, cut anywhere, and checks each piece as it arrives.
class RangeImageDecoder {
 public:
  static constexpr size_t kHeaderBytes = 32;
  // Of the cells. What is not kept costs no memory.
  enum class Keep { kNothing, kRanges, kAll };
  // Of a whole image.
  struct Contents {
    size_t columns = 0;
    size_t rows = 0;
    size_t samples = 0;  // cells that hold a range
    AppearanceKinds appearance;
  };

  RangeImageDecoder(size_t max_cells, Keep keep) : max_cells_(max_cells), keep_(keep) {}

  // Takes the next bytes. After an error every call returns it. INVALID_ARGUMENT as
  // DecodeRangeImage().
  absl::Status Take(absl::string_view bytes);
  // What was taken, when that is the whole and valid. INVALID_ARGUMENT as DecodeRangeImage().
  absl::StatusOr<Contents> Finish();
  // The same as an image, which has no ranges with kNothing, and no appearance with kRanges.
  absl::StatusOr<RangeImage> FinishImage() &&;

  // The error that was found so far, if any.
  const absl::Status& status() const { return status_; }

 private:
  // The part that comes next, and its number of bytes.
  enum class Part { kHeader, kElevations, kColumn, kEnd };
  absl::Status TakePart(absl::string_view bytes);
  absl::Status TakeHeader(absl::string_view bytes);
  absl::Status TakeColumn(absl::string_view bytes);
  // Of the cells whose codes were taken last.
  absl::Status TakeAppearance(absl::string_view bytes);

  size_t max_cells_;
  Keep keep_;
  AppearanceKinds appearance_;
  absl::Status status_;
  Part part_ = Part::kHeader;
  size_t part_bytes_ = kHeaderBytes;
  std::string begun_;  // the part that is not whole yet
  size_t taken_ = 0;   // bytes
  uint64_t announced_columns_ = 0;
  uint64_t announced_rows_ = 0;
  size_t samples_ = 0;
  std::vector<uint32_t> codes_;  // of a column
  RangeImage image_;
};

// INVALID_ARGUMENT: not a range image, an unknown version, more cells announced than `max_cells`
// (refused before anything is allocated), truncated or too long, or what RangeImage::Validate()
// finds; names the field.
absl::StatusOr<RangeImage> DecodeRangeImage(
    absl::string_view bytes, size_t max_cells,
    RangeImageDecoder::Keep keep = RangeImageDecoder::Keep::kRanges);

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_ENCODING_H_

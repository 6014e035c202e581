#include "core/bytes/ply_reader.h"

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "core/bytes/byte_order.h"
#include "core/bytes/text_scanner.h"

namespace vantage::bytes {
namespace {

template <typename T>
double LoadAs(const char* at, bool big_endian) {
  return static_cast<double>(big_endian ? LoadBigEndian<T>(at) : LoadLittleEndian<T>(at));
}

double Load(PlyType type, const char* at, bool big_endian) {
  switch (type) {
    case PlyType::kInt8:
      return LoadAs<int8_t>(at, big_endian);
    case PlyType::kUint8:
      return LoadAs<uint8_t>(at, big_endian);
    case PlyType::kInt16:
      return LoadAs<int16_t>(at, big_endian);
    case PlyType::kUint16:
      return LoadAs<uint16_t>(at, big_endian);
    case PlyType::kInt32:
      return LoadAs<int32_t>(at, big_endian);
    case PlyType::kUint32:
      return LoadAs<uint32_t>(at, big_endian);
    case PlyType::kFloat:
      return LoadAs<float>(at, big_endian);
    case PlyType::kDouble:
      return LoadAs<double>(at, big_endian);
  }
  return 0;
}

std::optional<PlyFormat> FindFormat(absl::string_view name) {
  if (name == "ascii") return PlyFormat::kAscii;
  if (name == "binary_little_endian") return PlyFormat::kBinaryLittleEndian;
  if (name == "binary_big_endian") return PlyFormat::kBinaryBigEndian;
  return std::nullopt;
}

using Words = std::vector<absl::string_view>;

std::optional<PlyElement> ParseElement(const Words& words) {
  PlyElement element;
  if (words.size() != 3 || !absl::SimpleAtoi(words[2], &element.count)) return std::nullopt;
  element.name = std::string(words[1]);
  return element;
}

std::optional<PlyProperty> ParseProperty(const Words& words) {
  const bool list = words.size() == 5 && words[1] == "list";
  if (words.size() != 3 && !list) return std::nullopt;
  const std::optional<PlyType> type = FindPlyType(words[words.size() - 2]);
  const std::optional<PlyType> count_type = list ? FindPlyType(words[2]) : std::nullopt;
  if (!type.has_value() || count_type.has_value() != list) return std::nullopt;
  return PlyProperty{std::string(words.back()), *type, count_type};
}

absl::Status Truncated(const PlyElement& element, uint64_t index) {
  return absl::InvalidArgumentError(absl::StrCat("PLY element ", element.name, " ", index, " of ",
                                                 element.count,
                                                 ": no number there; the file is truncated or "
                                                 "damaged"));
}

}  // namespace

absl::StatusOr<PlyReader> PlyReader::Open(absl::string_view bytes) {
  PlyReader reader;
  if (absl::Status read = reader.ReadHeader(bytes); !read.ok()) return read;
  return reader;
}

absl::Status PlyReader::ReadHeader(absl::string_view bytes) {
  constexpr size_t kMaxHeaderLines = 1000;
  TextScanner text(bytes);
  absl::string_view line;
  if (!text.NextLine(line) || line != "ply") {
    return absl::InvalidArgumentError("PLY: the first line is not 'ply'; is this a PLY file?");
  }
  std::optional<PlyFormat> format;
  while (text.NextLine(line) && text.line_number() <= kMaxHeaderLines) {
    const Words words = absl::StrSplit(line, absl::ByAnyChar(" \t"), absl::SkipEmpty());
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "end_header") {
      if (!format.has_value()) {
        return absl::InvalidArgumentError("PLY: the header states no format");
      }
      format_ = *format;
      data_ = bytes.substr(text.offset());
      return absl::OkStatus();
    }
    bool understood = false;
    if (words[0] == "format" && words.size() >= 2) {
      format = FindFormat(words[1]);
      understood = format.has_value();
    } else if (words[0] == "element") {
      std::optional<PlyElement> element = ParseElement(words);
      understood = element.has_value();
      if (understood) elements_.push_back(*std::move(element));
    } else if (words[0] == "property" && !elements_.empty()) {
      std::optional<PlyProperty> property = ParseProperty(words);
      understood = property.has_value();
      if (understood) elements_.back().properties.push_back(*std::move(property));
    }
    if (!understood) {
      return absl::InvalidArgumentError(absl::StrCat("PLY line ", text.line_number(), ": '",
                                                     ShownLine(line), "' is not understood"));
    }
  }
  return absl::InvalidArgumentError("PLY: no end_header; is this a PLY file?");
}

absl::Status PlyReader::CheckCount(const PlyElement& element) const {
  if (element.count == 0) return absl::OkStatus();
  const bool ascii = format_ == PlyFormat::kAscii;
  // The fewest bytes that an instance can take. The last number of a text may end the file.
  size_t least = 0;
  for (const PlyProperty& property : element.properties) {
    least += ascii ? 2 : PlyTypeSize(property.count_type.value_or(property.type));
  }
  if (least == 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("PLY element ", element.name, ": it has no properties"));
  }
  if (element.count > (left() + (ascii ? 1 : 0)) / least) {
    return absl::InvalidArgumentError(absl::StrCat("PLY element ", element.name, ": ",
                                                   element.count, " do not fit into the ", left(),
                                                   " bytes left; truncated?"));
  }
  return absl::OkStatus();
}

bool PlyReader::NextValue(PlyType type, double& value) {
  if (format_ != PlyFormat::kAscii) {
    const size_t size = PlyTypeSize(type);
    if (left() < size) return false;
    value = Load(type, data_.data() + at_, format_ == PlyFormat::kBinaryBigEndian);
    at_ += size;
    return true;
  }
  while (at_ < data_.size() && absl::ascii_isspace(data_[at_])) ++at_;
  const size_t begin = at_;
  while (at_ < data_.size() && !absl::ascii_isspace(data_[at_])) ++at_;
  std::array<double, 1> number;
  if (ParseNumbers(data_.substr(begin, at_ - begin), number) != 1) return false;
  value = number[0];
  return true;
}

bool PlyReader::NextInstance(const PlyElement& element, Instance& instance) {
  for (size_t i = 0; i < element.properties.size(); ++i) {
    const PlyProperty& property = element.properties[i];
    double count = 1;
    if (property.count_type.has_value()) {
      if (!NextValue(*property.count_type, count)) return false;
      if (!(count >= 0) || count != std::floor(count) || count > static_cast<double>(left())) {
        return false;
      }
    }
    std::vector<double>& values = instance[i];
    values.clear();
    for (double k = 0; k < count; ++k) {
      double value = 0;
      if (!NextValue(property.type, value)) return false;
      values.push_back(value);
    }
  }
  return true;
}

absl::Status PlyReader::ReadElement(Take take) {
  if (next_element_ == elements_.size()) return absl::OutOfRangeError("PLY: no more elements");
  const PlyElement& element = elements_[next_element_++];
  if (absl::Status fits = CheckCount(element); !fits.ok()) return fits;
  Instance instance(element.properties.size());
  for (uint64_t i = 0; i < element.count; ++i) {
    if (!NextInstance(element, instance)) return Truncated(element, i);
    if (absl::Status taken = take(i, instance); !taken.ok()) return taken;
  }
  return absl::OkStatus();
}

}  // namespace vantage::bytes

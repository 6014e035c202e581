#include "core/e57/index.h"

#include <bit>
#include <cmath>
#include <limits>
#include <pugixml.hpp>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace vantage::e57 {
namespace {

// Bytes: that of a thousand set-ups with all that the standard knows has a tenth of it.
constexpr uint64_t kMostXml = 64 << 20;
constexpr size_t kMostFields = 256;
constexpr int kMostNested = 16;

absl::Status Bad(absl::string_view where, absl::string_view what) {
  return absl::InvalidArgumentError(
      absl::StrCat("E57 ", where, ": ", what, "; export the file again"));
}

// An element without text, or without the attribute, has the value that the standard gives it.
absl::Status ReadNumber(absl::string_view text, absl::string_view where, double& value) {
  text = absl::StripAsciiWhitespace(text);
  if (text.empty()) return absl::OkStatus();
  double read = 0;
  if (!absl::SimpleAtod(text, &read) || !std::isfinite(read)) {
    return Bad(where, absl::StrCat("'", text.substr(0, 40), "' where a number was expected"));
  }
  value = read;
  return absl::OkStatus();
}

absl::Status ReadInteger(absl::string_view text, absl::string_view where, int64_t& value) {
  text = absl::StripAsciiWhitespace(text);
  if (text.empty() || absl::SimpleAtoi(text, &value)) return absl::OkStatus();
  // Some exporters write whole numbers as floats.
  double read = 0;
  constexpr double kMost = 9.2e18;
  if (absl::SimpleAtod(text, &read) && std::abs(read) < kMost && read == std::floor(read)) {
    value = static_cast<int64_t>(read);
    return absl::OkStatus();
  }
  return Bad(where, absl::StrCat("'", text.substr(0, 40), "' where a whole number was expected"));
}

// A number of the file's description: scaled integers are told unscaled.
absl::Status ReadElement(const pugi::xml_node& parent, const char* name, absl::string_view where,
                         double& value) {
  const pugi::xml_node element = parent.child(name);
  const std::string at = absl::StrCat(where, "/", name);
  if (absl::Status read = ReadNumber(element.text().get(), at, value); !read.ok()) return read;
  if (absl::string_view(element.attribute("type").value()) != "ScaledInteger") {
    return absl::OkStatus();
  }
  double scale = 1;
  double offset = 0;
  absl::Status read = ReadNumber(element.attribute("scale").value(), at, scale);
  if (read.ok()) read = ReadNumber(element.attribute("offset").value(), at, offset);
  value = value * scale + offset;
  return read;
}

absl::Status ReadPose(const pugi::xml_node& element, const std::string& where, ScanSetup& setup) {
  const pugi::xml_node pose = element.child("pose");
  if (!pose) return absl::OkStatus();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  const std::string at = absl::StrCat(where, "/pose");
  if (const pugi::xml_node turn = pose.child("rotation")) {
    Eigen::Vector4d wxyz(0, 0, 0, 0);
    int k = 0;
    for (const char* name : {"w", "x", "y", "z"}) {
      if (absl::Status read = ReadElement(turn, name, at, wxyz[k++]); !read.ok()) return read;
    }
    if (!(std::abs(wxyz.norm() - 1) < 1e-2)) return Bad(at, "its rotation is no unit quaternion");
    rotation = Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).normalized();
  }
  if (const pugi::xml_node shift = pose.child("translation")) {
    int k = 0;
    for (const char* name : {"x", "y", "z"}) {
      if (absl::Status read = ReadElement(shift, name, at, translation[k++]); !read.ok()) {
        return read;
      }
    }
  }
  setup.T_file_setup = Eigen::Translation3d(translation) * rotation;
  return absl::OkStatus();
}

absl::Status ReadBounds(const pugi::xml_node& element, const std::string& where, ScanSetup& setup) {
  const pugi::xml_node bounds = element.child("indexBounds");
  // Only of a grid: some write bounds of the returns alone.
  if (!bounds.child("rowMaximum") || !bounds.child("columnMaximum")) return absl::OkStatus();
  const std::string at = absl::StrCat(where, "/indexBounds");
  IndexBounds read;
  for (const auto& [name, value] :
       {std::pair("rowMinimum", &read.row_min), std::pair("rowMaximum", &read.row_max),
        std::pair("columnMinimum", &read.column_min),
        std::pair("columnMaximum", &read.column_max)}) {
    absl::Status number =
        ReadInteger(bounds.child(name).text().get(), absl::StrCat(at, "/", name), *value);
    if (!number.ok()) return number;
  }
  if (read.row_max < read.row_min || read.column_max < read.column_min) {
    return Bad(at, "a maximum is below its minimum");
  }
  setup.bounds = read;
  return absl::OkStatus();
}

// Limits that cannot be read do no harm: what they are for is not needed.
std::optional<ValueLimits> ReadLimits(const pugi::xml_node& limits, const char* minimum,
                                      const char* maximum) {
  if (!limits.child(minimum) || !limits.child(maximum)) return std::nullopt;
  ValueLimits read;
  if (!ReadNumber(limits.child(minimum).text().get(), "", read.min).ok()) return std::nullopt;
  if (!ReadNumber(limits.child(maximum).text().get(), "", read.max).ok()) return std::nullopt;
  if (!(read.max > read.min)) return std::nullopt;
  return read;
}

// How integers from `minimum` to `maximum` are stored: with as many bits as tell them apart.
int BitsBetween(int64_t minimum, int64_t maximum) {
  return std::bit_width(static_cast<uint64_t>(maximum) - static_cast<uint64_t>(minimum));
}

absl::Status ReadField(const pugi::xml_node& element, const std::string& where, ScanSetup& setup) {
  Field field;
  field.name = element.name();
  const std::string at = absl::StrCat(where, "/", field.name);
  const absl::string_view type = element.attribute("type").value();
  if (type == "Float") {
    const absl::string_view precision = element.attribute("precision").value();
    if (precision != "" && precision != "single" && precision != "double") {
      return Bad(at, absl::StrCat("precision '", precision, "'"));
    }
    field.type = precision == "single" ? FieldType::kFloat : FieldType::kDouble;
  } else if (type == "Integer" || type == "ScaledInteger") {
    field.type = type == "Integer" ? FieldType::kInteger : FieldType::kScaledInteger;
    field.minimum = std::numeric_limits<int64_t>::min();
    int64_t maximum = std::numeric_limits<int64_t>::max();
    absl::Status read = ReadInteger(element.attribute("minimum").value(), at, field.minimum);
    if (read.ok()) read = ReadInteger(element.attribute("maximum").value(), at, maximum);
    if (read.ok() && type == "ScaledInteger") {
      read = ReadNumber(element.attribute("scale").value(), at, field.scale);
      if (read.ok()) read = ReadNumber(element.attribute("offset").value(), at, field.offset);
    }
    if (!read.ok()) return read;
    if (maximum < field.minimum) return Bad(at, "its maximum is below its minimum");
    field.maximum = maximum;
    field.bits = BitsBetween(field.minimum, maximum);
  } else if (type == "String") {
    field.type = FieldType::kString;
  } else {
    return Bad(at, absl::StrCat("type '", type.substr(0, 40), "' is none of a number or a text"));
  }
  setup.fields.push_back(std::move(field));
  return absl::OkStatus();
}

// Numbers lie in the file in the order in which they are met, however they are nested.
absl::Status ReadPrototype(const pugi::xml_node& parent, const std::string& where, int depth,
                           ScanSetup& setup) {
  if (depth > kMostNested) return Bad(where, "is nested too deeply");
  for (const pugi::xml_node& element : parent.children()) {
    if (element.type() != pugi::node_element) continue;
    const absl::string_view type = element.attribute("type").value();
    absl::Status read =
        type == "Structure" || type == "Vector"
            ? ReadPrototype(element, absl::StrCat(where, "/", element.name()), depth + 1, setup)
            : ReadField(element, where, setup);
    if (!read.ok()) return read;
    if (setup.fields.size() > kMostFields) {
      return Bad(where, absl::StrCat("has more than ", kMostFields, " fields"));
    }
  }
  return absl::OkStatus();
}

absl::Status ReadPoints(const pugi::xml_node& element, const std::string& where, PagedBytes& file,
                        ScanSetup& setup) {
  const pugi::xml_node points = element.child("points");
  const std::string at = absl::StrCat(where, "/points");
  if (absl::string_view(points.attribute("type").value()) != "CompressedVector") {
    return Bad(at, "is missing, or no CompressedVector");
  }
  int64_t records = 0;
  int64_t begin = 0;
  absl::Status read = ReadInteger(points.attribute("recordCount").value(), at, records);
  if (read.ok()) read = ReadInteger(points.attribute("fileOffset").value(), at, begin);
  if (!read.ok()) return read;
  if (records < 0 || begin < 0) return Bad(at, "a negative number of records, or place of them");
  setup.records = static_cast<uint64_t>(records);
  if (points.child("codecs").child("vectorChild")) {
    return absl::UnimplementedError(absl::StrCat(
        "E57 ", at, ": its records are in a codec that is not read; export without compression"));
  }
  const pugi::xml_node prototype = points.child("prototype");
  if (!prototype) return Bad(at, "has no prototype, which says what a record is");
  read = ReadPrototype(prototype, absl::StrCat(at, "/prototype"), 0, setup);
  if (!read.ok()) return read;
  if (setup.records == 0) return absl::OkStatus();
  const absl::StatusOr<uint64_t> logical = file.Logical(static_cast<uint64_t>(begin));
  if (!logical.ok()) return logical.status();
  setup.section_begin = *logical;
  return absl::OkStatus();
}

absl::StatusOr<ScanSetup> ReadSetup(const pugi::xml_node& element, size_t number,
                                    PagedBytes& file) {
  ScanSetup setup;
  setup.name = element.child("name").text().get();
  const std::string where = absl::StrCat(
      "set-up ", number, setup.name.empty() ? "" : absl::StrCat(" (", setup.name, ")"));
  absl::Status read = ReadPose(element, where, setup);
  if (read.ok()) read = ReadBounds(element, where, setup);
  if (read.ok()) read = ReadPoints(element, where, file, setup);
  if (!read.ok()) return read;
  setup.intensity_limits =
      ReadLimits(element.child("intensityLimits"), "intensityMinimum", "intensityMaximum");
  setup.colour_limits =
      ReadLimits(element.child("colorLimits"), "colorRedMinimum", "colorRedMaximum");
  return setup;
}

}  // namespace

std::optional<size_t> ScanSetup::FieldOf(absl::string_view field) const {
  for (size_t i = 0; i < fields.size(); ++i) {
    if (fields[i].name == field) return i;
  }
  return std::nullopt;
}

absl::StatusOr<std::vector<ScanSetup>> ReadIndex(PagedBytes& file) {
  if (file.xml_size() > kMostXml) {
    return Bad("description", absl::StrCat("has ", file.xml_size() >> 20, " MiB, of ",
                                           kMostXml >> 20, " that it may"));
  }
  std::string text(static_cast<size_t>(file.xml_size()), '\0');
  if (absl::Status read = file.Read(file.xml_begin(), text.size(), text.data()); !read.ok()) {
    return read;
  }
  pugi::xml_document document;
  // In place, without a copy. No entities are expanded but XML's own.
  const pugi::xml_parse_result parsed = document.load_buffer_inplace(text.data(), text.size());
  if (!parsed) {
    return Bad("description", absl::StrCat("no XML (", parsed.description(), " at its byte ",
                                           static_cast<int64_t>(parsed.offset), ")"));
  }
  const pugi::xml_node root = document.child("e57Root");
  if (!root) return Bad("description", "has no e57Root");
  std::vector<ScanSetup> setups;
  for (const pugi::xml_node& element : root.child("data3D").children("vectorChild")) {
    absl::StatusOr<ScanSetup> setup = ReadSetup(element, setups.size() + 1, file);
    if (!setup.ok()) return setup.status();
    setups.push_back(*std::move(setup));
  }
  return setups;
}

}  // namespace vantage::e57

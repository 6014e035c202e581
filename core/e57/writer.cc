#include "core/e57/writer.h"

#include <algorithm>
#include <numeric>
#include <pugixml.hpp>
#include <sstream>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/bytes/byte_order.h"
#include "core/bytes/checksum.h"

namespace vantage::e57 {
namespace {

constexpr uint64_t kPageBytes = 1024;  // bytes, as the standard has it
constexpr uint64_t kChecksumBytes = 4;
constexpr uint64_t kPayload = kPageBytes - kChecksumBytes;
constexpr uint64_t kFileStart = 48;
constexpr uint64_t kSectionStart = 32;
constexpr uint64_t kIndexBytes = 32;  // with one entry, the first packet
// Bytes of each field of a record, in the order of the prototype: range, azimuth and elevation as
// doubles, row and column as 32 bits, intensity as 16, colours as 8. Whole bytes, so that no number
// lies in two packets.
std::vector<uint64_t> StreamsOf(const SetupToWrite& setup) {
  std::vector<uint64_t> bytes = {8, 8, 8, 4, 4};
  if (setup.intensity) bytes.push_back(2);
  if (setup.colour) bytes.insert(bytes.end(), 3, 1);
  return bytes;
}

uint64_t RecordBytes(const SetupToWrite& setup) {
  const std::vector<uint64_t> streams = StreamsOf(setup);
  return std::accumulate(streams.begin(), streams.end(), uint64_t{0});
}

// A packet has at most 64 KiB, and so has a stream of it.
constexpr uint64_t kMostRecords = 1700;
constexpr uint64_t kMostRecordBytes = 3 * 8 + 2 * 4 + 2 + 3;
static_assert(6 + 2 * 9 + kMostRecords * kMostRecordBytes + 3 <= 65536);

// Of a packet of so many records: a whole number of four bytes.
uint64_t PacketSize(const SetupToWrite& setup, uint64_t records) {
  const uint64_t size = 6 + 2 * StreamsOf(setup).size() + records * RecordBytes(setup);
  return (size + 3) / 4 * 4;
}

uint64_t Physical(uint64_t logical) { return logical / kPayload * kPageBytes + logical % kPayload; }

uint64_t SectionSize(const SetupToWrite& setup) {
  const uint64_t last = setup.records % kMostRecords;
  return kSectionStart + setup.records / kMostRecords * PacketSize(setup, kMostRecords) +
         (last > 0 ? PacketSize(setup, last) : 0) + kIndexBytes;
}

pugi::xml_node Element(pugi::xml_node parent, const char* name, const char* type) {
  pugi::xml_node element = parent.append_child(name);
  element.append_attribute("type") = type;
  return element;
}

void Number(pugi::xml_node parent, const char* name, double value) {
  Element(parent, name, "Float").text().set(absl::StrFormat("%.17g", value).c_str());
}

void Integer(pugi::xml_node parent, const char* name, uint64_t value) {
  Element(parent, name, "Integer").text().set(absl::StrFormat("%d", value).c_str());
}

void Text(pugi::xml_node parent, const char* name, const std::string& value) {
  Element(parent, name, "String").text().set(value.c_str());
}

pugi::xml_node Vector(pugi::xml_node parent, const char* name) {
  pugi::xml_node vector = Element(parent, name, "Vector");
  vector.append_attribute("allowHeterogeneousChildren") = "1";
  return vector;
}

// Of the prototype, from 0.
void StoredInteger(pugi::xml_node prototype, const char* name, const char* maximum) {
  pugi::xml_node field = Element(prototype, name, "Integer");
  field.append_attribute("minimum") = "0";
  field.append_attribute("maximum") = maximum;
}

void Describe(const SetupToWrite& setup, uint64_t section, pugi::xml_node scans) {
  pugi::xml_node scan = Element(scans, "vectorChild", "Structure");
  Text(scan, "guid", setup.guid);
  Text(scan, "name", setup.name);
  pugi::xml_node bounds = Element(scan, "indexBounds", "Structure");
  Integer(bounds, "rowMinimum", 0);
  Integer(bounds, "rowMaximum", setup.rows - 1);
  Integer(bounds, "columnMinimum", 0);
  Integer(bounds, "columnMaximum", setup.columns - 1);
  Integer(bounds, "returnMinimum", 0);
  Integer(bounds, "returnMaximum", 0);
  if (setup.intensity) {
    pugi::xml_node limits = Element(scan, "intensityLimits", "Structure");
    Integer(limits, "intensityMinimum", 0);
    Integer(limits, "intensityMaximum", 65535);
  }
  if (setup.colour) {
    pugi::xml_node limits = Element(scan, "colorLimits", "Structure");
    for (const char* colour : {"Red", "Green", "Blue"}) {
      Integer(limits, absl::StrCat("color", colour, "Minimum").c_str(), 0);
      Integer(limits, absl::StrCat("color", colour, "Maximum").c_str(), 255);
    }
  }
  pugi::xml_node pose = Element(scan, "pose", "Structure");
  pugi::xml_node rotation = Element(pose, "rotation", "Structure");
  Number(rotation, "w", setup.R_file_setup.w());
  Number(rotation, "x", setup.R_file_setup.x());
  Number(rotation, "y", setup.R_file_setup.y());
  Number(rotation, "z", setup.R_file_setup.z());
  pugi::xml_node translation = Element(pose, "translation", "Structure");
  Number(translation, "x", setup.t_file_setup.x());
  Number(translation, "y", setup.t_file_setup.y());
  Number(translation, "z", setup.t_file_setup.z());
  pugi::xml_node points = Element(scan, "points", "CompressedVector");
  points.append_attribute("fileOffset") = absl::StrFormat("%d", Physical(section)).c_str();
  points.append_attribute("recordCount") = absl::StrFormat("%d", setup.records).c_str();
  pugi::xml_node prototype = Element(points, "prototype", "Structure");
  for (const char* name : {"sphericalRange", "sphericalAzimuth", "sphericalElevation"}) {
    Element(prototype, name, "Float");
  }
  for (const char* name : {"rowIndex", "columnIndex"}) {
    StoredInteger(prototype, name, "4294967295");
  }
  if (setup.intensity) StoredInteger(prototype, "intensity", "65535");
  for (const char* name : {"colorRed", "colorGreen", "colorBlue"}) {
    if (setup.colour) StoredInteger(prototype, name, "255");
  }
  Vector(points, "codecs");
}

std::string DescriptionOf(const std::vector<SetupToWrite>& setups,
                          const std::vector<uint64_t>& sections, absl::string_view guid) {
  pugi::xml_document document;
  pugi::xml_node declaration = document.append_child(pugi::node_declaration);
  declaration.append_attribute("version") = "1.0";
  declaration.append_attribute("encoding") = "UTF-8";
  pugi::xml_node root = Element(document, "e57Root", "Structure");
  root.append_attribute("xmlns") = "http://www.astm.org/COMMIT/E57/2010-e57-v1.0";
  Text(root, "formatName", "ASTM E57 3D Imaging Data File");
  Text(root, "guid", std::string(guid));
  Integer(root, "versionMajor", 1);
  Integer(root, "versionMinor", 0);
  Text(root, "e57LibraryVersion", "Vantage");
  Text(root, "coordinateMetadata", "");
  pugi::xml_node scans = Vector(root, "data3D");
  for (size_t i = 0; i < setups.size(); ++i) Describe(setups[i], sections[i], scans);
  Vector(root, "images2D");
  std::ostringstream out;
  document.save(out, "", pugi::format_raw);
  return out.str();
}

}  // namespace

Writer::Writer(std::vector<SetupToWrite> setups, absl::string_view guid)
    : setups_(std::move(setups)) {
  uint64_t at = kFileStart;
  for (const SetupToWrite& setup : setups_) {
    sections_.push_back(at);
    at += SectionSize(setup);
  }
  xml_begin_ = at;
  xml_ = DescriptionOf(setups_, sections_, guid);
  size_ = (xml_begin_ + xml_.size() + kPayload - 1) / kPayload * kPageBytes;
  packet_.reserve(kMostRecords);
}

std::string Writer::Begin() {
  bytes_ = "ASTM-E57";
  bytes::AppendLittleEndian(uint32_t{1}, bytes_);  // version 1.0
  bytes::AppendLittleEndian(uint32_t{0}, bytes_);
  bytes::AppendLittleEndian(size_, bytes_);
  bytes::AppendLittleEndian(Physical(xml_begin_), bytes_);
  bytes::AppendLittleEndian(uint64_t{xml_.size()}, bytes_);
  bytes::AppendLittleEndian(kPageBytes, bytes_);
  return TakePages();
}

void Writer::BeginSection() {
  const uint64_t begin = sections_[setup_];
  const uint64_t size = SectionSize(setups_[setup_]);
  bytes_.append("\x01\0\0\0\0\0\0\0", 8);  // a compressed vector
  bytes::AppendLittleEndian(size, bytes_);
  bytes::AppendLittleEndian(Physical(begin + kSectionStart), bytes_);
  bytes::AppendLittleEndian(Physical(begin + size - kIndexBytes), bytes_);
}

void Writer::FlushPacket() {
  if (packet_.empty()) return;
  const SetupToWrite& setup = setups_[setup_];
  const size_t begin = bytes_.size();
  const uint64_t size = PacketSize(setup, packet_.size());
  const std::vector<uint64_t> streams = StreamsOf(setup);
  bytes_.append("\x01\0", 2);  // data
  bytes::AppendLittleEndian(static_cast<uint16_t>(size - 1), bytes_);
  bytes::AppendLittleEndian(static_cast<uint16_t>(streams.size()), bytes_);
  for (const uint64_t each : streams) {
    bytes::AppendLittleEndian(static_cast<uint16_t>(each * packet_.size()), bytes_);
  }
  for (const SphericalRecord& r : packet_) bytes::AppendLittleEndian(r.range, bytes_);
  for (const SphericalRecord& r : packet_) bytes::AppendLittleEndian(r.azimuth, bytes_);
  for (const SphericalRecord& r : packet_) bytes::AppendLittleEndian(r.elevation, bytes_);
  for (const SphericalRecord& r : packet_) bytes::AppendLittleEndian(r.row, bytes_);
  for (const SphericalRecord& r : packet_) bytes::AppendLittleEndian(r.column, bytes_);
  if (setup.intensity) {
    for (const SphericalRecord& r : packet_) bytes::AppendLittleEndian(r.intensity, bytes_);
  }
  for (size_t part = 0; setup.colour && part < 3; ++part) {
    for (const SphericalRecord& r : packet_) bytes_.push_back(static_cast<char>(r.colour[part]));
  }
  bytes_.resize(begin + size, '\0');
  packet_.clear();
}

void Writer::EndSection() {
  FlushPacket();
  bytes_.append("\0\0", 2);  // an index
  bytes::AppendLittleEndian(static_cast<uint16_t>(kIndexBytes - 1), bytes_);
  bytes::AppendLittleEndian(uint16_t{1}, bytes_);
  bytes_.append(10, '\0');  // of the lowest level, and nine reserved
  bytes::AppendLittleEndian(uint64_t{0}, bytes_);
  bytes::AppendLittleEndian(Physical(sections_[setup_] + kSectionStart), bytes_);
  ++setup_;
  written_ = 0;
}

std::string Writer::Add(std::span<const SphericalRecord> records) {
  for (const SphericalRecord& record : records) {
    if (setup_ == setups_.size()) break;  // more than was announced
    if (written_ == 0) BeginSection();
    packet_.push_back(record);
    ++written_;
    if (packet_.size() == kMostRecords) FlushPacket();
    if (written_ == setups_[setup_].records) EndSection();
  }
  return TakePages();
}

std::string Writer::End() {
  bytes_ += xml_;
  bytes_.resize((bytes_.size() + kPayload - 1) / kPayload * kPayload);
  return TakePages();
}

std::string Writer::TakePages() {
  const size_t whole = bytes_.size() / kPayload;
  std::string pages;
  pages.reserve(whole * kPageBytes);
  for (size_t page = 0; page < whole; ++page) {
    const absl::string_view content = absl::string_view(bytes_).substr(page * kPayload, kPayload);
    pages.append(content.data(), content.size());
    const uint32_t checksum = bytes::Crc32c(content);
    for (int shift = 24; shift >= 0; shift -= 8) {
      pages.push_back(static_cast<char>(checksum >> shift));
    }
  }
  bytes_.erase(0, whole * kPayload);
  return pages;
}

}  // namespace vantage::e57

#include "core/e57/records.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/bytes/byte_order.h"

namespace vantage::e57 {
namespace {

constexpr size_t kSectionHeader = 32;
constexpr size_t kPacketHeader = 6;
constexpr uint8_t kVectorSection = 1;
enum PacketType : uint8_t { kIndexPacket = 0, kDataPacket = 1, kIgnoredPacket = 2 };
// Records of fields that take no bits, which one packet could have without end.
constexpr uint64_t kMostAtOnce = 1 << 16;

// The values of one field, which lie as a stream of bits across the packets.
class FieldReader {
 public:
  explicit FieldReader(const Field& field) : field_(field) {
    switch (field.type) {
      case FieldType::kFloat:
        bits_ = 32;
        break;
      case FieldType::kDouble:
        bits_ = 64;
        break;
      default:
        bits_ = static_cast<uint64_t>(field.bits);
    }
  }

  void Append(absl::string_view bytes) {
    // What was read goes, so that the stream does not grow.
    const size_t whole = static_cast<size_t>(bit_ / 8);
    stream_.erase(0, whole);
    bit_ -= 8 * whole;
    stream_.append(bytes.data(), bytes.size());
  }

  // How many of the next records it has values for.
  uint64_t Available() const {
    return bits_ == 0 ? kMostAtOnce : (8 * static_cast<uint64_t>(stream_.size()) - bit_) / bits_;
  }

  // The next values; as many are available.
  void Read(size_t count, std::vector<double>& values) {
    values.resize(count);
    for (size_t i = 0; i < count; ++i) values[i] = Value(Take());
  }

 private:
  // The next bits, the first lowest.
  uint64_t Take() {
    if (bits_ == 0) return 0;
    const auto byte = static_cast<size_t>(bit_ / 8);
    const auto shift = static_cast<unsigned>(bit_ % 8);
    std::array<char, 16> near{};
    std::memcpy(near.data(), stream_.data() + byte, std::min<size_t>(9, stream_.size() - byte));
    uint64_t value = bytes::LoadLittleEndian<uint64_t>(near.data()) >> shift;
    if (shift + bits_ > 64) {
      value |= static_cast<uint64_t>(static_cast<uint8_t>(near[8])) << (64 - shift);
    }
    bit_ += bits_;
    return bits_ == 64 ? value : value & ((uint64_t{1} << bits_) - 1);
  }

  double Value(uint64_t bits) const {
    switch (field_.type) {
      case FieldType::kFloat: {
        const auto low = static_cast<uint32_t>(bits);
        float value = 0;
        std::memcpy(&value, &low, sizeof(value));
        return static_cast<double>(value);
      }
      case FieldType::kDouble: {
        double value = 0;
        std::memcpy(&value, &bits, sizeof(value));
        return value;
      }
      case FieldType::kScaledInteger:
        return static_cast<double>(Integer(bits)) * field_.scale + field_.offset;
      default:
        return static_cast<double>(Integer(bits));
    }
  }
  int64_t Integer(uint64_t bits) const {
    return static_cast<int64_t>(static_cast<uint64_t>(field_.minimum) + bits);
  }

  const Field& field_;
  uint64_t bits_ = 0;  // of a value
  std::string stream_;
  uint64_t bit_ = 0;  // that the next value begins with
};

class RecordReader {
 public:
  RecordReader(PagedBytes& file, const ScanSetup& setup, std::span<const size_t> fields)
      : file_(file), setup_(setup), places_(fields.begin(), fields.end()), values_(fields.size()) {
    readers_.reserve(fields.size());
    for (const size_t place : fields) readers_.emplace_back(setup.fields[place]);
  }

  absl::Status ReadAll(absl::FunctionRef<absl::Status(RecordBlock)> take) {
    if (setup_.records == 0) return absl::OkStatus();
    std::array<char, kSectionHeader> header{};
    absl::Status status = file_.Read(setup_.section_begin, header.size(), header.data());
    if (!status.ok()) return status;
    if (static_cast<uint8_t>(header[0]) != kVectorSection)
      return Bad("its section is of no points");
    const uint64_t length = bytes::LoadLittleEndian<uint64_t>(header.data() + 8);
    if (length > file_.size() - setup_.section_begin)
      return Bad("its section ends beyond the file");
    const absl::StatusOr<uint64_t> begin =
        file_.Logical(bytes::LoadLittleEndian<uint64_t>(header.data() + 16));
    if (!begin.ok()) return begin.status();
    end_ = setup_.section_begin + length;
    for (uint64_t at = *begin; read_ < setup_.records;) {
      const absl::StatusOr<uint64_t> next = ReadPacket(at);
      if (!next.ok()) return next.status();
      at = *next;
      if (absl::Status taken = Pass(take); !taken.ok()) return taken;
    }
    return absl::OkStatus();
  }

 private:
  absl::Status Bad(absl::string_view what) const {
    return absl::InvalidArgumentError(absl::StrCat(
        "E57", setup_.name.empty() ? "" : absl::StrCat(" set-up ", setup_.name), ", record ", read_,
        " of ", setup_.records, ": ", what, "; export or copy the file again"));
  }

  // Takes what a packet has of the fields. Returns where the next begins.
  absl::StatusOr<uint64_t> ReadPacket(uint64_t at) {
    std::array<char, kPacketHeader> header{};
    if (at >= end_) return Bad("its section has no more data");
    absl::Status status = file_.Read(at, header.size(), header.data());
    if (!status.ok()) return status;
    const size_t size = size_t{bytes::LoadLittleEndian<uint16_t>(header.data() + 2)} + 1;
    const auto type = static_cast<uint8_t>(header[0]);
    if (type == kIndexPacket || type == kIgnoredPacket) return at + size;
    if (type != kDataPacket) return Bad(absl::StrCat("a packet of type ", int{type}));
    const size_t streams = bytes::LoadLittleEndian<uint16_t>(header.data() + 4);
    if (streams != setup_.fields.size()) {
      return Bad(absl::StrCat("a packet has ", streams, " fields, its records have ",
                              setup_.fields.size()));
    }
    packet_.resize(size);
    if (size < kPacketHeader + 2 * streams) return Bad("a packet is shorter than its header");
    status = file_.Read(at, size, packet_.data());
    if (!status.ok()) return status;
    size_t offset = kPacketHeader + 2 * streams;
    for (size_t s = 0; s < streams; ++s) {
      const size_t bytes =
          bytes::LoadLittleEndian<uint16_t>(packet_.data() + kPacketHeader + 2 * s);
      if (bytes > size - offset) return Bad("a packet is shorter than its fields");
      for (size_t i = 0; i < places_.size(); ++i) {
        if (places_[i] == s) readers_[i].Append(absl::string_view(packet_).substr(offset, bytes));
      }
      offset += bytes;
    }
    return at + size;
  }

  // Passes on the records of which all fields are there.
  absl::Status Pass(absl::FunctionRef<absl::Status(RecordBlock)> take) {
    while (true) {
      uint64_t count = std::min(setup_.records - read_, kMostAtOnce);
      for (const FieldReader& reader : readers_) count = std::min(count, reader.Available());
      if (count == 0) return absl::OkStatus();
      for (size_t i = 0; i < readers_.size(); ++i) {
        readers_[i].Read(static_cast<size_t>(count), values_[i]);
      }
      if (absl::Status taken = take(values_); !taken.ok()) return taken;
      read_ += count;
    }
  }

  PagedBytes& file_;
  const ScanSetup& setup_;
  const std::vector<size_t> places_;  // of the fields that are read
  std::vector<FieldReader> readers_;  // of these
  std::vector<std::vector<double>> values_;
  std::string packet_;
  uint64_t end_ = 0;   // of the section, logical
  uint64_t read_ = 0;  // records
};

}  // namespace

absl::Status ReadRecords(PagedBytes& file, const ScanSetup& setup, std::span<const size_t> fields,
                         absl::FunctionRef<absl::Status(RecordBlock)> take) {
  return RecordReader(file, setup, fields).ReadAll(take);
}

}  // namespace vantage::e57

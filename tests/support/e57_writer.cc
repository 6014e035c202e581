#include "tests/support/e57_writer.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/bytes/byte_order.h"
#include "core/bytes/checksum.h"

namespace vantage::test_support {
namespace {

constexpr size_t kHeader = 48;
constexpr size_t kChecksum = 4;

uint64_t Physical(uint64_t logical, size_t page) {
  return logical / (page - kChecksum) * page + logical % (page - kChecksum);
}

void Align(std::string& bytes) { bytes.resize((bytes.size() + 3) / 4 * 4); }

template <typename T>
void Put(T value, size_t at, std::string& bytes) {
  std::memcpy(bytes.data() + at, &value, sizeof(T));
}

// A packet of `type` with `size` bytes altogether, a multiple of 4.
void AppendOther(uint8_t type, size_t size, std::string& out) {
  std::string packet(size, '\0');
  packet[0] = static_cast<char>(type);
  Put(static_cast<uint16_t>(size - 1), 2, packet);
  out += packet;
}

// Each stream is cut where it happens to be, also within a value.
void AppendPackets(const E57SetupFile& setup, const E57Options& options, std::string& out) {
  for (size_t p = 0; p < options.packets; ++p) {
    std::string packet(6 + 2 * setup.streams.size(), '\0');
    packet[0] = 1;
    Put(static_cast<uint16_t>(setup.streams.size()), 4, packet);
    for (size_t s = 0; s < setup.streams.size(); ++s) {
      const std::string& bytes = setup.streams[s].bytes;
      const size_t begin = bytes.size() * p / options.packets;
      const size_t end = bytes.size() * (p + 1) / options.packets;
      Put(static_cast<uint16_t>(end - begin), 6 + 2 * s, packet);
      packet.append(bytes, begin, end - begin);
    }
    Align(packet);
    Put(static_cast<uint16_t>(packet.size() - 1), 2, packet);
    if (options.others) AppendOther(0, 32, out);
    out += packet;
    if (options.others) AppendOther(2, 8, out);
  }
}

}  // namespace

E57Stream E57Integers(const std::string& name, int64_t minimum, int64_t maximum,
                      const std::vector<int64_t>& values, const std::string& type,
                      const std::string& more) {
  E57Stream stream;
  stream.element = absl::StrFormat("<%s type=\"%s\" minimum=\"%d\" maximum=\"%d\" %s/>", name, type,
                                   minimum, maximum, more);
  uint64_t span = static_cast<uint64_t>(maximum) - static_cast<uint64_t>(minimum);
  int bits = 0;
  for (; span != 0; span >>= 1) ++bits;
  std::vector<bool> all;
  for (const int64_t value : values) {
    const uint64_t stored = static_cast<uint64_t>(value) - static_cast<uint64_t>(minimum);
    for (int b = 0; b < bits; ++b) all.push_back((stored >> b & 1) != 0);
  }
  stream.bytes.resize((all.size() + 7) / 8);
  for (size_t i = 0; i < all.size(); ++i) {
    if (all[i]) stream.bytes[i / 8] = static_cast<char>(stream.bytes[i / 8] | 1 << i % 8);
  }
  return stream;
}

E57Stream E57Scaled(const std::string& name, double scale, double offset, int64_t minimum,
                    int64_t maximum, const std::vector<double>& values) {
  std::vector<int64_t> stored;
  stored.reserve(values.size());
  for (const double value : values) stored.push_back(std::llround((value - offset) / scale));
  return E57Integers(name, minimum, maximum, stored, "ScaledInteger",
                     absl::StrFormat("scale=\"%.17g\" offset=\"%.17g\"", scale, offset));
}

E57Stream E57Doubles(const std::string& name, const std::vector<double>& values) {
  E57Stream stream{absl::StrCat("<", name, " type=\"Float\"/>"), ""};
  for (const double value : values) bytes::AppendLittleEndian(value, stream.bytes);
  return stream;
}

E57Stream E57Floats(const std::string& name, const std::vector<double>& values) {
  E57Stream stream{absl::StrCat("<", name, " type=\"Float\" precision=\"single\"/>"), ""};
  for (const double value : values) {
    bytes::AppendLittleEndian(static_cast<float>(value), stream.bytes);
  }
  return stream;
}

E57Stream E57Texts(const std::string& name, const std::vector<std::string>& values) {
  E57Stream stream{absl::StrCat("<", name, " type=\"String\"/>"), ""};
  for (const std::string& value : values) {
    if (value.size() < 128) {
      stream.bytes.push_back(static_cast<char>(value.size() << 1));
    } else {
      bytes::AppendLittleEndian(uint64_t{value.size()} << 1 | 1, stream.bytes);
    }
    stream.bytes += value;
  }
  return stream;
}

std::string E57Pose(double w, double x, double y, double z, double tx, double ty, double tz) {
  const auto number = [](const char* name, double value) {
    return absl::StrFormat("<%s type=\"Float\">%.17g</%s>", name, value, name);
  };
  return absl::StrCat("<pose type=\"Structure\"><rotation type=\"Structure\">", number("w", w),
                      number("x", x), number("y", y), number("z", z),
                      "</rotation><translation type=\"Structure\">", number("x", tx),
                      number("y", ty), number("z", tz), "</translation></pose>");
}

std::string E57Bounds(int64_t row_min, int64_t row_max, int64_t column_min, int64_t column_max) {
  const auto number = [](const char* name, int64_t value) {
    // A zero has no text.
    return value == 0 ? absl::StrFormat("<%s type=\"Integer\"/>", name)
                      : absl::StrFormat("<%s type=\"Integer\">%d</%s>", name, value, name);
  };
  return absl::StrCat("<indexBounds type=\"Structure\">", number("rowMinimum", row_min),
                      number("rowMaximum", row_max), number("columnMinimum", column_min),
                      number("columnMaximum", column_max), "</indexBounds>");
}

std::string PagesOf(std::string logical, size_t page) {
  const size_t data = page - kChecksum;
  logical.resize((std::max(logical.size(), kHeader) + data - 1) / data * data);
  Put(uint64_t{logical.size() / data * page}, 16, logical);
  Put(uint64_t{page}, 40, logical);
  std::string file;
  for (size_t at = 0; at < logical.size(); at += data) {
    const std::string content = logical.substr(at, data);
    file += content;
    const uint32_t checksum = bytes::Crc32c(content);
    for (int shift = 24; shift >= 0; shift -= 8)
      file.push_back(static_cast<char>(checksum >> shift));
  }
  return file;
}

std::string WriteE57(const std::vector<E57SetupFile>& setups, const E57Options& options) {
  std::string logical = "ASTM-E57";
  logical.resize(kHeader);
  Put(uint32_t{1}, 8, logical);
  std::string xml =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<e57Root type=\"Structure\" "
      "xmlns=\"http://www.astm.org/COMMIT/E57/2010-e57-v1.0\" "
      "xmlns:nor=\"http://www.libe57.org/E57_NOR_surface_normals.txt\">\n"
      "<formatName type=\"String\"><![CDATA[ASTM E57 3D Imaging Data File]]></formatName>\n"
      "<data3D type=\"Vector\" allowHeterogeneousChildren=\"1\">\n";
  for (const E57SetupFile& setup : setups) {
    const size_t begin = logical.size();
    std::string section(32, '\0');
    section[0] = 1;
    AppendPackets(setup, options, section);
    Put(uint64_t{section.size()}, 8, section);
    Put(Physical(begin + 32, options.page), 16, section);
    logical += section;
    absl::StrAppend(&xml, "<vectorChild type=\"Structure\">\n", setup.head,
                    "<points type=\"CompressedVector\" fileOffset=\"",
                    Physical(begin, options.page), "\" recordCount=\"", setup.records,
                    "\">\n<prototype type=\"Structure\">\n");
    for (const E57Stream& stream : setup.streams) absl::StrAppend(&xml, stream.element, "\n");
    absl::StrAppend(&xml, "</prototype><codecs type=\"Vector\">", setup.codecs,
                    "</codecs></points></vectorChild>\n");
  }
  xml += "</data3D><images2D type=\"Vector\"/></e57Root>\n";
  Put(Physical(logical.size(), options.page), 24, logical);
  Put(uint64_t{xml.size()}, 32, logical);
  logical += xml;
  return PagesOf(std::move(logical), options.page);
}

}  // namespace vantage::test_support

#include "core/sensor/file_content.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "core/bytes/byte_order.h"

namespace vantage::sensor {
namespace {

using bytes::LoadLittleEndian;

// A beginning that some kind of file has.
struct Beginning {
  std::string_view bytes;
  size_t at;
  const char* what;  // 'a photo (JPEG)'
};

using namespace std::string_view_literals;

// What people have beside scans; longer beginnings first where one is another's.
constexpr std::array kOthers = {
    Beginning{"\xff\xd8\xff"sv, 0, "a photo (JPEG)"},
    Beginning{"\x89PNG"sv, 0, "a picture (PNG)"},
    Beginning{"GIF8"sv, 0, "a picture (GIF)"},
    Beginning{"II*\0"sv, 0, "a picture (TIFF, or a camera's raw photo)"},
    Beginning{"MM\0*"sv, 0, "a picture (TIFF, or a camera's raw photo)"},
    Beginning{"WEBP"sv, 8, "a picture (WebP)"},
    Beginning{"ftyphei"sv, 4, "a photo (HEIC)"},
    Beginning{"ftypmif"sv, 4, "a photo (HEIC)"},
    Beginning{"ftypavif"sv, 4, "a picture (AVIF)"},
    Beginning{"ftyp"sv, 4, "a video (MP4 or MOV)"},
    Beginning{"AVI "sv, 8, "a video (AVI)"},
    Beginning{"\x1a\x45\xdf\xa3"sv, 0, "a video (WebM or MKV)"},
    Beginning{"WAVE"sv, 8, "a sound (WAV)"},
    Beginning{"ID3"sv, 0, "a sound (MP3)"},
    Beginning{"%PDF"sv, 0, "a document (PDF)"},
    Beginning{"{\\rtf"sv, 0, "a document (RTF)"},
    Beginning{"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"sv, 0, "a document (Office)"},
    Beginning{"AC10"sv, 0, "a drawing (DWG)"},
    Beginning{"ISO-10303-21"sv, 0, "a building model (IFC or STEP)"},
    Beginning{"glTF"sv, 0, "a mesh (glTF)"},
    Beginning{"SQLite format 3"sv, 0, "a database (SQLite)"},
    Beginning{"<!DOCTYPE"sv, 0, "a web page"},
    Beginning{"<!doctype"sv, 0, "a web page"},
    Beginning{"<html"sv, 0, "a web page"},
    Beginning{"<?xml"sv, 0, "an XML document"},
    Beginning{"\x7f"
              "ELF"sv,
              0, "a program"},
    Beginning{"MZ"sv, 0, "a program"},
};

// What has to be unpacked first: it may hold a scan.
constexpr std::array kPacked = {
    Beginning{"PK\x03\x04"sv, 0, "a ZIP archive, or an Office document"},
    Beginning{"7z\xbc\xaf\x27\x1c"sv, 0, "a 7-Zip archive"},
    Beginning{"Rar!\x1a\x07"sv, 0, "a RAR archive"},
    Beginning{"\x1f\x8b"sv, 0, "a packed file (gzip)"},
    Beginning{"BZh"sv, 0, "a packed file (bzip2)"},
    Beginning{"\xfd"
              "7zXZ"sv,
              0, "a packed file (xz)"},
    Beginning{"\x28\xb5\x2f\xfd"sv, 0, "a packed file (zstd)"},
    Beginning{"ustar"sv, 257, "an archive (tar)"},
};

constexpr std::array kEncrypted = {
    Beginning{"-----BEGIN PGP MESSAGE"sv, 0, "PGP"},
    Beginning{"Salted__"sv, 0, "OpenSSL"},
    Beginning{"age-encryption.org/"sv, 0, "age"},
    Beginning{"LUKS\xba\xbe"sv, 0, "LUKS"},
};

template <size_t kCount>
absl::string_view Found(const std::array<Beginning, kCount>& kinds, absl::string_view head) {
  for (const Beginning& kind : kinds) {
    if (head.size() >= kind.at &&
        absl::StartsWith(head.substr(kind.at),
                         absl::string_view(kind.bytes.data(), kind.bytes.size()))) {
      return kind.what;
    }
  }
  return {};
}

constexpr absl::string_view kSend = "; export the scan as structured E57 or PTX, and send that";

FileContent Refused(FileRefusal refusal, absl::Status why) {
  FileContent content;
  content.refusal = refusal;
  content.why = std::move(why);
  return content;
}

FileContent NoScan(absl::string_view what) {
  return Refused(FileRefusal::kNotAScan,
                 absl::InvalidArgumentError(absl::StrCat("this is ", what, ", not a scan", kSend)));
}

FileContent CutOff(uint64_t size, uint64_t said) {
  return Refused(FileRefusal::kCutOff,
                 absl::DataLossError(absl::StrCat("the file is cut off: by its beginning it has ",
                                                  said, " bytes, and ", size,
                                                  " are here; copy it again, or export it again")));
}

FileContent Encrypted(absl::string_view how) {
  return Refused(FileRefusal::kEncrypted,
                 absl::UnimplementedError(absl::StrCat("the file is encrypted (", how,
                                                       "); decrypt it, and send what comes out")));
}

FileContent Scan(ScanFormat format) {
  FileContent content;
  content.format = format;
  return content;
}

// E57: a header of 48 bytes has the size of the file.
FileContent E57Content(absl::string_view head, uint64_t size) {
  constexpr size_t kHeader = 48;
  if (head.size() < kHeader) return CutOff(size, kHeader);
  const auto said = LoadLittleEndian<uint64_t>(head.data() + 16);
  return said > size ? CutOff(size, said) : Scan(ScanFormat::kE57);
}

FileContent LasContent(absl::string_view head, uint64_t size) {
  constexpr size_t kHeader = 227;  // of 1.0 to 1.2; that of 1.4 has 375
  constexpr size_t kLongHeader = 375;
  if (head.size() < kHeader) return CutOff(size, kHeader);
  const char* const at = head.data();
  if ((at[104] & 0x80) != 0) {
    return Refused(FileRefusal::kFormatNotRead, FormatNotRead(".laz"));
  }
  const bool longer = at[25] >= 4 && head.size() >= kLongHeader;
  const uint64_t points =
      longer ? LoadLittleEndian<uint64_t>(at + 247) : LoadLittleEndian<uint32_t>(at + 107);
  const uint64_t begin = LoadLittleEndian<uint32_t>(at + 96);
  const uint64_t each = LoadLittleEndian<uint16_t>(at + 105);
  // What overflows is damage that the reader tells.
  const bool sane = points < (uint64_t{1} << 40);
  return sane && begin + points * each > size ? CutOff(size, begin + points * each)
                                              : Scan(ScanFormat::kLas);
}

// The layout is in encoding.h.
FileContent RangeImageContent(absl::string_view head, uint64_t size) {
  constexpr size_t kHeader = 32;
  if (head.size() < kHeader) return CutOff(size, kHeader);
  const auto flags = LoadLittleEndian<uint16_t>(head.data() + 6);
  const uint64_t columns = LoadLittleEndian<uint32_t>(head.data() + 8);
  const uint64_t rows = LoadLittleEndian<uint32_t>(head.data() + 12);
  const uint64_t cell = 4 + ((flags & 2) != 0 ? 2 : 0) + ((flags & 4) != 0 ? 3 : 0);
  constexpr uint64_t kMost = 262'144;
  if (columns > kMost || rows > kMost)
    return Scan(ScanFormat::kRangeImage);  // which the reader tells
  const uint64_t said = kHeader + 8 * rows + columns * (8 + cell * rows);
  return said > size ? CutOff(size, said) : Scan(ScanFormat::kRangeImage);
}

bool IsText(absl::string_view head) {
  const auto odd = [](char c) {
    const auto code = static_cast<unsigned char>(c);
    return code < 0x20 && c != '\n' && c != '\r' && c != '\t' && c != '\f';
  };
  return std::none_of(head.begin(), head.end(), odd);
}

// How many numbers a line begins with, at most four; `only`: there is nothing else in it.
size_t Numbers(absl::string_view line, bool& only) {
  size_t count = 0;
  const char* at = line.data();
  const char* const end = at + line.size();
  const auto gap = [](char c) { return absl::ascii_isspace(c) || c == ',' || c == ';'; };
  while (count < 4) {
    while (at != end && gap(*at)) ++at;
    if (at != end && *at == '+') ++at;
    double number = 0;
    const auto [next, error] = std::from_chars(at, end, number);
    if (error != std::errc() || (next != end && !gap(*next))) break;
    ++count;
    at = next;
  }
  only = std::all_of(at, end, gap);
  return count;
}

FileContent TextContent(absl::string_view head) {
  constexpr size_t kMostLines = 110;  // a file of points may have a hundred lines of header
  std::vector<absl::string_view> lines;
  for (absl::string_view line : absl::StrSplit(head, '\n')) {
    line = absl::StripAsciiWhitespace(line);
    if (lines.empty() && absl::StartsWith(line, "# .PCD")) return Scan(ScanFormat::kPcd);
    if (line.empty() || line.front() == '#' || absl::StartsWith(line, "//")) continue;
    if (lines.empty() && absl::StartsWith(line, "VERSION ")) return Scan(ScanFormat::kPcd);
    lines.push_back(line);
    if (lines.size() == kMostLines) break;
  }
  const auto whole = [&](size_t i, size_t count) {
    bool only = false;
    return i < lines.size() && Numbers(lines[i], only) == count && only;
  };
  // Columns, rows, the scanner's place, its three axes, the matrix.
  if (whole(0, 1) && whole(1, 1) && whole(2, 3) && whole(3, 3)) return Scan(ScanFormat::kPtx);
  for (const absl::string_view line : lines) {
    bool only = false;
    if (Numbers(line, only) >= 3) return Scan(ScanFormat::kXyz);
  }
  return NoScan("text without coordinates");
}

// True where all bytes come about equally often, as in what is encrypted or compressed: chi-square
// of 255 degrees of freedom, whose mean is 255 and whose standard deviation 23.
bool IsNoise(absl::string_view head) {
  constexpr size_t kEnough = 4096;
  constexpr double kMost = 400;
  if (head.size() < kEnough) return false;
  std::array<double, 256> counts{};
  for (const char c : head) counts[static_cast<unsigned char>(c)] += 1;
  const double expected = static_cast<double>(head.size()) / 256;
  double chi_square = 0;
  for (const double count : counts)
    chi_square += (count - expected) * (count - expected) / expected;
  return chi_square < kMost;
}

}  // namespace

absl::Status FormatNotRead(absl::string_view extension) {
  for (const absl::string_view vendor :
       {".fls", ".fws", ".lgs", ".lgsx", ".ptg", ".rdb", ".rdbx", ".rxp", ".rcp", ".rcs", ".tzf",
        ".tzs", ".zfs", ".zfprj"}) {
    if (extension == vendor) {
      return absl::UnimplementedError(
          "a vendor's own format is not read; export the scan from the vendor's program as "
          "structured E57 or PTX");
    }
  }
  if (extension == ".laz") {
    return absl::UnimplementedError(
        "LAZ is compressed and not read; decompress it first ('laszip -i scan.laz -o scan.las' or "
        "'pdal translate scan.laz scan.las'), or export the scan as structured E57 or PTX");
  }
  return absl::UnimplementedError(
      "only .e57, .ptx, .pcd, .vrim, .las, .ply, .xyz, .pts, .asc, .csv and .txt files are read; "
      "export the scan as structured E57 or PTX");
}

FileContent ContentOf(absl::string_view head, uint64_t size, const std::string& name) {
  if (size == 0) {
    return Refused(FileRefusal::kCutOff,
                   absl::DataLossError("the file is empty; copy it again, or export it again"));
  }
  if (absl::StartsWith(head, "ASTM-E57")) return E57Content(head, size);
  if (absl::StartsWith(head, "LASF")) return LasContent(head, size);
  if (absl::StartsWith(head, "VRIM")) return RangeImageContent(head, size);
  if (absl::StartsWith(head, "ply\n") || absl::StartsWith(head, "ply\r")) {
    return Scan(ScanFormat::kPly);
  }
  // A binary PCD begins as text.
  if (absl::StartsWith(head, "# .PCD")) return Scan(ScanFormat::kPcd);
  if (const absl::string_view how = Found(kEncrypted, head); !how.empty()) return Encrypted(how);
  if (absl::StartsWith(head, "PK\x03\x04") && head.size() > 7 && (head[6] & 1) != 0) {
    return Encrypted("an archive with a password");
  }
  if (const absl::string_view what = Found(kPacked, head); !what.empty()) {
    return Refused(
        FileRefusal::kNotAScan,
        absl::InvalidArgumentError(absl::StrCat(
            "this is ", what, "; if a scan is in it, unpack it, and send what comes out")));
  }
  if (const absl::string_view what = Found(kOthers, head); !what.empty()) return NoScan(what);
  const std::string extension =
      absl::AsciiStrToLower(std::filesystem::path(name).extension().string());
  const absl::Status by_name = FormatNotRead(extension);
  if (absl::StrContains(by_name.message(), "vendor's own")) {
    return Refused(FileRefusal::kFormatNotRead, by_name);
  }
  if (head.find_first_not_of('\0') == absl::string_view::npos) {
    return Refused(FileRefusal::kCutOff,
                   absl::DataLossError("the file begins with nothing but zeros, as after copying "
                                       "that was broken off; copy it again"));
  }
  if (IsText(head) || absl::StartsWith(head, "VERSION ")) return TextContent(head);
  if (IsNoise(head)) return Encrypted("or compressed in a way that is not known");
  return NoScan("a file of an unknown kind");
}

}  // namespace vantage::sensor

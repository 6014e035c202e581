#include "core/e57/paged_bytes.h"

#include <algorithm>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "core/bytes/byte_order.h"
#include "core/bytes/checksum.h"

namespace vantage::e57 {
namespace {

constexpr absl::string_view kSignature = "ASTM-E57";
constexpr size_t kHeader = 48;       // bytes
constexpr uint64_t kLeastPage = 64;  // bytes: the header fits into one
constexpr uint64_t kMostPage = 1 << 20;

absl::Status Broken(absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("E57: ", what, "; export or copy the file again"));
}

}  // namespace

absl::StatusOr<PagedBytes> PagedBytes::Open(bytes::ByteSource file) {
  const absl::StatusOr<absl::string_view> header =
      file.View(0, static_cast<size_t>(std::min<uint64_t>(kHeader, file.size())));
  if (!header.ok()) return header.status();
  if (header->substr(0, kSignature.size()) != kSignature) {
    return absl::InvalidArgumentError("E57: the file does not begin with ASTM-E57; is it E57?");
  }
  if (header->size() < kHeader) return Broken("the file ends in its header");
  const auto word = [&](size_t at) {
    return bytes::LoadLittleEndian<uint32_t>(header->data() + at);
  };
  const auto number = [&](size_t at) {
    return bytes::LoadLittleEndian<uint64_t>(header->data() + at);
  };
  if (word(8) != 1) {
    return absl::UnimplementedError(
        absl::StrCat("E57: version ", word(8), ".", word(12), " is not read; export version 1.0"));
  }
  const uint64_t length = number(16);
  const uint64_t xml_begin = number(24);
  const uint64_t xml_size = number(32);
  const uint64_t page = number(40);
  if (page < kLeastPage || page > kMostPage)
    return Broken(absl::StrCat("pages of ", page, " bytes"));
  if (length != file.size()) {
    return Broken(absl::StrCat("it says that it has ", length, " bytes and has ", file.size()));
  }
  if (length % page != 0) return Broken("it ends within a page");
  PagedBytes paged(std::move(file), page, 0, xml_size);
  const absl::StatusOr<uint64_t> begin = paged.Logical(xml_begin);
  if (!begin.ok() || xml_size > paged.size() || *begin > paged.size() - xml_size) {
    return Broken("its description lies beyond its end");
  }
  paged.xml_begin_ = *begin;
  return paged;
}

absl::StatusOr<uint64_t> PagedBytes::Logical(uint64_t physical) const {
  const uint64_t within = physical % page_;
  if (physical >= file_.size() || within >= page_ - kChecksum) {
    return Broken(absl::StrCat("there are no data at byte ", physical));
  }
  return physical / page_ * (page_ - kChecksum) + within;
}

absl::StatusOr<absl::string_view> PagedBytes::PageData(uint64_t page) {
  const absl::StatusOr<absl::string_view> whole =
      file_.View(page * page_, static_cast<size_t>(page_));
  if (!whole.ok()) return whole.status();
  const absl::string_view data = whole->substr(0, page_ - kChecksum);
  if (checked_[page]) return data;
  // The checksum is the one number in a file that is big-endian.
  if (bytes::LoadBigEndian<uint32_t>(whole->data() + data.size()) != bytes::Crc32c(data)) {
    return absl::DataLossError(absl::StrCat("E57: the bytes from ", page * page_,
                                            " on are damaged (checksum); copy the file again"));
  }
  checked_[page] = true;
  return data;
}

absl::Status PagedBytes::Read(uint64_t begin, size_t size, char* out) {
  if (begin > this->size() || size > this->size() - begin) {
    return Broken(absl::StrCat("it ends before the ", size, " bytes that should be at ", begin));
  }
  const uint64_t data = page_ - kChecksum;
  while (size > 0) {
    const uint64_t page = begin / data;
    const absl::StatusOr<absl::string_view> sound = PageData(page);
    if (!sound.ok()) return sound.status();
    const uint64_t within = begin % data;
    const auto count = static_cast<size_t>(std::min<uint64_t>(size, data - within));
    std::memcpy(out, sound->data() + within, count);
    out += count;
    begin += count;
    size -= count;
  }
  return absl::OkStatus();
}

}  // namespace vantage::e57

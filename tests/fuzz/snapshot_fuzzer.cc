#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "core/bytes/byte_order.h"
#include "core/bytes/checksum.h"
#include "core/bytes/compression.h"
#include "core/model/partial_model.h"
#include "core/model/snapshot/snapshot.h"
#include "core/model/snapshot/snapshot_header.h"
#include "core/model/view/algorithm_version.h"

namespace {

constexpr size_t kMost = 1 << 20;

// A snapshot whose every checksum is right. The input: 'S', then per section its kind (u8), its
// size (u16) and its bytes.
std::string Sealed(absl::string_view data) {
  std::string table;
  std::string frames;
  uint32_t count = 0;
  while (data.size() >= 3) {
    const size_t size = std::min<size_t>(
        vantage::bytes::LoadLittleEndian<uint16_t>(data.data() + 1), data.size() - 3);
    const std::string frame = vantage::bytes::ZstdCompress(data.substr(3, size), 1);
    vantage::bytes::AppendLittleEndian(static_cast<uint32_t>(static_cast<uint8_t>(data[0])), table);
    vantage::bytes::AppendLittleEndian(vantage::bytes::Crc32c(frame), table);
    vantage::bytes::AppendLittleEndian(uint64_t{frame.size()}, table);
    vantage::bytes::AppendLittleEndian(uint64_t{size}, table);
    frames += frame;
    ++count;
    data.remove_prefix(3 + size);
  }
  std::string out = "VSNP";
  vantage::bytes::AppendLittleEndian(vantage::model::kSnapshotFormatVersion, out);
  vantage::bytes::AppendLittleEndian(uint16_t{0}, out);
  vantage::bytes::AppendLittleEndian(vantage::model::kModelAlgorithmVersion, out);
  vantage::bytes::AppendLittleEndian(count, out);
  out += table;
  vantage::bytes::AppendLittleEndian(vantage::bytes::Crc32c(out), out);
  return out + frames;
}

}  // namespace

// Whatever is accepted can be looked at and saved, and is then one with its bytes.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const absl::string_view bytes(reinterpret_cast<const char*>(data), size);
  const bool sealed = size > 0 && data[0] == 'S';
  const std::string snapshot = sealed ? Sealed(bytes.substr(1)) : std::string(bytes);
  vantage::parallel::Serial serial;
  const auto model = vantage::model::PartialModel::Load(snapshot, kMost, serial);
  if (!model.ok()) {
    if (model.status().message().empty()) std::abort();
    return 0;
  }
  const std::string saved = (*model)->Save(serial);
  const auto again = vantage::model::PartialModel::Load(saved, 2 * kMost, serial);
  if (!again.ok() || (*again)->Save(serial) != saved) std::abort();
  return 0;
}

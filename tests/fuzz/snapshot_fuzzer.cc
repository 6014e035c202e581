#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "core/model/snapshot.h"
#include "core/sensor/byte_order.h"
#include "proto/wire/checksum.h"
#include "proto/wire/compression.h"

namespace {

constexpr size_t kMost = 1 << 20;

// A snapshot whose every checksum is right. The input: 'S', then per section its kind (u8), its
// size (u16) and its bytes.
std::string Sealed(absl::string_view data) {
  std::string table;
  std::string frames;
  uint32_t count = 0;
  while (data.size() >= 3) {
    const size_t size =
        std::min<size_t>(vantage::LoadLittleEndian<uint16_t>(data.data() + 1), data.size() - 3);
    const std::string frame = vantage::ZstdCompress(data.substr(3, size), 1);
    vantage::AppendLittleEndian(static_cast<uint32_t>(static_cast<uint8_t>(data[0])), table);
    vantage::AppendLittleEndian(vantage::Crc32c(frame), table);
    vantage::AppendLittleEndian(uint64_t{frame.size()}, table);
    vantage::AppendLittleEndian(uint64_t{size}, table);
    frames += frame;
    ++count;
    data.remove_prefix(3 + size);
  }
  std::string out = "VSNP";
  vantage::AppendLittleEndian(vantage::kSnapshotFormatVersion, out);
  vantage::AppendLittleEndian(uint16_t{0}, out);
  vantage::AppendLittleEndian(vantage::kModelAlgorithmVersion, out);
  vantage::AppendLittleEndian(count, out);
  out += table;
  vantage::AppendLittleEndian(vantage::Crc32c(out), out);
  return out + frames;
}

}  // namespace

// Whatever is accepted can be looked at and saved, and is then one with its bytes.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const absl::string_view bytes(reinterpret_cast<const char*>(data), size);
  const bool sealed = size > 0 && data[0] == 'S';
  const std::string snapshot = sealed ? Sealed(bytes.substr(1)) : std::string(bytes);
  vantage::Serial serial;
  const auto model = vantage::PartialModel::Load(snapshot, kMost, serial);
  if (!model.ok()) {
    if (model.status().message().empty()) std::abort();
    return 0;
  }
  const std::string saved = (*model)->Save(serial);
  const auto again = vantage::PartialModel::Load(saved, 2 * kMost, serial);
  if (!again.ok() || (*again)->Save(serial) != saved) std::abort();
  return 0;
}

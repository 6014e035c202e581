// What a confined reader answers that a file has taken over: a scan, the names of set-ups or a
// mesh, in frames. The first byte says which.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

#include "absl/strings/string_view.h"
#include "core/confinement/answer.h"
#include "core/sensor/scan_answer.h"
#include "core/simulation/confined_mesh.h"
#include "tests/fuzz/imported_scan.h"

namespace {

using vantage::confinement::Answer;
using vantage::fuzz::Require;
namespace sensor = vantage::sensor;
namespace simulation = vantage::simulation;

constexpr uint64_t kMaxBytes = 1 << 16;

// What is taken is said again as it was heard: the parts, that is, without their frames.
template <typename Hear, typename Say>
void Check(absl::string_view frames, Hear hear, Say say) {
  std::string parts;
  Answer answer(
      [&](char* to, size_t size) -> absl::StatusOr<size_t> {
        const size_t got = std::min(size, frames.size());
        std::copy_n(frames.data(), got, to);
        frames.remove_prefix(got);
        return got;
      },
      [](uint64_t) {}, kMaxBytes);
  const auto heard = hear(
      [&](char* to, size_t size) {
        absl::Status read = answer.Read(to, size);
        if (read.ok()) parts.append(to, size);
        return read;
      },
      answer.left());
  Require(parts.size() <= kMaxBytes, "no more than is allowed");
  if (!heard.ok()) {
    Require(!heard.status().message().empty(), "a refusal says why");
    return;
  }
  if (!answer.ReadEnd().ok()) return;
  std::string again;
  say(*heard, [&](absl::string_view part) { again.append(part.data(), part.size()); });
  Require(again == parts, "one way to say each");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return 0;
  const absl::string_view frames(reinterpret_cast<const char*>(data) + 1, size - 1);
  switch (data[0] % 3) {
    case 0:
      Check(frames, sensor::HearScan, sensor::SayScan);
      break;
    case 1:
      Check(frames, sensor::HearSetups, sensor::SaySetups);
      break;
    default:
      Check(frames, simulation::HearMesh, simulation::SayMesh);
  }
  return 0;
}

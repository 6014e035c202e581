#include "tests/faults/link_job.h"

#include <algorithm>
#include <chrono>
#include <thread>

#include "absl/strings/str_cat.h"
#include "client/library/client.h"
#include "client/library/piece.h"
#include "core/bytes/checksum.h"
#include "core/sensor/encoding.h"
#include "tests/server/fixture/room_scan.h"

namespace vantage::faults {
namespace {

constexpr size_t kPieceBytes = 256 << 10;  // as the client library's
constexpr auto kPatience = std::chrono::minutes(4);
constexpr auto kPause = std::chrono::milliseconds(200);

// A person with the tablet tries again until it works.
template <typename Call>
auto Persist(Call&& call) {
  const auto start = std::chrono::steady_clock::now();
  auto answer = call();
  while (!answer.ok() && std::chrono::steady_clock::now() - start < kPatience &&
         (absl::IsUnavailable(answer.status()) || absl::IsDeadlineExceeded(answer.status()))) {
    std::this_thread::sleep_for(kPause);
    answer = call();
  }
  return answer;
}

int64_t BytesOnce(const std::string& encoded) {
  int64_t bytes = 0;
  int64_t sequence = 0;
  for (size_t at = 0; at < encoded.size(); at += kPieceBytes) {
    const absl::string_view part = absl::string_view(encoded).substr(at, kPieceBytes);
    bytes += static_cast<int64_t>(
        client::MakePiece(part, sequence++, static_cast<int64_t>(at)).data().size());
  }
  return bytes;
}

}  // namespace

LinkJobResult PushOverLink(const LinkJob& job) {
  LinkJobResult result;
  client::ClientOptions options;
  options.server = job.server;
  client::Client client(options);
  const auto failed = [&](const absl::Status& status) {
    if (result.failure.empty()) result.failure = status.ToString();
  };
  for (int i = 0; i < job.scans; ++i) {
    const sensor::RangeImage image =
        fixture::NoisyRoom({2.0, 1.5, 1.4}, job.degrees, static_cast<uint32_t>(i + 1));
    const std::string encoded = sensor::EncodeRangeImage(image);
    result.once_bytes += BytesOnce(encoded);
    const std::string id = absl::StrCat(job.name, "-", i);
    const std::string session = absl::StrCat("sessions/", id);
    v1::CreateSessionRequest create;
    create.set_session_id(id);
    create.set_request_id(id);
    create.mutable_session()->mutable_model_config()->set_voxel_size_m(0.1);
    const auto created = Persist([&] { return client.Call(create); });
    if (!created.ok()) {
      failed(created.status());
      continue;
    }
    const auto pushed = Persist([&] {
      client::UploadProgress last;
      auto scan =
          client.Upload(session, {}, image, [&](const client::UploadProgress& now) { last = now; });
      result.sent_bytes += last.sent_bytes;
      result.reconnects += last.reconnects;
      return scan;
    });
    if (!pushed.ok()) {
      failed(pushed.status());
      continue;
    }
    v1::ListScansRequest list;
    list.set_parent(session);
    const auto scans = Persist([&] { return client.Call(list); });
    if (!scans.ok()) {
      failed(scans.status());
      continue;
    }
    const bool once =
        scans->scans_size() == 1 && scans->scans(0).sha256() == bytes::Sha256::Of(encoded);
    if (!once) {
      failed(absl::DataLossError(
          absl::StrCat(session, " has ", scans->scans_size(), " scans, or another's bytes")));
    }
    result.arrived += once ? 1 : 0;
  }
  return result;
}

}  // namespace vantage::faults

#include "client/library/wire.h"

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/channel_arguments.h>

#include <thread>

#include "absl/strings/str_format.h"
#include "client/library/credentials.h"

namespace vantage::client {
namespace {

constexpr int kKeepaliveMs = 5'000;
constexpr int kKeepaliveTimeoutMs = 4'000;
// What an attempt to connect may take, whatever the argument is called: TCP, TLS and HTTP/2 greet
// in four round trips, of a second each over a satellite, and one of them may get lost.
constexpr int kConnectTimeoutMs = 10'000;
// A full plan comes with a page of scores and its patches.
constexpr int kLargestMessage = 64 << 20;

}  // namespace

Wire::Wire(ClientOptions client_options) : options(std::move(client_options)) {
  grpc::ChannelArguments arguments;
  // A link that goes silent would otherwise block for minutes.
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveTimeoutMs);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, kConnectTimeoutMs);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 2'000);
  // The client retries by itself, since retrying has to know request ids, RetryInfo and resuming.
  // With gRPC's own retries (1.51) a call whose link breaks can outlive its deadline for ever.
  arguments.SetInt(GRPC_ARG_ENABLE_RETRIES, 0);
  arguments.SetMaxReceiveMessageSize(kLargestMessage);
  auto credentials = MakeChannelCredentials(options);
  usable = credentials.status();
  channel = grpc::CreateCustomChannel(
      options.server, usable.ok() ? *credentials : grpc::InsecureChannelCredentials(), arguments);
  sessions = v1::SessionService::NewStub(channel);
  scans = v1::ScanService::NewStub(channel);
  plans = v1::PlanService::NewStub(channel);
  model = v1::ModelService::NewStub(channel);
  fleet = v1::FleetService::NewStub(channel);
  health = grpc::health::v1::Health::NewStub(channel);
}

absl::Status Wire::Prepare(grpc::ClientContext& context) const {
  if (!usable.ok()) return usable;
  if (!options.traceparent.empty()) context.AddMetadata("traceparent", options.traceparent);
  return AddToken(options, context);
}

void Wire::Wait(double seconds) const {
  const auto begun = SteadyClock::now();
  channel->WaitForConnected(DeadlineIn(seconds));
  SleepSeconds(seconds - SecondsSince(begun));
}

std::chrono::system_clock::time_point DeadlineIn(double seconds) {
  return std::chrono::system_clock::now() +
         std::chrono::duration_cast<std::chrono::system_clock::duration>(
             std::chrono::duration<double>(seconds));
}

void SleepSeconds(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

uint64_t RandomSeed() {
  std::random_device device;
  return static_cast<uint64_t>(device()) << 32 | device();
}

std::string NewRequestId() { return absl::StrFormat("%016x%016x", RandomSeed(), RandomSeed()); }

bool IsTransient(const absl::Status& status) {
  return absl::IsUnavailable(status) ||
         (absl::IsResourceExhausted(status) && Explain(status).retry_seconds.has_value());
}

}  // namespace vantage::client

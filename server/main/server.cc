#include "server/main/server.h"

#include <grpcpp/ext/channelz_service_plugin.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>

#include <algorithm>
#include <thread>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "grpc/health/v1/health.pb.h"
#include "server/session/error.h"

namespace vantage {
namespace {

// Jobs begun at a time: they share the slots, so this only bounds stacks and snapshots in hand.
constexpr int kMaxJobs = 16;
// Room for a message's framing beyond its largest piece.
constexpr int kMaxHeaderBytes = 8 << 10;

int CoresOr(int threads) {
  return threads > 0 ? threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

}  // namespace

bool IsLoopback(const std::string& address) {
  if (absl::StartsWith(address, "unix:")) return true;
  if (absl::StartsWith(address, "[::1]") || address == "::1") return true;
  const std::string host = address.substr(0, address.rfind(':'));
  if (host == "localhost") return true;
  const std::vector<std::string> parts = absl::StrSplit(host, '.');
  int number = 0;
  return parts.size() == 4 && parts[0] == "127" &&
         std::all_of(parts.begin(), parts.end(), [&](const std::string& part) {
           return absl::SimpleAtoi(part, &number) && number >= 0 && number <= 255;
         });
}

absl::StatusOr<std::unique_ptr<Server>> Server::Start(const ServerOptions& options, Store& store,
                                                      Log& log, Algorithms algorithms,
                                                      Journal::Clock clock) {
  if (!options.allow_insecure_remote && !IsLoopback(options.listen)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "listen address '", options.listen,
        "' is not loopback, and nothing would protect it: use 127.0.0.1:PORT, put a proxy with "
        "TLS in front, or say --allow-insecure-remote"));
  }
  std::unique_ptr<Server> server(
      new Server(options, store, log, std::move(algorithms), std::move(clock)));
  absl::Status serving = server->Serve();
  if (!serving.ok()) return serving;
  return server;
}

Server::Server(const ServerOptions& options, Store& store, Log& log, Algorithms algorithms,
               Journal::Clock clock)
    : options_(options),
      log_(log),
      pool_(CoresOr(options.threads), kMaxJobs),
      tasks_(options.request_threads, options.queued_requests),
      sessions_(std::make_unique<SessionRegistry>(SessionSurroundings{
          store, pool_, timer_, log, options.limits, std::move(algorithms), std::move(clock)})),
      services_(std::make_unique<Services>(RpcEnvironment{*sessions_, tasks_, timer_, log})) {}

absl::Status Server::Serve() {
  // Linked in so that reflection can describe the built-in health service.
  grpc::health::v1::HealthCheckRequest::descriptor();
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  grpc::channelz::experimental::InitChannelzService();

  grpc::ServerBuilder builder;
  builder.AddListeningPort(options_.listen, grpc::InsecureServerCredentials(), &port_);
  services_->Register(builder);
  builder.SetMaxReceiveMessageSize(options_.limits.message_bytes);
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  builder.AddChannelArgument(GRPC_ARG_MAX_METADATA_SIZE, kMaxHeaderBytes);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, 256);
  // A link that went silent is noticed within seconds; clients may ping as often as every second.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 5'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 4'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 1'000);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  server_ = builder.BuildAndStart();
  if (server_ == nullptr || port_ == 0) {
    return absl::UnavailableError(
        absl::StrCat("cannot listen on '", options_.listen, "': in use, or not an address"));
  }
  SetServing(false);
  absl::Status loaded = sessions_->LoadAll();
  if (!loaded.ok()) return loaded;
  SetServing(true);
  {
    std::lock_guard<std::mutex> lock(collect_mutex_);
    collects_ = true;
    CollectLater();
  }
  log_.Info("serving", {{"port", port_}, {"threads", pool_.slots()}});
  return absl::OkStatus();
}

void Server::SetServing(bool serving) {
  grpc::HealthCheckServiceInterface* health = server_->GetHealthCheckService();
  for (const std::string& name : Services::Names()) health->SetServingStatus(name, serving);
  health->SetServingStatus(serving);
}

void Server::CollectLater() {
  timer_.After(options_.collect_every, [this] {
    std::lock_guard<std::mutex> lock(collect_mutex_);
    if (collects_) tasks_.Post([this] { Collect(); });
  });
}

void Server::Collect() {
  std::lock_guard<std::mutex> lock(collect_mutex_);
  if (!collects_) return;
  sessions_->Collect();
  CollectLater();
}

void Server::Drain() {
  if (drained_ || server_ == nullptr) return;
  drained_ = true;
  log_.Info("draining");
  SetServing(false);
  sessions_->BeginDrain();
  {
    std::lock_guard<std::mutex> lock(collect_mutex_);
    collects_ = false;
  }
  const bool rested = sessions_->WaitUntilIdle(options_.drain_patience);
  // Open calls get a moment to finish by themselves, then are cancelled.
  server_->Shutdown(std::chrono::system_clock::now() + std::chrono::seconds(2));
  log_.Info("drained", {{"everything_ended", rested}});
}

Server::~Server() { Drain(); }

}  // namespace vantage

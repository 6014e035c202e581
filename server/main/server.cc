#include "server/main/server.h"

#include <malloc.h>

#include <grpcpp/ext/channelz_service_plugin.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>

#include <algorithm>
#include <optional>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "grpc/health/v1/health.pb.h"
#include "server/contract/error.h"
#include "server/main/credentials.h"
#include "server/main/monitor.h"
#include "server/main/socket_file.h"

namespace vantage::server {
namespace {

// Jobs begun at a time: they share the slots, so this only bounds stacks and snapshots in hand.
constexpr int kMaxJobs = 16;
// Of a call's headers.
constexpr int kMaxHeaderBytes = 8 << 10;
// Beyond them, where a proxy adds its client's certificate.
constexpr int kMaxCertificateBytes = 8 << 10;
constexpr std::chrono::seconds kCallersRefresh(2);
constexpr std::chrono::seconds kLastMoment(1);

int CoresOr(int threads) {
  return threads > 0 ? threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

}  // namespace

absl::StatusOr<std::unique_ptr<Server>> Server::Start(const ServerOptions& options,
                                                      store::Store& store, telemetry::Log& log,
                                                      session::Algorithms algorithms,
                                                      session::Journal::Clock clock) {
  absl::StatusOr<Credentials> credentials =
      MakeCredentials(options.access, options.listen, options.web_listen);
  if (!credentials.ok()) return credentials.status();
  std::unique_ptr<auth::CallersFile> callers;
  if (!options.access.callers_file.empty()) {
    absl::StatusOr<std::unique_ptr<auth::CallersFile>> opened =
        auth::CallersFile::Open(options.access.callers_file);
    if (!opened.ok()) return absl::InvalidArgumentError(opened.status().message());
    callers = *std::move(opened);
  }
  std::unique_ptr<auth::JwtIssuer> jwts;
  if (!options.access.jwt.keys_file.empty()) {
    absl::StatusOr<std::unique_ptr<auth::JwtIssuer>> opened =
        auth::JwtIssuer::Open(options.access.jwt);
    if (!opened.ok()) return absl::InvalidArgumentError(opened.status().message());
    jwts = *std::move(opened);
  }
  std::unique_ptr<Server> server(new Server(options, store, log, std::move(callers),
                                            std::move(jwts), std::move(credentials->files),
                                            std::move(algorithms), std::move(clock)));
  absl::Status serving = server->Serve(*credentials);
  if (!serving.ok()) return serving;
  return server;
}

Server::Server(const ServerOptions& options, store::Store& store, telemetry::Log& log,
               std::unique_ptr<auth::CallersFile> callers, std::unique_ptr<auth::JwtIssuer> jwts,
               std::unique_ptr<auth::TlsFiles> tls_files, session::Algorithms algorithms,
               session::Journal::Clock clock)
    : options_(options),
      tls_files_(std::move(tls_files)),
      log_(log),
      store_(store, metrics_, log),
      clock_(std::move(clock), execution::SteadyTime,
             [this](absl::Duration by, bool followed) { TellJump(by, followed); }),
      authorizer_(options.access, std::move(callers), std::move(jwts), web_seal_),
      memory_(options.memory_bytes),
      pool_(CoresOr(options.threads), kMaxJobs),
      tasks_(options.request_threads, options.queued_requests),
      sessions_(std::make_unique<session::SessionRegistry>(session::SessionDependencies{
          store_, pool_, timer_, log, options.limits, std::move(algorithms),
          [this] { return clock_.Now(); }, &metrics_, &memory_, nullptr})),
      services_(std::make_unique<rpc::Services>(rpc::RpcDependencies{
          *sessions_, tasks_, timer_, log, authorizer_, metrics_, calls_, options.heartbeat})) {}

// Binds the addresses and starts to take connections.
absl::Status Server::Listen(grpc::ServerBuilder& builder, const Credentials& credentials) {
  std::vector<int> ports(options_.listen.size(), 0);
  std::vector<std::string> sockets;
  for (size_t i = 0; i < ports.size(); ++i) {
    const std::string path = SocketPath(options_.listen[i]);
    if (!path.empty()) {
      if (absl::Status free = CheckSocketFree(path); !free.ok()) return free;
      sockets.push_back(path);
    }
    builder.AddListeningPort(options_.listen[i],
                             path.empty() ? credentials.ports : credentials.sockets, &ports[i]);
  }
  {
    std::optional<OwnerAlone> closed;
    if (!sockets.empty()) closed.emplace();
    server_ = builder.BuildAndStart();
  }
  // The first that gRPC could not bind; it tries none after that.
  const auto failed = std::find(ports.begin(), ports.end(), 0);
  if (server_ == nullptr || failed != ports.end()) {
    const auto at = failed == ports.end() ? 0 : failed - ports.begin();
    return absl::UnavailableError(
        absl::StrCat("cannot listen on '", options_.listen[at], "': in use, or not an address"));
  }
  for (size_t i = 0; i < ports.size(); ++i) {
    const std::string& asked = options_.listen[i];
    if (!SocketPath(asked).empty()) {
      addresses_.push_back(asked);
      continue;
    }
    addresses_.push_back(absl::StrCat(asked.substr(0, asked.rfind(':')), ":", ports[i]));
    if (port_ == 0) port_ = ports[i];
  }
  for (const std::string& path : sockets) {
    if (absl::Status open = OpenSocketToGroup(path); !open.ok()) return open;
  }
  return absl::OkStatus();
}

absl::Status Server::Serve(const Credentials& credentials) {
  // Linked in so that reflection can describe the built-in health service.
  grpc::health::v1::HealthCheckRequest::descriptor();
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  // Channelz tells who is connected and what they call, which must not be shown where callers are
  // told apart.
  if (!options_.access.identified()) grpc::channelz::experimental::InitChannelzService();

  grpc::ServerBuilder builder;
  services_->Register(builder);
  builder.SetMaxReceiveMessageSize(options_.limits.message_bytes);
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  builder.AddChannelArgument(
      GRPC_ARG_MAX_METADATA_SIZE,
      kMaxHeaderBytes + (options_.access.certificate_metadata.empty() ? 0 : kMaxCertificateBytes));
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, 256);
  // A connection that sends nothing is closed soon.
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, 10'000);
  // Pieces are compressed already, and compressed messages could only be used to fill the server's
  // memory.
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_GZIP, false);
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_DEFLATE, false);
  // A silent link is noticed within seconds. Clients may ping once a second.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 5'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 4'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 1'000);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  if (options_.access.identified()) {
    // A certificate that was withdrawn may still have a connection open.
    builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_MS, 3'600'000);
    builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_GRACE_MS, 60'000);
  }
  if (absl::Status listening = Listen(builder, credentials); !listening.ok()) return listening;
  SetServing(false);
  memory_.OnShortage([this](const session::MemoryAccount::Shortage& shortage) {
    metrics_.CounterOf("vantage_memory_short_total", "Times that the memory did not suffice.")
        .Add();
    sessions_->FreeMemory(shortage);
  });
  if (absl::Status http = ServeHttp(); !http.ok()) return http;
  if (absl::Status web = ServeWeb(); !web.ok()) return web;
  absl::Status loaded = sessions_->LoadAll();
  if (!loaded.ok()) return loaded;
  SetServing(true);
  state_ = "serving";
  {
    std::lock_guard<std::mutex> lock(collect_mutex_);
    collects_ = true;
    CollectLater();
  }
  {
    std::lock_guard<std::mutex> lock(refresh_mutex_);
    refreshes_ = true;
    RefreshLater();
  }
  log_.Info("serving", {{"port", port_}, {"threads", pool_.slots()}});
  return absl::OkStatus();
}

// Started before the sessions are loaded, so that readers can see why the server does not serve
// yet.
absl::Status Server::ServeHttp() {
  if (options_.http_listen.empty()) return absl::OkStatus();
  if (!options_.http_allow_remote && !IsLoopback(options_.http_listen)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "HTTP address '", options_.http_listen,
        "' is not loopback, and anyone could read the metrics: say --http-allow-remote"));
  }
  const Monitored monitored{
      metrics_, *sessions_, pool_, tasks_, log_, tls_files_.get(), options_.data_folder, [this] {
        return std::string(state_.load());
      }};
  AddGauges(monitored);
  metrics_.AddGauge("vantage_memory_reserved_bytes", "Estimated for models and plans.", {},
                    [this] { return static_cast<double>(memory_.used()); });
  metrics_.AddGauge("vantage_memory_budget_bytes", "For models and plans; 0: no limit.", {},
                    [this] { return static_cast<double>(memory_.budget()); });
  metrics_.AddGauge("vantage_rpcs_under_way", "Calls that have not ended, streams included.", {},
                    [this] { return static_cast<double>(calls_.total()); });
  absl::StatusOr<std::unique_ptr<telemetry::HttpListener>> listener =
      telemetry::HttpListener::Start(options_.http_listen, MonitorPages(monitored));
  if (!listener.ok()) return listener.status();
  http_ = *std::move(listener);
  log_.Info("serving HTTP", {{"port", http_->port()}});
  return absl::OkStatus();
}

// Its calls come in process, so all that holds for calls over gRPC holds for them.
absl::Status Server::ServeWeb() {
  if (options_.web_listen.empty()) return absl::OkStatus();
  const auth::AccessOptions& access = options_.access;
  web::GatewayOptions options;
  options.address = options_.web_listen;
  options.router = {rpc::Services::Names(), options_.web_allowed_origins, access.identified()};
  options.message_bytes = options_.limits.message_bytes;
  options.ask_for_certificates = !access.tls_client_ca.empty();
  options.require_certificates = !access.tls_optional_client_certificates;
  if (!access.tenant_metadata.empty()) options.passed_on.push_back(access.tenant_metadata);
  for (const std::string& key : {access.certificate_metadata, access.address_metadata}) {
    if (!key.empty()) options.passed_on_by_proxy.push_back(key);
  }
  web::PageFiles page;
  if (!options_.web_root.empty()) {
    absl::StatusOr<web::PageFiles> read = web::PageFiles::Read(options_.web_root);
    if (!read.ok()) return absl::InvalidArgumentError(read.status().message());
    page = *std::move(read);
  }
  if (!options_.web_authority.empty()) {
    page.Add("/authority.crt", "application/x-x509-ca-cert", options_.web_authority);
  }
  const size_t page_files = page.size();
  const std::string path = SocketPath(options_.web_listen);
  std::optional<OwnerAlone> closed;
  if (!path.empty()) {
    if (absl::Status free = CheckSocketFree(path); !free.ok()) return free;
    closed.emplace();
  }
  grpc::ChannelArguments arguments;
  // What the server sends is for the client to judge.
  arguments.SetMaxReceiveMessageSize(-1);
  absl::StatusOr<std::unique_ptr<web::Gateway>> gateway =
      web::Gateway::Start(std::move(options), std::move(page), server_->InProcessChannel(arguments),
                          web_seal_, tls_files_.get(), metrics_);
  if (!gateway.ok()) return gateway.status();
  web_ = *std::move(gateway);
  if (!path.empty()) {
    closed.reset();
    if (absl::Status open = OpenSocketToGroup(path); !open.ok()) return open;
  }
  log_.Info("serving the web",
            {{"port", web_->port()}, {"page_files", static_cast<int64_t>(page_files)}});
  return absl::OkStatus();
}

void Server::TellJump(absl::Duration by, bool followed) {
  if (by == absl::ZeroDuration()) return log_.Info("the clock is right again");
  metrics_.CounterOf("vantage_clock_jumps_total", "Times that the wall clock jumped.")
      .Add(followed ? 0 : 1);
  log_.Warning(followed ? "the clock stays where it jumped, and is followed from now on"
                        : "the clock jumped; it is followed if it stays there",
               {{"by_seconds", absl::ToDoubleSeconds(by)}});
}

void Server::SetServing(bool serving) {
  grpc::HealthCheckServiceInterface* health = server_->GetHealthCheckService();
  for (const std::string& name : rpc::Services::Names()) health->SetServingStatus(name, serving);
  health->SetServingStatus(serving);
}

void Server::CollectLater() {
  // Often enough that models are evicted not much later than they are due.
  const std::chrono::milliseconds soon = std::max<std::chrono::milliseconds>(
      std::chrono::seconds(1), absl::ToChronoMilliseconds(options_.limits.evict_after / 2));
  timer_.After(std::min(options_.collect_every, soon), [this] {
    std::lock_guard<std::mutex> lock(collect_mutex_);
    if (collects_) tasks_.Post([this] { Collect(); });
  });
}

void Server::Collect() {
  std::lock_guard<std::mutex> lock(collect_mutex_);
  if (!collects_) return;
  sessions_->Collect();
  // Returns the memory of models that were evicted since the last time, which the allocator would
  // keep.
  malloc_trim(0);
  CollectLater();
}

void Server::RefreshLater() {
  timer_.After(kCallersRefresh, [this] {
    std::lock_guard<std::mutex> lock(refresh_mutex_);
    if (!refreshes_) return;
    clock_.Now();  // so that a jump is noticed while nobody asks for the time
    tasks_.Post([this] {
      RefreshCallers();
      RefreshJwtKeys();
      RefreshTlsFiles();
      std::lock_guard<std::mutex> again(refresh_mutex_);
      if (refreshes_) RefreshLater();
    });
  });
}

void Server::RefreshCallers() {
  const absl::StatusOr<bool> changed = authorizer_.RefreshCallers();
  const std::string error = changed.ok() ? "" : changed.status().ToString();
  std::lock_guard<std::mutex> lock(refresh_mutex_);
  if (changed.ok() && *changed) log_.Info("the callers file was read again");
  if (!error.empty() && error != refresh_error_) {
    log_.Error("the callers file cannot be used; the callers known before stay",
               {{"error", error}});
  }
  refresh_error_ = error;
}

void Server::RefreshJwtKeys() {
  const absl::StatusOr<bool> changed = authorizer_.RefreshJwtKeys();
  const std::string error = changed.ok() ? "" : changed.status().ToString();
  std::lock_guard<std::mutex> lock(refresh_mutex_);
  if (changed.ok() && *changed) log_.Info("the JWT keys were read again");
  if (!error.empty() && error != jwt_refresh_error_) {
    log_.Error("the JWT keys cannot be used; the keys known before stay", {{"error", error}});
  }
  jwt_refresh_error_ = error;
}

void Server::RefreshTlsFiles() {
  if (tls_files_ == nullptr) return;
  const std::string before = tls_files_->fault();
  const absl::StatusOr<bool> changed = tls_files_->Refresh();
  const std::string fault = tls_files_->fault();
  if (changed.ok() && *changed) {
    log_.Info("the certificates were read again");
    const absl::Status shown = web_ == nullptr ? absl::OkStatus() : web_->RefreshTls();
    if (!shown.ok()) log_.Error("the web shows those before", {{"error", shown.ToString()}});
  }
  if (!fault.empty() && fault != before) {
    log_.Error("the certificates on disk cannot be used; those loaded before stay",
               {{"error", fault}});
  }
}

void Server::Drain() {
  if (drained_ || server_ == nullptr) return;
  drained_ = true;
  log_.Info("draining");
  state_ = "draining";
  SetServing(false);
  if (web_ != nullptr) web_->Drain();
  sessions_->BeginDrain();
  {
    std::lock_guard<std::mutex> lock(collect_mutex_);
    collects_ = false;
  }
  {
    std::lock_guard<std::mutex> lock(refresh_mutex_);
    refreshes_ = false;
  }
  const bool rested = sessions_->WaitUntilIdle(options_.drain_patience);
  if (!rested) sessions_->GiveUp();
  // Open calls get a moment to finish by themselves; then they are cancelled: exports and streams
  // that nobody reads.
  const auto last = std::chrono::system_clock::now() + kLastMoment;
  if (web_ != nullptr) web_->Stop(kLastMoment);
  server_->Shutdown(last);
  log_.Info("drained", {{"everything_ended", rested}});
}

Server::~Server() {
  Drain();
  memory_.OnNoShortage();
  // Pending retries refer to sessions, and sessions refer to the pools.
  timer_.Stop();
}

}  // namespace vantage::server

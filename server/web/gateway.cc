#include "server/web/gateway.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <new>
#include <thread>
#include <utility>

#include <boost/asio/basic_socket_acceptor.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>

#include "absl/base/thread_annotations.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "server/web/tls_context.h"
#include "server/web/wire.h"

namespace vantage::web {
namespace {

namespace asio = boost::asio;
using StreamProtocol = asio::generic::stream_protocol;
using Acceptor = asio::basic_socket_acceptor<StreamProtocol>;

// Links that fall silent: as those of gRPC, noticed within 15 s. What was sent and is not
// acknowledged ends a connection by itself; where nothing is under way, questions are. A stream
// that speaks in between ends later, counted from then: tablets change from one Wi-Fi to the next.
constexpr int kAskAfterSeconds = 5;
constexpr int kAskEverySeconds = 4;
constexpr int kAsk = 2;
constexpr int kUnacknowledgedMs = 14'000;
// Messages of streams that the threads are given at a time. Each takes them some 0.1 ms, so that a
// call which comes meanwhile waits for less than one.
constexpr size_t kMessagesAtOnce = 8;
// How long no connection is taken after one could not be, for lack of files above all.
constexpr std::chrono::milliseconds kAcceptAgain(100);
// Calls that were cancelled end soon; until then gRPC's threads know their connections.
constexpr std::chrono::milliseconds kLookAgain(100);

struct ParsedAddress {
  StreamProtocol::endpoint endpoint;
  std::string path;  // of a socket of the file system
};

absl::StatusOr<ParsedAddress> ParseWebAddress(const std::string& address) {
  absl::string_view path = address;
  if (absl::ConsumePrefix(&path, "unix:")) {
    absl::string_view absolute = path;
    if (absl::ConsumePrefix(&absolute, "//")) path = absolute;
    if (path.empty() || path.size() >= sizeof(sockaddr_un{}.sun_path)) {
      return absl::InvalidArgumentError(absl::StrCat("'", address, "' names no path"));
    }
    return ParsedAddress{asio::local::stream_protocol::endpoint(std::string(path)),
                         std::string(path)};
  }
  const size_t colon = address.rfind(':');
  int port = -1;
  if (colon != std::string::npos && absl::SimpleAtoi(address.substr(colon + 1), &port) &&
      port >= 0 && port <= 65535) {
    std::string host = address.substr(0, colon);
    if (host == "localhost") host = "127.0.0.1";
    if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
      host = host.substr(1, host.size() - 2);
    }
    boost::system::error_code error;
    const asio::ip::address parsed = asio::ip::make_address(host, error);
    if (!error) {
      return ParsedAddress{asio::ip::tcp::endpoint(parsed, static_cast<uint16_t>(port)), ""};
    }
  }
  return absl::InvalidArgumentError(
      absl::StrCat("'", address, "' is no address: 127.0.0.1:PORT, [::1]:PORT or unix:PATH"));
}

struct PeerName {
  std::string peer;     // as Arrival has it
  std::string address;  // by which connections are counted; empty: they are not
};

PeerName NameOf(const StreamProtocol::endpoint& remote) {
  const auto* any = reinterpret_cast<const sockaddr*>(remote.data());  // NOLINT: the system's way
  asio::ip::address address;
  uint16_t port = 0;
  if (any->sa_family == AF_INET) {
    const auto* four = reinterpret_cast<const sockaddr_in*>(any);  // NOLINT
    address = asio::ip::address_v4(ntohl(four->sin_addr.s_addr));
    port = ntohs(four->sin_port);
  } else if (any->sa_family == AF_INET6) {
    const auto* six = reinterpret_cast<const sockaddr_in6*>(any);  // NOLINT
    asio::ip::address_v6::bytes_type bytes{};
    std::copy(std::begin(six->sin6_addr.s6_addr), std::end(six->sin6_addr.s6_addr), bytes.begin());
    const asio::ip::address_v6 whole(bytes);
    address = whole.is_v4_mapped()
                  ? asio::ip::address(asio::ip::make_address_v4(asio::ip::v4_mapped, whole))
                  : asio::ip::address(whole);
    port = ntohs(six->sin6_port);
  } else {
    return {"unix:", ""};
  }
  const std::string text = address.to_string();
  return {address.is_v4() ? absl::StrCat("ipv4:", text, ":", port)
                          : absl::StrCat("ipv6:[", text, "]:", port),
          address.is_loopback() ? "" : text};
}

// Where an option cannot be set, a silent link is noticed later.
void WatchLink(int file) {
  const auto set = [&](int level, int option, int value) {
    setsockopt(file, level, option, &value, sizeof value);
  };
  set(SOL_SOCKET, SO_KEEPALIVE, 1);
  set(IPPROTO_TCP, TCP_KEEPIDLE, kAskAfterSeconds);
  set(IPPROTO_TCP, TCP_KEEPINTVL, kAskEverySeconds);
  set(IPPROTO_TCP, TCP_KEEPCNT, kAsk);
  set(IPPROTO_TCP, TCP_USER_TIMEOUT, kUnacknowledgedMs);
  set(IPPROTO_TCP, TCP_NODELAY, 1);
}

}  // namespace

class Gateway::Listener {
 public:
  Listener(GatewayOptions options, PageFiles page, std::shared_ptr<grpc::Channel> server,
           rpc::WebSeal seal, const auth::TlsFiles* tls, telemetry::Metrics& metrics)
      : options_(std::move(options)),
        router_(options_.router, std::move(page)),
        seal_(std::move(seal)),
        tls_files_(tls),
        metrics_(metrics),
        common_{router_,
                seal_,
                std::move(server),
                options_.passed_on,
                options_.passed_on_by_proxy,
                options_.message_bytes,
                options_.router.identified,
                options_.patience,
                ByteBudget(options_.memory_bytes),
                Turns(kMessagesAtOnce),
                {},
                {},
                {},
                [this](int status) { CountAnswer(status); }},
        io_(options_.threads),
        work_(asio::make_work_guard(io_)),
        strand_(asio::make_strand(io_)),
        acceptor_(strand_),
        again_(strand_) {
    common_.one_at_a_time = asio::make_strand(io_);
  }

  ~Listener() {
    Stop(std::chrono::milliseconds(0));
    common_.one_at_a_time = {};  // before what it runs on
  }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  absl::Status Begin();
  void Stop(std::chrono::milliseconds patience);
  absl::Status RefreshTls();
  void Drain() { common_.draining = true; }
  int port() const { return port_; }

 private:
  // Gives a place back when its connection is gone.
  struct Place {
    Place(Listener& given_by, std::string of) : listener(given_by), address(std::move(of)) {}
    ~Place() { listener.GiveBack(*this); }
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;
    Listener& listener;
    const std::string address;
  };

  void Work();
  void Accept();
  void Take(Socket socket);
  std::shared_ptr<Place> TakePlace(const std::string& address);
  void GiveBack(const Place& place);
  void CountAnswer(int status);
  void EndAll(bool at_once);
  bool WaitForNone(std::chrono::milliseconds patience);

  const GatewayOptions options_;
  const Router router_;
  const rpc::WebSeal seal_;
  const auth::TlsFiles* const tls_files_;
  telemetry::Metrics& metrics_;
  Common common_;
  asio::io_context io_;
  asio::executor_work_guard<asio::io_context::executor_type> work_;
  asio::strand<asio::io_context::executor_type> strand_;  // of what follows
  Acceptor acceptor_;
  asio::steady_timer again_;
  std::vector<std::thread> threads_;
  int port_ = 0;
  std::string path_;
  bool stopped_ = false;

  std::mutex mutex_;
  std::condition_variable gone_;
  std::shared_ptr<asio::ssl::context> tls_ ABSL_GUARDED_BY(mutex_);
  size_t count_ ABSL_GUARDED_BY(mutex_) = 0;
  std::map<std::string, size_t> by_address_ ABSL_GUARDED_BY(mutex_);
  std::map<const Place*, std::weak_ptr<Connection>> connections_ ABSL_GUARDED_BY(mutex_);
};

absl::Status Gateway::Listener::RefreshTls() {
  // Sockets of the file system are not encrypted: their permissions protect them.
  if (tls_files_ == nullptr || !path_.empty()) return absl::OkStatus();
  absl::StatusOr<std::shared_ptr<asio::ssl::context>> made =
      MakeTlsContext(*tls_files_, {options_.ask_for_certificates, options_.require_certificates});
  if (!made.ok()) return made.status();
  const std::lock_guard<std::mutex> lock(mutex_);
  tls_ = *std::move(made);
  return absl::OkStatus();
}

absl::Status Gateway::Listener::Begin() {
  const absl::StatusOr<ParsedAddress> where = ParseWebAddress(options_.address);
  if (!where.ok()) return where.status();
  path_ = where->path;
  if (absl::Status ready = RefreshTls(); !ready.ok()) return ready;
  boost::system::error_code error;
  acceptor_.open(where->endpoint.protocol(), error);
  if (!error && where->path.empty()) {
    acceptor_.set_option(asio::socket_base::reuse_address(true), error);
  }
  if (!where->path.empty()) unlink(where->path.c_str());
  if (!error) acceptor_.bind(where->endpoint, error);
  if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
  if (error) {
    return absl::UnavailableError(
        absl::StrCat("cannot listen on '", options_.address, "' for the web: ", error.message()));
  }
  if (path_.empty()) {
    const StreamProtocol::endpoint bound = acceptor_.local_endpoint(error);
    const auto* any = reinterpret_cast<const sockaddr*>(bound.data());  // NOLINT: as above
    port_ = ntohs(any->sa_family == AF_INET6
                      ? reinterpret_cast<const sockaddr_in6*>(any)->sin6_port  // NOLINT
                      : reinterpret_cast<const sockaddr_in*>(any)->sin_port);  // NOLINT
  }
  metrics_.AddGauge("vantage_web_connections", "Connections to the web listener.", {}, [this] {
    const std::lock_guard<std::mutex> lock(mutex_);
    return static_cast<double>(count_);
  });
  asio::post(strand_, [this] { Accept(); });
  for (int i = 0; i < options_.threads; ++i) {
    threads_.emplace_back([this] { Work(); });
  }
  return absl::OkStatus();
}

void Gateway::Listener::Work() {
  while (true) {
    try {
      io_.run();
      return;
    } catch (const std::bad_alloc&) {
      // What ran is over. Its connection ends when nothing else of it is under way.
      metrics_
          .CounterOf("vantage_web_out_of_memory_total",
                     "Times that the web listener's memory did not suffice.")
          .Add();
    }
  }
}

void Gateway::Listener::Accept() {
  acceptor_.async_accept(asio::any_io_executor(asio::make_strand(io_)),
                         [this](const boost::system::error_code& error, Socket socket) {
                           if (error == asio::error::operation_aborted || !acceptor_.is_open())
                             return;
                           if (error) {
                             again_.expires_after(kAcceptAgain);
                             again_.async_wait([this](const boost::system::error_code& ended) {
                               if (!ended && acceptor_.is_open()) Accept();
                             });
                             return;
                           }
                           Take(std::move(socket));
                           Accept();
                         });
}

void Gateway::Listener::Take(Socket socket) {
  boost::system::error_code error;
  const StreamProtocol::endpoint remote = socket.remote_endpoint(error);
  if (error) return;
  PeerName name = NameOf(remote);
  std::shared_ptr<Place> place = TakePlace(name.address);
  if (place == nullptr) {
    metrics_
        .CounterOf("vantage_web_connections_refused_total",
                   "Connections to the web listener beyond its limits.")
        .Add();
    return;
  }
  if (path_.empty()) WatchLink(socket.native_handle());
  const asio::any_io_executor executor = socket.get_executor();
  const Place* const key = place.get();
  std::shared_ptr<asio::ssl::context> tls;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    tls = tls_;
  }
  const auto connection = std::make_shared<Connection>(
      common_, std::make_unique<Wire>(std::move(socket), std::move(tls)), executor,
      std::move(name.peer), std::move(place));
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    connections_[key] = connection;
  }
  asio::post(executor, [connection] { connection->Begin(); });
}

std::shared_ptr<Gateway::Listener::Place> Gateway::Listener::TakePlace(const std::string& address) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (count_ >= options_.connections) return nullptr;
    if (!address.empty()) {
      size_t& own = by_address_[address];
      if (own >= options_.connections_of_address) return nullptr;
      ++own;
    }
    ++count_;
    common_.crowded = count_ > options_.connections - options_.connections / 4;
  }
  return std::make_shared<Place>(*this, address);
}

void Gateway::Listener::GiveBack(const Place& place) {
  const std::lock_guard<std::mutex> lock(mutex_);
  --count_;
  common_.crowded = count_ > options_.connections - options_.connections / 4;
  if (!place.address.empty()) {
    const auto own = by_address_.find(place.address);
    if (--own->second == 0) by_address_.erase(own);
  }
  connections_.erase(&place);
  gone_.notify_all();
}

void Gateway::Listener::CountAnswer(int status) {
  metrics_
      .CounterOf("vantage_web_answers_total", "Answers of the web listener, by HTTP status.",
                 {{"status", absl::StrCat(status)}})
      .Add();
}

void Gateway::Listener::EndAll(bool at_once) {
  std::vector<std::shared_ptr<Connection>> there;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& [key, weak] : connections_) {
      if (std::shared_ptr<Connection> connection = weak.lock(); connection != nullptr) {
        there.push_back(std::move(connection));
      }
    }
  }
  for (const std::shared_ptr<Connection>& connection : there) connection->End(at_once);
}

bool Gateway::Listener::WaitForNone(std::chrono::milliseconds patience) {
  std::unique_lock<std::mutex> lock(mutex_);
  return gone_.wait_for(lock, patience, [this] { return count_ == 0; });
}

void Gateway::Listener::Stop(std::chrono::milliseconds patience) {
  if (std::exchange(stopped_, true)) return;
  common_.draining = true;
  if (!threads_.empty()) {
    asio::post(strand_, [this] {
      boost::system::error_code ignored;
      acceptor_.close(ignored);
      again_.cancel();
    });
    EndAll(false);
    for (bool none = WaitForNone(patience); !none; none = WaitForNone(kLookAgain)) EndAll(true);
  }
  work_.reset();
  io_.stop();
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
  if (!path_.empty()) unlink(path_.c_str());
}

Gateway::Gateway() = default;
Gateway::~Gateway() = default;

absl::StatusOr<std::unique_ptr<Gateway>> Gateway::Start(GatewayOptions options, PageFiles page,
                                                        std::shared_ptr<grpc::Channel> server,
                                                        rpc::WebSeal seal,
                                                        const auth::TlsFiles* tls,
                                                        telemetry::Metrics& metrics) {
  std::unique_ptr<Gateway> gateway(new Gateway);
  gateway->listener_ = std::make_unique<Listener>(std::move(options), std::move(page),
                                                  std::move(server), std::move(seal), tls, metrics);
  if (absl::Status begun = gateway->listener_->Begin(); !begun.ok()) return begun;
  return gateway;
}

int Gateway::port() const { return listener_->port(); }
absl::Status Gateway::RefreshTls() { return listener_->RefreshTls(); }
void Gateway::Drain() { listener_->Drain(); }
void Gateway::Stop(std::chrono::milliseconds patience) { listener_->Stop(patience); }

}  // namespace vantage::web

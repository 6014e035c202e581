#include "tests/faults/faulty_proxy.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <list>
#include <mutex>
#include <thread>
#include <utility>

#include "server/store/durable_file.h"

namespace vantage::faults {
namespace {

using Clock = std::chrono::steady_clock;

constexpr size_t kBufferBytes = 64 << 10;

sockaddr_in Loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

// Closes with a reset, so that the other end is told at once.
void Reset(store::FileDescriptor& socket) {
  const linger at_once{1, 0};
  setsockopt(socket.get(), SOL_SOCKET, SO_LINGER, &at_once, sizeof(at_once));
  socket = store::FileDescriptor();
}

// One way of a connection.
struct Way {
  std::string held;     // read and not yet written
  bool ended = false;   // its source has said all
  bool closed = false;  // and its destination knows
};

struct Connection {
  store::FileDescriptor client;
  store::FileDescriptor server;
  Way up;    // to the server
  Way down;  // to the client
  bool silent = false;
  size_t index = 0;  // of noticed
  Clock::time_point since;
};

}  // namespace

struct FaultyProxy::Wire {
  int server_port = 0;
  int port = 0;
  store::FileDescriptor listener;
  store::FileDescriptor stop{::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)};
  std::list<Connection> connections;
  std::deque<LinkFault> due;
  int64_t since_fault = 0;

  mutable std::mutex mutex;
  mutable std::condition_variable changed;
  int happened = 0;              // guarded by mutex
  std::vector<Noticed> noticed;  // guarded by mutex
  std::thread thread;

  void Run();
  void Accept();
  // False: the connection is over.
  bool Serve(Connection& connection, int client_events, int server_events);
  bool Carry(int from, int to, Way& way, bool from_client, Connection& connection);
  bool Discard(Connection& connection, bool client);
};

void FaultyProxy::Wire::Accept() {
  Connection made;
  made.client = store::FileDescriptor(
      ::accept4(listener.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
  if (!made.client.ok()) return;
  made.server = store::FileDescriptor(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const sockaddr_in address = Loopback(server_port);
  if (::connect(made.server.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) !=
      0) {
    return Reset(made.client);
  }
  ::fcntl(made.server.get(), F_SETFL, O_NONBLOCK);
  const int on = 1;
  setsockopt(made.client.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
  setsockopt(made.server.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
  connections.push_back(std::move(made));
}

bool FaultyProxy::Wire::Carry(int from, int to, Way& way, bool from_client,
                              Connection& connection) {
  if (!way.ended && way.held.size() < kBufferBytes) {
    std::array<char, kBufferBytes> bytes;
    const ssize_t got = ::recv(from, bytes.data(), bytes.size(), 0);
    if (got < 0 && errno != EAGAIN && errno != EINTR) return false;
    if (got == 0) way.ended = true;
    if (got > 0) {
      way.held.append(bytes.data(), static_cast<size_t>(got));
      if (from_client) since_fault += got;
    }
    if (from_client && !due.empty() && since_fault >= due.front().after_bytes) {
      const LinkFault fault = due.front();
      due.pop_front();
      since_fault = 0;
      const std::lock_guard<std::mutex> lock(mutex);
      ++happened;
      changed.notify_all();
      if (fault.kind == LinkFault::Kind::kCut) return false;
      connection.silent = true;
      connection.index = noticed.size();
      connection.since = Clock::now();
      noticed.emplace_back();
      return true;
    }
  }
  if (!way.held.empty()) {
    const ssize_t sent = ::send(to, way.held.data(), way.held.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno != EAGAIN && errno != EINTR) return false;
    if (sent > 0) way.held.erase(0, static_cast<size_t>(sent));
  }
  if (way.ended && way.held.empty() && !way.closed) {
    ::shutdown(to, SHUT_WR);
    way.closed = true;
  }
  return true;
}

// Swallows what comes of one end of a silent connection; notices when that end gives it up.
bool FaultyProxy::Wire::Discard(Connection& connection, bool client) {
  store::FileDescriptor& socket = client ? connection.client : connection.server;
  std::array<char, kBufferBytes> bytes;
  ssize_t got = 0;
  while ((got = ::recv(socket.get(), bytes.data(), bytes.size(), 0)) > 0) {
  }
  if (got < 0 && (errno == EAGAIN || errno == EINTR)) return true;
  socket = store::FileDescriptor();
  const std::lock_guard<std::mutex> lock(mutex);
  const double seconds = std::chrono::duration<double>(Clock::now() - connection.since).count();
  (client ? noticed[connection.index].client : noticed[connection.index].server) = seconds;
  changed.notify_all();
  return connection.client.ok() || connection.server.ok();
}

bool FaultyProxy::Wire::Serve(Connection& connection, int client_events, int server_events) {
  if (connection.silent) {
    bool goes_on = true;
    if (client_events != 0 && connection.client.ok()) goes_on = Discard(connection, true);
    if (server_events != 0 && connection.server.ok()) goes_on = Discard(connection, false);
    return goes_on;
  }
  const int client = connection.client.get();
  const int server = connection.server.get();
  if ((client_events != 0 || server_events != 0) &&
      !Carry(client, server, connection.up, true, connection)) {
    return false;
  }
  if (connection.silent) return true;
  if ((client_events != 0 || server_events != 0) &&
      !Carry(server, client, connection.down, false, connection)) {
    return false;
  }
  return !connection.up.closed || !connection.down.closed;
}

void FaultyProxy::Wire::Run() {
  while (true) {
    std::vector<pollfd> polled = {{stop.get(), POLLIN, 0}, {listener.get(), POLLIN, 0}};
    // What may be read, and written where something is held back.
    const auto wanted = [](const Way& in, const Way& out) -> int16_t {
      const bool reads = !in.ended && in.held.size() < kBufferBytes;
      return static_cast<int16_t>((reads ? POLLIN : 0) | (out.held.empty() ? 0 : POLLOUT));
    };
    for (const Connection& c : connections) {
      const int16_t client = c.silent ? int16_t{POLLIN} : wanted(c.up, c.down);
      const int16_t server = c.silent ? int16_t{POLLIN} : wanted(c.down, c.up);
      polled.push_back({c.client.get(), client, 0});
      polled.push_back({c.server.get(), server, 0});
    }
    if (::poll(polled.data(), polled.size(), -1) < 0 && errno != EINTR) return;
    if (polled[0].revents != 0) return;
    size_t at = 2;
    for (auto it = connections.begin(); it != connections.end(); at += 2) {
      if (Serve(*it, polled[at].revents, polled[at + 1].revents)) {
        ++it;
        continue;
      }
      if (it->client.ok()) Reset(it->client);
      if (it->server.ok()) Reset(it->server);
      it = connections.erase(it);
    }
    if (polled[1].revents != 0) Accept();
  }
}

FaultyProxy::FaultyProxy(const std::string& server, std::vector<LinkFault> faults)
    : wire_(std::make_unique<Wire>()) {
  wire_->server_port = std::stoi(server.substr(server.rfind(':') + 1));
  wire_->due.assign(faults.begin(), faults.end());
  wire_->listener =
      store::FileDescriptor(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  sockaddr_in address = Loopback(0);
  socklen_t size = sizeof(address);
  auto* any = reinterpret_cast<sockaddr*>(&address);
  if (::bind(wire_->listener.get(), any, size) != 0 || ::listen(wire_->listener.get(), 16) != 0 ||
      ::getsockname(wire_->listener.get(), any, &size) != 0) {
    return;  // nobody can connect, and the test says so
  }
  wire_->port = ntohs(address.sin_port);
  wire_->thread = std::thread([this] { wire_->Run(); });
}

FaultyProxy::~FaultyProxy() {
  const uint64_t one = 1;
  while (::write(wire_->stop.get(), &one, sizeof(one)) < 0 && errno == EINTR) {
  }
  if (wire_->thread.joinable()) wire_->thread.join();
  for (Connection& connection : wire_->connections) {
    if (connection.client.ok()) Reset(connection.client);
    if (connection.server.ok()) Reset(connection.server);
  }
}

std::string FaultyProxy::address() const { return "127.0.0.1:" + std::to_string(wire_->port); }

int FaultyProxy::faults() const {
  const std::lock_guard<std::mutex> lock(wire_->mutex);
  return wire_->happened;
}

std::vector<Noticed> FaultyProxy::WaitUntilNoticed(double seconds) const {
  std::unique_lock<std::mutex> lock(wire_->mutex);
  wire_->changed.wait_for(lock, std::chrono::duration<double>(seconds), [&] {
    for (const Noticed& ends : wire_->noticed) {
      if (ends.client < 0 || ends.server < 0) return false;
    }
    return true;
  });
  return wire_->noticed;
}

}  // namespace vantage::faults

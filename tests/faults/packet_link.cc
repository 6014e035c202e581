#include "tests/faults/packet_link.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/if_tun.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sched.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <deque>
#include <fstream>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/store/durable_file.h"

namespace vantage::faults {
namespace {

using Clock = std::chrono::steady_clock;

constexpr char kDevice[] = "link0";
constexpr int kMtu = 1500;
constexpr auto kLongestQueue = std::chrono::milliseconds(500);
constexpr std::array<const char*, 2> kAddresses = {"10.77.0.1", "10.77.0.2"};
constexpr int kProtocolTcp = 6;
constexpr int kStateEstablished = 1;  // in /proc/net/tcp

size_t IndexOf(LinkEnd end) { return end == LinkEnd::kClient ? 0 : 1; }

absl::Status SystemError(absl::string_view doing) {
  const int error = errno;
  const std::string message = absl::StrCat("cannot ", doing, ": ", std::strerror(error));
  return error == EPERM || error == EACCES ? absl::PermissionDeniedError(message)
                                           : absl::UnavailableError(message);
}

struct End {
  store::FileDescriptor name_space;
  store::FileDescriptor tun;
};

absl::Status BringUp(int control, const char* device) {
  ifreq request{};
  std::strncpy(request.ifr_name, device, IFNAMSIZ - 1);
  request.ifr_flags = IFF_UP | IFF_RUNNING;
  if (::ioctl(control, SIOCSIFFLAGS, &request) != 0) return SystemError("bring a device up");
  return absl::OkStatus();
}

absl::Status Assign(int control, unsigned long what, const char* address) {
  ifreq request{};
  std::strncpy(request.ifr_name, kDevice, IFNAMSIZ - 1);
  sockaddr_in assigned{};
  assigned.sin_family = AF_INET;
  inet_pton(AF_INET, address, &assigned.sin_addr);
  std::memcpy(&request.ifr_addr, &assigned, sizeof(assigned));
  if (::ioctl(control, what, &request) != 0) return SystemError("give a device an address");
  return absl::OkStatus();
}

// On a thread of its own, which is in the new namespace afterwards.
absl::StatusOr<End> MakeEnd(size_t index) {
  if (::unshare(CLONE_NEWNET) != 0) return SystemError("make a network namespace");
  End end;
  end.name_space = store::FileDescriptor(::open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC));
  if (!end.name_space.ok()) return SystemError("open the network namespace");
  end.tun = store::FileDescriptor(::open("/dev/net/tun", O_RDWR | O_CLOEXEC | O_NONBLOCK));
  if (!end.tun.ok()) return SystemError("open /dev/net/tun");
  ifreq request{};
  std::strncpy(request.ifr_name, kDevice, IFNAMSIZ - 1);
  request.ifr_flags = IFF_TUN | IFF_NO_PI;
  if (::ioctl(end.tun.get(), TUNSETIFF, &request) != 0) return SystemError("make a tun device");
  const store::FileDescriptor control(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (!control.ok()) return SystemError("open a socket");
  absl::Status done = Assign(control.get(), SIOCSIFADDR, kAddresses[index]);
  if (done.ok()) done = Assign(control.get(), SIOCSIFDSTADDR, kAddresses[1 - index]);
  if (done.ok()) done = BringUp(control.get(), kDevice);
  if (done.ok()) done = BringUp(control.get(), "lo");
  if (!done.ok()) return done;
  return end;
}

// Payload of a TCP packet over IPv4; 0 for anything else.
int64_t PayloadOf(const std::string& packet) {
  const auto byte = [&](size_t i) { return static_cast<unsigned char>(packet[i]); };
  if (packet.size() < 40 || byte(0) >> 4 != 4 || byte(9) != kProtocolTcp) return 0;
  const size_t total = static_cast<size_t>(byte(2)) << 8 | byte(3);
  const size_t ip = static_cast<size_t>(byte(0) & 15) * 4;
  if (packet.size() < ip + 20 || total > packet.size()) return 0;
  const size_t tcp = static_cast<size_t>(byte(ip + 12) >> 4) * 4;
  return static_cast<int64_t>(total) - static_cast<int64_t>(ip + tcp);
}

struct Waiting {
  Clock::time_point due;
  std::string packet;
};

// One way of the link.
struct Way {
  std::deque<Waiting> queue;  // by when they are due
  Clock::time_point free{};   // when the last one is sent
};

}  // namespace

struct PacketLink::Wire {
  std::array<End, 2> ends;
  store::FileDescriptor wake{::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)};
  std::mutex mutex;
  LinkConditions conditions;  // guarded by mutex
  std::atomic<bool> stopping{false};
  std::atomic<int64_t> sent{0};
  std::atomic<int64_t> delivered{0};
  std::mt19937 random;
  std::array<Way, 2> ways;  // from the client, from the server
  std::thread thread;

  void Wake() const {
    const uint64_t one = 1;
    while (::write(wake.get(), &one, sizeof(one)) < 0 && errno == EINTR) {
    }
  }
  void Run();
  void Take(size_t from, const LinkConditions& now, std::string packet);
  void Deliver(size_t from);
};

void PacketLink::Wire::Take(size_t from, const LinkConditions& now, std::string packet) {
  if (from == 0) sent += PayloadOf(packet);
  if (now.cut || (from == 1 && now.server_unheard)) return;
  if (std::uniform_real_distribution<double>()(random) < now.loss) return;
  Way& way = ways[from];
  const Clock::time_point time = Clock::now();
  way.free = std::max(way.free, time);
  if (now.bytes_per_second > 0) {
    if (way.free - time > kLongestQueue) return;
    way.free += std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(
        static_cast<double>(packet.size()) / static_cast<double>(now.bytes_per_second)));
  }
  Clock::time_point due = way.free + now.delay;
  if (!way.queue.empty()) due = std::max(due, way.queue.back().due);
  way.queue.push_back({due, std::move(packet)});
}

void PacketLink::Wire::Deliver(size_t from) {
  Way& way = ways[from];
  while (!way.queue.empty() && way.queue.front().due <= Clock::now()) {
    const std::string& packet = way.queue.front().packet;
    if (from == 0) delivered += PayloadOf(packet);
    // A packet that the other end has no room for is one more that is lost.
    if (::write(ends[1 - from].tun.get(), packet.data(), packet.size()) < 0 && errno == EINTR) {
      continue;
    }
    way.queue.pop_front();
  }
}

void PacketLink::Wire::Run() {
  std::string buffer(2 * kMtu, '\0');
  while (!stopping) {
    LinkConditions now;
    {
      const std::lock_guard<std::mutex> lock(mutex);
      now = conditions;
    }
    if (now.cut) ways = {};
    if (now.server_unheard) ways[1] = {};
    int patience = -1;
    for (const Way& way : ways) {
      if (way.queue.empty()) continue;
      const auto wait =
          std::chrono::ceil<std::chrono::milliseconds>(way.queue.front().due - Clock::now());
      const int milliseconds = static_cast<int>(std::max<int64_t>(0, wait.count()));
      patience = patience < 0 ? milliseconds : std::min(patience, milliseconds);
    }
    std::array<pollfd, 3> polled = {pollfd{wake.get(), POLLIN, 0},
                                    pollfd{ends[0].tun.get(), POLLIN, 0},
                                    pollfd{ends[1].tun.get(), POLLIN, 0}};
    if (::poll(polled.data(), polled.size(), patience) < 0 && errno != EINTR) return;
    uint64_t woken = 0;
    if (polled[0].revents != 0 && ::read(wake.get(), &woken, sizeof(woken)) > 0) continue;
    for (size_t from = 0; from < 2; ++from) {
      while (polled[from + 1].revents != 0) {
        const ssize_t got = ::read(ends[from].tun.get(), buffer.data(), buffer.size());
        if (got <= 0) break;
        Take(from, now, buffer.substr(0, static_cast<size_t>(got)));
      }
      Deliver(from);
    }
  }
}

absl::StatusOr<std::unique_ptr<PacketLink>> PacketLink::Make(uint32_t seed) {
  auto wire = std::make_unique<Wire>();
  wire->random.seed(seed);
  for (size_t i = 0; i < 2; ++i) {
    absl::Status made;
    std::thread([&] {
      absl::StatusOr<End> end = MakeEnd(i);
      made = end.status();
      if (end.ok()) wire->ends[i] = *std::move(end);
    }).join();
    if (!made.ok()) return made;
  }
  wire->thread = std::thread([self = wire.get()] { self->Run(); });
  return std::unique_ptr<PacketLink>(new PacketLink(std::move(wire)));
}

PacketLink::PacketLink(std::unique_ptr<Wire> wire) : wire_(std::move(wire)) {}

PacketLink::~PacketLink() {
  wire_->stopping = true;
  wire_->Wake();
  wire_->thread.join();
}

void PacketLink::Set(const LinkConditions& conditions) {
  {
    const std::lock_guard<std::mutex> lock(wire_->mutex);
    wire_->conditions = conditions;
  }
  wire_->Wake();
}

void PacketLink::RunAt(LinkEnd end, const std::function<void()>& call) const {
  std::thread([&] {
    if (::setns(wire_->ends[IndexOf(end)].name_space.get(), CLONE_NEWNET) == 0) call();
  }).join();
}

std::string PacketLink::AddressOf(LinkEnd end) { return kAddresses[IndexOf(end)]; }

int64_t PacketLink::SentBytes() const { return wire_->sent; }
int64_t PacketLink::DeliveredBytes() const { return wire_->delivered; }

int PacketLink::Established(LinkEnd end) const {
  in_addr other{};
  inet_pton(AF_INET, kAddresses[1 - IndexOf(end)], &other);
  int count = 0;
  RunAt(end, [&] {
    // Number, local address, remote address, state; in hexadecimal.
    for (const char* table : {"/proc/thread-self/net/tcp", "/proc/thread-self/net/tcp6"}) {
      std::ifstream in(table);
      std::string line;
      std::getline(in, line);
      while (std::getline(in, line)) {
        std::array<char, 8> number{};
        std::array<char, 64> local{};
        std::array<char, 64> remote{};
        unsigned state = 0;
        if (std::sscanf(line.c_str(), "%7s %63s %63s %x", number.data(), local.data(),
                        remote.data(), &state) != 4) {
          continue;
        }
        // An IPv6 socket has the IPv4 address in its last four bytes.
        const std::string peer =
            std::string(remote.data()).substr(0, std::string(remote.data()).find(':'));
        if (peer.size() < 8) continue;
        const auto address =
            static_cast<uint32_t>(std::stoul(peer.substr(peer.size() - 8), nullptr, 16));
        count += state == kStateEstablished && address == other.s_addr ? 1 : 0;
      }
    }
  });
  return count;
}

}  // namespace vantage::faults

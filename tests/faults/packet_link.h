// Two network namespaces, and between them a link of which we carry every packet: lossy, slow, late
// or dead to order. Needs CAP_NET_ADMIN, CAP_SYS_ADMIN and /dev/net/tun; nothing of it outlives the
// process.
#ifndef VANTAGE_TESTS_FAULTS_PACKET_LINK_H_
#define VANTAGE_TESTS_FAULTS_PACKET_LINK_H_

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "absl/status/statusor.h"

namespace vantage::faults {

// Both ways alike, but for `server_unheard`.
struct LinkConditions {
  double loss = 0;                     // share of packets, [0, 1]
  std::chrono::milliseconds delay{0};  // one way
  int64_t bytes_per_second = 0;        // 0: no limit; what half a second cannot carry is dropped
  bool cut = false;                    // nothing comes through
  bool server_unheard = false;         // nothing from the server comes through
};

enum class LinkEnd { kClient, kServer };

class PacketLink {
 public:
  // PERMISSION_DENIED or UNAVAILABLE, in words, where the system does not let us.
  static absl::StatusOr<std::unique_ptr<PacketLink>> Make(uint32_t seed);
  ~PacketLink();
  PacketLink(const PacketLink&) = delete;
  PacketLink& operator=(const PacketLink&) = delete;

  void Set(const LinkConditions& conditions);

  // Calls it on a thread in the namespace; programs that it starts are there, too.
  void RunAt(LinkEnd end, const std::function<void()>& call) const;
  static std::string AddressOf(LinkEnd end);

  // TCP payload from the client: that entered the link, and that came out at the server.
  int64_t SentBytes() const;
  int64_t DeliveredBytes() const;

  // TCP connections between the two that are established at this end.
  int Established(LinkEnd end) const;

 private:
  struct Wire;
  explicit PacketLink(std::unique_ptr<Wire> wire);
  const std::unique_ptr<Wire> wire_;
};

}  // namespace vantage::faults

#endif  // VANTAGE_TESTS_FAULTS_PACKET_LINK_H_

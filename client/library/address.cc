#include "client/library/address.h"

#include <arpa/inet.h>

#include "absl/strings/match.h"

namespace vantage::client {

bool StaysOnThisMachine(const std::string& server) {
  if (absl::StartsWith(server, "localhost:") || absl::StartsWith(server, "[::1]:") ||
      absl::StartsWith(server, "unix:")) {
    return true;
  }
  // A name may begin with 127., too.
  in_addr address{};
  return inet_pton(AF_INET, server.substr(0, server.find(':')).c_str(), &address) == 1 &&
         ntohl(address.s_addr) >> 24 == 127;
}

}  // namespace vantage::client

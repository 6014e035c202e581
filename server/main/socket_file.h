// Sockets in the file system that the server listens on, for a proxy on the same machine.
#ifndef VANTAGE_SERVER_MAIN_SOCKET_FILE_H_
#define VANTAGE_SERVER_MAIN_SOCKET_FILE_H_

#include <sys/types.h>

#include <string>

#include "absl/status/status.h"

namespace vantage::server {

// The path of 'unix:PATH' and 'unix:///PATH'; empty: `address` is another kind.
std::string SocketPath(const std::string& address);

// Checks that a server may listen at `path`; a socket that a server left when it was killed is no
// hindrance. (gRPC by itself would take the path away from a server that is still at work.)
// INVALID_ARGUMENT: the path is empty or too long, or something is there that is no socket.
// UNAVAILABLE: another server listens there, or the folder cannot be used. All name the path.
absl::Status CheckSocketFree(const std::string& path);

// Lets owner and group connect, nobody else. UNAVAILABLE names the path.
absl::Status OpenSocketToGroup(const std::string& path);

// While it lives, sockets that the process makes are for their owner alone, so that nobody gets in
// before they are opened to the group. Of the whole process: nothing else may make files meanwhile.
class OwnerAlone {
 public:
  OwnerAlone();
  ~OwnerAlone();
  OwnerAlone(const OwnerAlone&) = delete;
  OwnerAlone& operator=(const OwnerAlone&) = delete;

 private:
  const mode_t before_;
};

}  // namespace vantage::server

#endif  // VANTAGE_SERVER_MAIN_SOCKET_FILE_H_

#include "server/main/socket_file.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"

namespace vantage::server {
namespace {

constexpr mode_t kOwnerAndGroup = S_IRUSR | S_IWUSR | S_IRGRP | S_IWGRP;
constexpr mode_t kAllButOwner = S_IRWXG | S_IRWXO;

absl::Status CannotListen(const std::string& path, absl::string_view why) {
  return absl::UnavailableError(absl::StrCat("cannot listen on 'unix:", path, "': ", why));
}

absl::Status NoPlace(const std::string& path, absl::string_view why) {
  return absl::InvalidArgumentError(absl::StrCat("listen address 'unix:", path, "' ", why));
}

// 0: somebody listens at the path, or is too busy to answer; else the error of connect().
int ErrorOfConnecting(const sockaddr_un& address) {
  const int file = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (file < 0) return errno;
  const auto* any = reinterpret_cast<const sockaddr*>(&address);  // NOLINT: the system's way
  const int error = connect(file, any, sizeof address) == 0 ? 0 : errno;
  close(file);
  return error == EAGAIN ? 0 : error;
}

}  // namespace

std::string SocketPath(const std::string& address) {
  absl::string_view path = address;
  if (!absl::ConsumePrefix(&path, "unix:")) return "";
  absl::string_view absolute = path;
  if (absl::ConsumePrefix(&absolute, "//")) path = absolute;
  return std::string(path);
}

absl::Status CheckSocketFree(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) {
    return NoPlace(path, absl::StrCat("is longer than a socket's path may be: ",
                                      sizeof address.sun_path - 1, " bytes"));
  }
  std::memcpy(address.sun_path, path.data(), path.size());
  struct stat there {};
  if (lstat(path.c_str(), &there) != 0) {
    const int error = errno;
    const size_t slash = path.rfind('/');
    const std::string folder = slash == std::string::npos ? "." : path.substr(0, slash + 1);
    if (error == ENOENT && access(folder.c_str(), W_OK) == 0) return absl::OkStatus();
    return CannotListen(path, absl::StrCat("the server cannot make files in ", folder, " (",
                                           std::strerror(error == ENOENT ? errno : error), ")"));
  }
  if (!S_ISSOCK(there.st_mode)) {
    return NoPlace(path, "names something that is no socket: take it away, or name another path");
  }
  const int error = ErrorOfConnecting(address);
  if (error == ECONNREFUSED || error == ENOENT) return absl::OkStatus();  // left behind
  if (error == 0) return CannotListen(path, "another server listens there");
  return CannotListen(path, std::strerror(error));
}

absl::Status OpenSocketToGroup(const std::string& path) {
  if (chmod(path.c_str(), kOwnerAndGroup) == 0) return absl::OkStatus();
  return CannotListen(path, std::strerror(errno));
}

OwnerAlone::OwnerAlone() : before_(umask(kAllButOwner)) { umask(before_ | kAllButOwner); }

OwnerAlone::~OwnerAlone() { umask(before_); }

}  // namespace vantage::server

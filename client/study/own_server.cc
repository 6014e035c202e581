#include "client/study/own_server.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client/library/error.h"

namespace vantage::study {
namespace {

namespace fs = std::filesystem;

constexpr auto kPatience = std::chrono::seconds(30);
constexpr auto kPause = std::chrono::milliseconds(20);

bool IsProgram(const fs::path& path) { return ::access(path.c_str(), X_OK) == 0; }

std::string Contents(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

}  // namespace

std::string FindOnPath(const std::string& name) {
  const char* path = std::getenv("PATH");
  for (const absl::string_view folder : absl::StrSplit(path == nullptr ? "" : path, ':')) {
    const fs::path candidate = fs::path(std::string(folder)) / name;
    if (!folder.empty() && IsProgram(candidate)) return candidate.string();
  }
  return "";
}

std::string FindServerProgram() {
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  if (!error) {
    for (const fs::path& candidate :
         {self.parent_path() / "vantaged",
          self.parent_path().parent_path().parent_path() / "server" / "vantaged"}) {
      if (IsProgram(candidate)) return candidate.string();
    }
  }
  return FindOnPath("vantaged");
}

absl::StatusOr<std::unique_ptr<OwnServer>> OwnServer::Start(const std::string& program) {
  if (program.empty() || !IsProgram(program)) {
    return client::WithFix(
        absl::NotFoundError(absl::StrCat("there is no server program '",
                                         program.empty() ? "vantaged" : program, "' to start")),
        "name it with --vantaged, or a running server with --server");
  }
  std::string folder = (fs::temp_directory_path() / "vantage-study-XXXXXX").string();
  if (::mkdtemp(folder.data()) == nullptr) {
    return absl::PermissionDeniedError(absl::StrCat("cannot make a folder like ", folder));
  }
  const std::string port_file = folder + "/port";
  const std::string log_file = folder + "/log";
  const std::vector<const char*> arguments = {
      program.c_str(),   "--listen",    "127.0.0.1:0", "--threads",   "1",    "--port-file",
      port_file.c_str(), "--log-level", "warning",     "--in-memory", nullptr};
  const pid_t parent = ::getpid();
  const pid_t pid = ::fork();
  if (pid == 0) {
    // Only what is safe between fork and exec.
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != parent) ::_exit(127);
    const int log = ::open(log_file.c_str(), O_WRONLY | O_CREAT, 0600);
    if (log >= 0) {
      ::dup2(log, 1);
      ::dup2(log, 2);
    }
    ::execv(program.c_str(), const_cast<char* const*>(arguments.data()));
    ::_exit(127);
  }
  std::unique_ptr<OwnServer> server(new OwnServer(pid, folder));
  if (pid < 0) return absl::ResourceExhaustedError("no process could be started for the server");
  const auto begun = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() - begun < kPatience) {
    int status = 0;
    if (::waitpid(pid, &status, WNOHANG) == pid) {
      server->pid_ = -1;
      break;
    }
    std::string port = Contents(port_file);
    if (!port.empty() && port.back() == '\n') {
      port.pop_back();
      server->address_ = absl::StrCat("127.0.0.1:", port);
      return server;
    }
    std::this_thread::sleep_for(kPause);
  }
  return absl::UnavailableError(
      absl::StrCat("the server ", program, " did not start: ", Contents(log_file)));
}

OwnServer::~OwnServer() {
  if (pid_ > 0) {
    ::kill(pid_, SIGTERM);
    int status = 0;
    ::waitpid(pid_, &status, 0);
  }
  std::error_code error;
  fs::remove_all(folder_, error);
}

}  // namespace vantage::study

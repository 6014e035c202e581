#include "tests/integration/process.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/inotify.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "absl/strings/str_cat.h"

extern char** environ;  // NOLINT(readability-redundant-declaration)

namespace vantage::integration {
namespace {

constexpr int kStartMilliseconds = 60'000;

pid_t Spawn(const std::vector<std::string>& arguments, int out, int error) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, out, 1);
  posix_spawn_file_actions_adddup2(&actions, error, 2);
  std::vector<char*> argv;
  for (const std::string& argument : arguments) {
    argv.push_back(const_cast<char*>(argument.c_str()));  // NOLINT: posix_spawn's signature
  }
  argv.push_back(nullptr);
  pid_t pid = -1;
  const int failed = posix_spawn(&pid, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  EXPECT_EQ(failed, 0) << "cannot start " << arguments[0];
  return failed == 0 ? pid : -1;
}

int WaitFor(pid_t pid, rusage* usage = nullptr) {
  int status = 0;
  while (wait4(pid, &status, 0, usage) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

// Resident memory of a process and of those that its main thread has started, MB.
double TogetherMegabytes(pid_t pid) {
  const std::string folder = absl::StrCat("/proc/", pid);
  double pages = 0;
  std::ifstream children(absl::StrCat(folder, "/task/", pid, "/children"));
  for (std::string process = absl::StrCat(pid); !process.empty();) {
    double all = 0;
    double resident = 0;
    std::ifstream("/proc/" + process + "/statm") >> all >> resident;
    pages += resident;
    if (!(children >> process)) process.clear();
  }
  return pages * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

// Until it ends; the most that it and its children held at one time.
double WatchMegabytes(pid_t pid) {
  const int process = static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
  double most = 0;
  pollfd end = {process, POLLIN, 0};
  while (process >= 0 && poll(&end, 1, 10) == 0) most = std::max(most, TogetherMegabytes(pid));
  close(process);
  return most;
}

// Waits until the file is there or the process has ended.
bool WaitForFile(const std::string& folder, const std::string& file, pid_t pid) {
  const int watch = inotify_init1(IN_CLOEXEC | IN_NONBLOCK);
  inotify_add_watch(watch, folder.c_str(), IN_CLOSE_WRITE | IN_MOVED_TO);
  const int process = static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
  bool found = false;
  while (!(found = !Contents(file).empty())) {
    std::array<pollfd, 2> events = {pollfd{watch, POLLIN, 0}, pollfd{process, POLLIN, 0}};
    if (poll(events.data(), events.size(), kStartMilliseconds) <= 0) break;
    if ((events[1].revents & POLLIN) != 0) break;
    std::array<char, 4096> drained;
    while (read(watch, drained.data(), drained.size()) > 0) {
    }
  }
  close(watch);
  close(process);
  return found;
}

}  // namespace

std::string Contents(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream contents;
  contents << file.rdbuf();
  return contents.str();
}

ScratchFolder::ScratchFolder() {
  std::string name = ::testing::TempDir() + "/vantage-XXXXXX";
  path_ = mkdtemp(name.data());
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

Finished RunProgram(const std::vector<std::string>& arguments) {
  const ScratchFolder folder;
  const int out = open(folder.File("out").c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600);
  const int error = open(folder.File("error").c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600);
  const pid_t pid = Spawn(arguments, out, error);
  Finished finished;
  rusage usage{};
  const double together = pid > 0 ? WatchMegabytes(pid) : 0;
  if (pid > 0) finished.exit_code = WaitFor(pid, &usage);
  finished.peak_megabytes = std::max(together, static_cast<double>(usage.ru_maxrss) * 1024 / 1e6);
  close(out);
  close(error);
  finished.out = Contents(folder.File("out"));
  finished.error = Contents(folder.File("error"));
  return finished;
}

ServerProcess::ServerProcess(const std::string& data, const std::string& host,
                             const std::vector<std::string>& flags) {
  const int log =
      open(folder_.File("log").c_str(), O_CREAT | O_WRONLY | O_APPEND | O_CLOEXEC, 0600);
  const std::string port_file = folder_.File("port");
  std::vector<std::string> command = {VANTAGED_BINARY,
                                      "--listen",
                                      host + ":0",
                                      "--port-file",
                                      port_file,
                                      "--data",
                                      data.empty() ? folder_.File("data") : data};
  command.insert(command.end(), flags.begin(), flags.end());
  pid_ = Spawn(command, log, log);
  close(log);
  if (pid_ < 0) return;
  if (!WaitForFile(folder_.path(), port_file, pid_)) {
    ADD_FAILURE() << "the server did not start:\n" << Log();
    return;
  }
  std::string port = Contents(port_file);
  port.erase(port.find_last_not_of("\n ") + 1);
  address_ = host + ":" + port;
}

ServerProcess::~ServerProcess() {
  if (pid_ > 0) Stop(SIGKILL);
}

double ServerProcess::CpuSeconds() const {
  clockid_t clock{};
  timespec used{};
  if (::clock_getcpuclockid(pid_, &clock) != 0 || ::clock_gettime(clock, &used) != 0) return 0;
  return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
}

double ServerProcess::PeakMegabytes() const {
  std::ifstream status(absl::StrCat("/proc/", pid_, "/status"));
  std::string word;
  double kibibytes = 0;
  while (status >> word) {
    if (word == "VmHWM:" && status >> kibibytes) return kibibytes * 1024 / 1e6;
  }
  return 0;
}

void ServerProcess::Signal(int signal) const {
  if (pid_ > 0) kill(pid_, signal);
}

int ServerProcess::Stop(int signal) {
  if (pid_ <= 0) return -1;
  kill(pid_, signal);
  const int code = WaitFor(pid_);
  pid_ = -1;
  return code;
}

std::string ServerProcess::Log() const { return Contents(folder_.File("log")); }

Finished Vantage(const ServerProcess& server, std::vector<std::string> arguments) {
  std::vector<std::string> command = {VANTAGE_BINARY, "--server", server.address(), "--timeout",
                                      "300"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return RunProgram(command);
}

}  // namespace vantage::integration

// Programs run by tests: the server in the background, commands to their end.
#ifndef VANTAGE_TESTS_INTEGRATION_PROCESS_H_
#define VANTAGE_TESTS_INTEGRATION_PROCESS_H_

#include <sys/types.h>

#include <memory>
#include <string>
#include <vector>

namespace vantage::integration {

struct Finished {
  int exit_code = -1;  // -1: killed by a signal
  std::string out;
  std::string error;
  // The most memory that it held, with the processes that it had started; what started it had held
  // counts, too. Looked at every 10 ms.
  double peak_megabytes = 0;
};

// What a file holds; empty where it cannot be read.
std::string Contents(const std::string& path);

// Runs a program to its end. Arguments go to it as they are; no shell.
Finished RunProgram(const std::vector<std::string>& arguments);

// A temporary folder that is removed with the object.
class ScratchFolder {
 public:
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const std::string& path() const { return path_; }
  std::string File(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

// The real server on a port of the system's choice.
class ServerProcess {
 public:
  // Returns when the server says that it serves; fails the test when it ends before. It keeps its
  // data in `data`, or in a folder of its own. `host` is where it listens, `flags` are more of its
  // command line.
  explicit ServerProcess(const std::string& data = "", const std::string& host = "127.0.0.1",
                         const std::vector<std::string>& flags = {});
  ~ServerProcess();
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;

  // HOST:PORT; empty when the server did not start.
  const std::string& address() const { return address_; }

  // Processor time of all its threads so far.
  double CpuSeconds() const;

  // The most memory that it held so far, MB; 0 where the system does not say.
  double PeakMegabytes() const;

  // Sends a signal that does not end it.
  void Signal(int signal) const;
  // Sends the signal and waits for the end; the exit code, -1 when a signal killed it.
  int Stop(int signal);

  std::string Log() const;

 private:
  ScratchFolder folder_;
  pid_t pid_ = -1;
  std::string address_;
};

// The real command line against a server.
Finished Vantage(const ServerProcess& server, std::vector<std::string> arguments);

}  // namespace vantage::integration

#endif  // VANTAGE_TESTS_INTEGRATION_PROCESS_H_

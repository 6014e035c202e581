// A planning server of the study's own, with one thread that computes, so that a budget means the
// same however many jobs run side by side.
#ifndef VANTAGE_CLIENT_STUDY_OWN_SERVER_H_
#define VANTAGE_CLIENT_STUDY_OWN_SERVER_H_

#include <sys/types.h>

#include <memory>
#include <string>

#include "absl/status/statusor.h"

namespace vantage::study {

class OwnServer {
 public:
  // Starts `program` on a free loopback port and returns once it serves. Call from a thread that
  // lives as long as the server should: it ends with that thread at the latest. NOT_FOUND: no such
  // program. UNAVAILABLE: it ended or did not serve within half a minute; the end of its output is
  // in the message.
  static absl::StatusOr<std::unique_ptr<OwnServer>> Start(const std::string& program);
  ~OwnServer();
  OwnServer(const OwnServer&) = delete;
  OwnServer& operator=(const OwnServer&) = delete;

  const std::string& address() const { return address_; }  // host:port

 private:
  OwnServer(pid_t pid, std::string folder) : pid_(pid), folder_(std::move(folder)) {}

  pid_t pid_;
  std::string folder_;
  std::string address_;
};

// The most likely path of vantaged: beside this program, in its build tree, or on PATH. Empty: not
// found.
std::string FindServerProgram();

// A program on PATH; empty where there is none.
std::string FindOnPath(const std::string& name);

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_OWN_SERVER_H_

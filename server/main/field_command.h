// 'vantaged field': a server for a site, on a laptop there, and the devices that it knows.
#ifndef VANTAGE_SERVER_MAIN_FIELD_COMMAND_H_
#define VANTAGE_SERVER_MAIN_FIELD_COMMAND_H_

#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/field/devices.h"
#include "server/field/field_site.h"
#include "server/field/log_file.h"
#include "server/main/server.h"

namespace vantage::server {

// What the command line says of it.
struct FieldCommand {
  const CLI::App* field = nullptr;
  const CLI::App* devices = nullptr;
  const CLI::App* pair = nullptr;
  const CLI::App* revoke = nullptr;
  const CLI::Option* code_flag = nullptr;
  std::string data;  // as given; empty: not
  std::string address;
  int port = field::kDefaultPort;
  std::string first;  // is paired when the server starts; empty: one where none is paired yet
  bool code = false;
  field::Pairing pairing;
  int days = 365;
  std::string revoked;

  bool given() const { return field->parsed(); }
  // It is for the devices alone, and serves nothing.
  bool only_devices() const { return devices->parsed() || pair->parsed() || revoke->parsed(); }
};

void DeclareField(CLI::App& app, FieldCommand& command);

// INVALID_ARGUMENT: the command line, or the configuration, has options of `app` that would make
// something else of it, such as another certificate.
absl::Status CheckFieldOptions(const CLI::App& app);

// The folder of a crew's data on this computer: what a container or a unit names, else that of
// desktops. Empty: none is known.
std::string DefaultFieldData();

// Does what is asked of the devices; says so on standard output.
absl::Status RunOnDevices(FieldCommand& command, const std::string& data);

// A site that is served.
class FieldServing {
 public:
  // Begins with a data folder that this process has locked, and changes the server's options.
  // Errors are as of FieldSite::Open and say what to do.
  static absl::StatusOr<std::unique_ptr<FieldServing>> Open(const FieldCommand& command,
                                                            const std::string& data,
                                                            ServerOptions& options);

  // The server serves: pairs a first device where that is asked for, and says on standard output
  // how to reach it.
  absl::Status Begin(Server& server);
  // Every few seconds: has the server show a certificate for the addresses of now, and says where
  // it is when that changed.
  void Look(Server& server);

  // Where this machine's own command line calls.
  std::string socket() const { return site_->socket(); }

  // What went wrong with the server's start, with what to do about it.
  absl::Status Explain(const absl::Status& status) const;

 private:
  FieldServing(const FieldCommand& command, std::string data)
      : command_(command), data_(std::move(data)) {}
  std::string CommandLine() const;

  const FieldCommand& command_;
  const std::string data_;
  std::unique_ptr<field::FieldSite> site_;
  bool has_page_ = false;
  std::string told_error_;
};

// Where a server whose standard error is a terminal writes its log instead, so that the code can be
// read there; null: standard error.
absl::StatusOr<std::unique_ptr<field::LogFile>> FieldLog(const std::string& data);

}  // namespace vantage::server

#endif  // VANTAGE_SERVER_MAIN_FIELD_COMMAND_H_

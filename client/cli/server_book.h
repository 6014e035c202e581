// Servers by name, from the user's configuration file.
#ifndef VANTAGE_CLIENT_CLI_SERVER_BOOK_H_
#define VANTAGE_CLIENT_CLI_SERVER_BOOK_H_

#include <map>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace vantage::cli {

// As the flags of those names; files as they are found from here. Absent: not said.
struct NamedServer {
  std::string address;
  std::optional<std::string> tls_ca;
  std::optional<std::string> tls_cert;
  std::optional<std::string> tls_key;
  std::optional<std::string> token_file;
  std::optional<double> timeout;  // s
};

struct ServerBook {
  std::string path;  // of the file
  bool found = false;
  std::string default_server;  // one of the names, or empty
  std::map<std::string, NamedServer> servers;

  // INVALID_ARGUMENT: there is none of that name; says which there are.
  absl::StatusOr<NamedServer> Find(const std::string& name) const;
};

// What `--server` takes for a name: anything that cannot be an address.
bool IsServerName(absl::string_view server);

// $XDG_CONFIG_HOME/vantage/config.toml, or ~/.config/vantage/config.toml; empty without a home.
std::string DefaultServerBookPath();

// INVALID_ARGUMENT names file, line, key and what to write instead.
absl::StatusOr<ServerBook> ParseServerBook(absl::string_view text, const std::string& path);

// A file that is not there is an empty book, unless it was asked for: NOT_FOUND.
absl::StatusOr<ServerBook> ReadServerBook(const std::string& path, bool asked_for);

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_SERVER_BOOK_H_

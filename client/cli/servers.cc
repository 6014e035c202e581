#include <cstdio>

#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/table.h"

namespace vantage::cli {
namespace {

struct ServersArguments {
  bool json = false;
};

absl::StatusOr<ExitCode> RunServers(Environment& environment, const ServersArguments& arguments) {
  const absl::StatusOr<ServerBook> book = environment.ReadBook();
  if (!book.ok()) return book.status();
  if (arguments.json) {
    Json all = {
        {"file", book->path}, {"default", book->default_server}, {"servers", Json::array()}};
    for (const auto& [name, server] : book->servers) {
      Json one = {{"name", name}, {"address", server.address}};
      if (server.tls_ca) one["tlsCa"] = *server.tls_ca;
      if (server.tls_cert) one["tlsCert"] = *server.tls_cert;
      if (server.tls_key) one["tlsKey"] = *server.tls_key;
      if (server.token_file) one["tokenFile"] = *server.token_file;
      if (server.timeout) one["timeoutS"] = *server.timeout;
      all["servers"].push_back(std::move(one));
    }
    PrintJson(all);
    return ExitCode::kOk;
  }
  if (book->servers.empty()) {
    std::printf("no servers are named in %s\n", book->path.c_str());
    return ExitCode::kOk;
  }
  Table table({"server", "address", "encrypted", "token", ""});
  for (const auto& [name, server] : book->servers) {
    table.Add({name, server.address, server.tls_ca ? "yes" : "no", server.token_file ? "yes" : "no",
               name == book->default_server ? "where none is named" : ""});
  }
  std::fputs(table.ToString().c_str(), stdout);
  return ExitCode::kOk;
}

}  // namespace

void AddServers(CLI::App& parent, Environment& environment) {
  AddCommand<ServersArguments>(
      parent, environment, "servers", "List the servers that the configuration file names",
      "  vantage servers\n  vantage --server office doctor      (one of them)",
      [](CLI::App& command, ServersArguments& a) {
        command.add_flag("--json", a.json, "Print them as JSON");
      },
      RunServers);
}

}  // namespace vantage::cli

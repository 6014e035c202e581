#include "client/cli/server_book.h"

#include <toml++/toml.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/library/error.h"

namespace vantage::cli {
namespace {

constexpr char kServerKeys[] = "address, tls_ca, tls_cert, tls_key, token_file, timeout_s";
constexpr char kExample[] =
    "as in: [servers.office] and below it address = \"vantage.example:7443\"";

std::string HomeFolder() {
  const char* home = std::getenv("HOME");
  return home == nullptr ? "" : home;
}

absl::Status Wrong(const std::string& path, const toml::source_region& where,
                   absl::string_view what, absl::string_view cure) {
  return client::WithFix(
      absl::InvalidArgumentError(absl::StrCat(path, ", line ", where.begin.line, ": ", what)),
      std::string(cure));
}

// '~/' is the home folder, and what is not absolute lies beside the configuration file.
std::string FileOf(const std::string& named, const std::string& book) {
  if (absl::StartsWith(named, "~/")) return absl::StrCat(HomeFolder(), named.substr(1));
  return (std::filesystem::path(book).parent_path() / named).string();
}

absl::StatusOr<std::string> TextOf(const std::string& path, absl::string_view key,
                                   const toml::node& node) {
  const std::optional<std::string> text = node.value<std::string>();
  if (!node.is_string() || text->empty()) {
    return Wrong(path, node.source(), absl::StrCat("'", key, "' has to be a text"),
                 absl::StrCat("write it in quotes: ", key, " = \"...\""));
  }
  return *text;
}

absl::StatusOr<NamedServer> ServerFrom(const std::string& path, const std::string& name,
                                       const toml::table& table) {
  NamedServer server;
  for (const auto& [toml_key, node] : table) {
    const std::string key(toml_key.str());
    if (key == "timeout_s") {
      const std::optional<double> seconds = node.value<double>();
      constexpr double kDay = 86'400;
      if (!node.is_number() || !seconds || !(*seconds > 0 && *seconds <= kDay)) {
        return Wrong(path, node.source(),
                     "'timeout_s' has to be a number of seconds above 0, at most a day",
                     "write it without quotes: timeout_s = 30");
      }
      server.timeout = seconds;
      continue;
    }
    std::optional<std::string>* file = nullptr;
    if (key == "tls_ca") file = &server.tls_ca;
    if (key == "tls_cert") file = &server.tls_cert;
    if (key == "tls_key") file = &server.tls_key;
    if (key == "token_file") file = &server.token_file;
    if (file == nullptr && key != "address") {
      return Wrong(path, toml_key.source(), absl::StrCat("a server has no key '", key, "'"),
                   absl::StrCat("there are ", kServerKeys));
    }
    const absl::StatusOr<std::string> text = TextOf(path, key, node);
    if (!text.ok()) return text.status();
    if (file != nullptr) {
      *file = FileOf(*text, path);
    } else if (IsServerName(*text)) {
      return Wrong(path, node.source(), absl::StrCat("'", *text, "' is no address"),
                   "write HOST:PORT, or unix:PATH");
    } else {
      server.address = *text;
    }
  }
  if (server.address.empty()) {
    return Wrong(path, table.source(), absl::StrCat("the server '", name, "' has no address"),
                 "add the line address = \"HOST:PORT\" below its name");
  }
  return server;
}

std::string Names(const ServerBook& book) {
  return absl::StrJoin(book.servers, ", ",
                       [](std::string* out, const auto& entry) { out->append(entry.first); });
}

absl::StatusOr<ServerBook> BookFrom(const std::string& path, const toml::table& table) {
  ServerBook book;
  book.path = path;
  book.found = true;
  const toml::node* chosen = nullptr;
  for (const auto& [toml_key, node] : table) {
    const std::string key(toml_key.str());
    if (key == "default") {
      const absl::StatusOr<std::string> name = TextOf(path, key, node);
      if (!name.ok()) return name.status();
      book.default_server = *name;
      chosen = &node;
    } else if (key == "servers" && node.is_table()) {
      for (const auto& [toml_name, entry] : *node.as_table()) {
        const std::string name(toml_name.str());
        if (!entry.is_table()) {
          return Wrong(path, toml_name.source(), absl::StrCat("'", name, "' is no server"),
                       kExample);
        }
        if (!IsServerName(name)) {
          return Wrong(path, toml_name.source(), absl::StrCat("'", name, "' is no name"),
                       "a name has no ':', since that is how an address is known");
        }
        absl::StatusOr<NamedServer> server = ServerFrom(path, name, *entry.as_table());
        if (!server.ok()) return server.status();
        book.servers.emplace(name, *std::move(server));
      }
    } else {
      return Wrong(path, toml_key.source(), absl::StrCat("there is no key '", key, "'"),
                   absl::StrCat("there are default and servers, ", kExample));
    }
  }
  if (chosen != nullptr && book.servers.count(book.default_server) == 0) {
    return Wrong(
        path, chosen->source(),
        absl::StrCat("the default '", book.default_server, "' is none of the servers"),
        book.servers.empty() ? std::string(kExample) : absl::StrCat("there are ", Names(book)));
  }
  return book;
}

}  // namespace

absl::StatusOr<NamedServer> ServerBook::Find(const std::string& name) const {
  const auto at = servers.find(name);
  if (at != servers.end()) return at->second;
  return client::WithFix(absl::InvalidArgumentError(
                             absl::StrCat("there is no server called '", name, "' in ",
                                          path.empty() ? std::string("a configuration file") : path,
                                          found ? "" : ", which is not there")),
                         servers.empty()
                             ? absl::StrCat("name it there, ", kExample, ", or give HOST:PORT")
                             : absl::StrCat("there are ", Names(*this), "; or give HOST:PORT"));
}

bool IsServerName(absl::string_view server) {
  return !server.empty() && !absl::StrContains(server, ':') && !absl::StrContains(server, '/');
}

std::string DefaultServerBookPath() {
  const char* folder = std::getenv("XDG_CONFIG_HOME");
  if (folder != nullptr && *folder == '/') return absl::StrCat(folder, "/vantage/config.toml");
  const std::string home = HomeFolder();
  return home.empty() ? "" : absl::StrCat(home, "/.config/vantage/config.toml");
}

absl::StatusOr<ServerBook> ParseServerBook(absl::string_view text, const std::string& path) {
  try {
    return BookFrom(path, toml::parse(std::string_view(text.data(), text.size()), path));
  } catch (const toml::parse_error& error) {
    return Wrong(path, error.source(), std::string(error.description()),
                 "the file is TOML: names in brackets, texts in quotes");
  }
}

absl::StatusOr<ServerBook> ReadServerBook(const std::string& path, bool asked_for) {
  ServerBook none;
  none.path = path;
  std::error_code error;
  if (path.empty() || (!asked_for && !std::filesystem::exists(path, error))) return none;
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file.good()) {
    return client::WithFix(absl::NotFoundError(absl::StrCat("cannot read ", path)),
                           "name another file with --client-config or VANTAGE_CONFIG");
  }
  return ParseServerBook(std::move(text).str(), path);
}

}  // namespace vantage::cli

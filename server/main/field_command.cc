#include "server/main/field_command.h"

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "server/field/greeting.h"
#include "server/main/environment.h"
#include "server/store/durable_file.h"

namespace vantage::server {
namespace {

// The name of a first device that nobody named.
constexpr char kFirstTablet[] = "tablet-1";

// Within this a server that runs reads the list of devices again (kCallersRefresh, server.cc), and
// a stream that has nothing to say speaks, or ends (ServerOptions::heartbeat).
constexpr char kRevoked[] =
    "revoked: its calls are refused within 2 s, what it watches ends within 10 s.";

bool ShowsCode(const FieldCommand& command) {
  return command.code_flag->count() > 0 ? command.code : isatty(STDOUT_FILENO) != 0;
}

void Say(const std::string& text) {
  std::fputs(text.c_str(), stdout);
  std::fflush(stdout);
}

absl::Status Pair(FieldCommand& command, const std::string& folder) {
  const absl::StatusOr<std::string> page = field::ServedPage(folder);
  if (!page.ok()) {
    return absl::FailedPreconditionError(
        absl::StrCat(page.status().message(), ": start it, with --pair NAME for a device more"));
  }
  command.pairing.good_for = absl::Hours(24) * command.days;
  const absl::StatusOr<std::string> token =
      field::Devices(folder).Pair(command.pairing, absl::Now());
  if (!token.ok()) return token.status();
  Say(field::PairingText(command.pairing.name, field::PairingLink(*page, *token),
                         ShowsCode(command)));
  return absl::OkStatus();
}

}  // namespace

void DeclareField(CLI::App& app, FieldCommand& command) {
  CLI::App* field = app.add_subcommand(
      "field",
      "serve a site from a laptop there: the page for tablets on the local network, encrypted, and "
      "a code that pairs a tablet. Takes the options of vantaged, too (--data, --threads, --http "
      "and others)");
  field->fallthrough();
  field->require_subcommand(0, 1);
  field
      ->add_option("--data", command.data,
                   "folder of the jobs, the certificate and the devices; by default "
                   "$XDG_DATA_HOME/vantage or ~/.local/share/vantage")
      ->configurable(false);
  field->add_option("--address", command.address,
                    "serve the page at this address of the computer; by default at all");
  field->add_option("--port", command.port, "port of the page; 0 takes a free one")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  field->add_option("--pair", command.first,
                    "pair a device of this name at the start; without, 'tablet-1' where none is "
                    "paired yet");
  command.code_flag = field->add_flag(
      "--qr,!--no-qr", command.code,
      "show links as QR codes, or don't; by default where standard output is a terminal");
  CLI::App* devices = field->add_subcommand("devices", "list the devices that are paired");
  CLI::App* pair = field->add_subcommand(
      "pair", "pair one more device, while the server runs: shows its link and its code");
  pair->add_option("name", command.pairing.name, "what to call it")->required();
  pair->add_option("--roles", command.pairing.roles,
                   "what it may do, of read,submit,plan,administer")
      ->capture_default_str();
  pair->add_option("--days", command.days, "how long it is good for")
      ->check(CLI::Range(1, 3650))
      ->capture_default_str();
  pair->add_flag("--replace", command.pairing.replace,
                 "the device that has the name until now has it no more");
  CLI::App* revoke = field->add_subcommand("revoke", "take back what a device was paired with");
  revoke->add_option("name", command.revoked, "its name")->required();
  for (CLI::App* tool : {devices, pair, revoke}) tool->fallthrough();
  command.field = field;
  command.devices = devices;
  command.pair = pair;
  command.revoke = revoke;
}

absl::Status CheckFieldOptions(const CLI::App& app) {
  for (const char* name :
       {"--web", "--tls-cert", "--tls-key", "--tls-client-ca", "--tls-optional-client-certificates",
        "--callers", "--jwt-keys", "--tenant-metadata", "--certificate-metadata",
        "--address-metadata", "--in-memory", "--healthcheck"}) {
    if (app.get_option(name)->count() == 0) continue;
    return absl::InvalidArgumentError(absl::StrCat(
        "'vantaged field' has a page, a certificate and devices of its own: leave out ", name,
        ", or start plain 'vantaged'"));
  }
  return absl::OkStatus();
}

std::string DefaultFieldData() {
  const std::string given = Variable("STATE_DIRECTORY");
  if (!given.empty()) return given.substr(0, given.find(':'));
  const std::string data = Variable("XDG_DATA_HOME");
  if (!data.empty()) return data + "/vantage";
  const std::string home = Variable("HOME");
  return home.empty() ? "" : home + "/.local/share/vantage";
}

absl::Status RunOnDevices(FieldCommand& command, const std::string& data) {
  const std::string folder = field::FieldFolderOf(data);
  if (access(folder.c_str(), X_OK) != 0) {
    return absl::NotFoundError(absl::StrCat(
        data,
        " holds no data of 'vantaged field' that you may use: start it first, or name them "
        "with --data"));
  }
  if (*command.pair) return Pair(command, folder);
  field::Devices devices(folder);
  if (*command.revoke) {
    if (absl::Status revoked = devices.Revoke(command.revoked); !revoked.ok()) return revoked;
    Say(absl::StrCat(command.revoked, " is ", kRevoked, "\n"));
    return absl::OkStatus();
  }
  const absl::StatusOr<std::vector<field::Device>> listed = devices.List();
  if (!listed.ok()) return listed.status();
  Say(field::DeviceTable(*listed, absl::Now()));
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<FieldServing>> FieldServing::Open(const FieldCommand& command,
                                                                 const std::string& data,
                                                                 ServerOptions& options) {
  std::unique_ptr<FieldServing> serving(new FieldServing(command, data));
  absl::StatusOr<std::unique_ptr<field::FieldSite>> site =
      field::FieldSite::Open({data, command.address, command.port}, absl::Now());
  if (!site.ok()) return site.status();
  serving->site_ = *std::move(site);
  serving->has_page_ = !options.web_root.empty();
  serving->site_->Protect(options.access);
  options.listen.push_back(serving->site_->socket());
  options.web_listen = serving->site_->page_listen();
  options.web_authority = serving->site_->certificate().authority_der;
  return serving;
}

std::string FieldServing::CommandLine() const {
  return data_ == DefaultFieldData()
             ? "vantaged field"
             : absl::StrCat("vantaged field --data ", field::ShellQuoted(data_));
}

absl::Status FieldServing::Begin(Server& server) {
  if (absl::Status begun = site_->Begin(server.web_port()); !begun.ok()) return begun;
  absl::StatusOr<std::vector<field::Device>> devices = site_->devices().List();
  if (!devices.ok()) return devices.status();
  std::string pairing;
  const std::string name =
      command_.first.empty() && devices->empty() ? kFirstTablet : command_.first;
  if (!name.empty()) {
    const absl::StatusOr<std::string> token = site_->devices().Pair({name}, absl::Now());
    if (!token.ok()) return token.status();
    server.RefreshCallers();
    pairing =
        field::PairingText(name, field::PairingLink(site_->page(), *token), ShowsCode(command_));
    devices = site_->devices().List();
    if (!devices.ok()) return devices.status();
  }
  Say(absl::StrCat(field::AddressText(*site_, CommandLine()),
                   has_page_ ? ""
                             : "\nThis program was installed without the page: there is the "
                               "API alone. --web-root names its folder.\n",
                   "\n", field::TrustText(*site_), "\n",
                   field::CommandText(*site_, *devices, CommandLine()), "\nThe jobs are kept in ",
                   data_, ". Ctrl-C ends; what was sent is kept.\n\n", pairing));
  return absl::OkStatus();
}

void FieldServing::Look(Server& server) {
  const absl::StatusOr<field::FieldSite::News> news = site_->Look(absl::Now());
  const std::string error = news.ok() ? "" : std::string(news.status().message());
  if (!error.empty() && error != told_error_) {
    std::fprintf(stderr, "vantaged: the certificate is not renewed: %s\n", error.c_str());
  }
  told_error_ = error;
  if (!news.ok()) return;
  if (news->certificate) server.RefreshTlsFiles();
  if (news->addresses) Say("\n" + field::AddressText(*site_, CommandLine()));
}

absl::Status FieldServing::Explain(const absl::Status& status) const {
  if (absl::StrContains(status.message(), site_->socket())) {
    return absl::Status(status.code(), absl::StrCat(status.message(),
                                                    "; the data in another folder (--data) would "
                                                    "have their socket there"));
  }
  if (!absl::StrContains(status.message(), site_->page_listen())) return status;
  std::string addresses;
  for (const field::InterfaceAddress& one : field::ReachableAddresses(field::SystemAddresses())) {
    absl::StrAppend(&addresses, addresses.empty() ? "" : ", ", one.address);
  }
  return absl::Status(status.code(),
                      absl::StrCat(status.message(), "; --port serves at another port",
                                   addresses.empty() ? "" : ", --address at one of ", addresses));
}

absl::StatusOr<std::unique_ptr<field::LogFile>> FieldLog(const std::string& data) {
  const std::string folder = field::FieldFolderOf(data);
  if (absl::Status made = store::MakeFolder(folder); !made.ok()) return made;
  if (isatty(STDERR_FILENO) == 0) return nullptr;
  return field::LogFile::Open(folder + "/log");
}

}  // namespace vantage::server

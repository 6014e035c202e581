// The server program: reads its configuration, serves until SIGTERM or SIGINT, drains, exits 0.
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include <CLI/CLI.hpp>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "core/confinement/reader.h"
#include "core/sensor/confined_scan_file.h"
#include "core/site_prior/confined_prior.h"
#include "server/auth/callers.h"
#include "server/main/environment.h"
#include "server/main/field_command.h"
#include "server/main/grpc_log.h"
#include "server/main/healthcheck.h"
#include "server/main/server.h"
#include "server/store/backup.h"
#include "server/store/disk_store.h"
#include "server/store/memory_store.h"
#include "server/store/salvage.h"
#include "server/telemetry/log.h"
#include "server/telemetry/log_writer.h"

namespace vantage::server {
namespace {

constexpr int kExitUsage = 2;
constexpr int kExitUnhealthy = 1;
constexpr int kExitFailed = 1;
// A shutdown takes that much longer than --drain-seconds at most.
constexpr std::chrono::milliseconds kBeyondDrain(1500);
// A network that a laptop joined is served within this time.
constexpr timespec kLookEvery = {5, 0};

// The folder in which services keep their state: systemd's, or that of desktops. Empty: none is
// known.
std::string DefaultDataFolder() {
  const std::string given = Variable("STATE_DIRECTORY");
  if (!given.empty()) return given.substr(0, given.find(':'));
  const std::string state = Variable("XDG_STATE_HOME");
  if (!state.empty()) return state + "/vantage";
  const std::string home = Variable("HOME");
  return home.empty() ? "" : home + "/.local/state/vantage";
}

// Where a package or a checkout has the page, by the place of this program: below the prefix that
// it is installed in, or beside the folder that it was built in. Empty: in neither.
std::string DefaultPageFolder() {
  std::error_code error;
  const std::filesystem::path here =
      std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  for (const std::filesystem::path& folder : {here / "../share/vantage/web", here / "../../web"}) {
    if (std::filesystem::exists(folder / "index.html", error)) {
      return folder.lexically_normal().string();
    }
  }
  return "";
}

// The memory of the machine, or of the container where that is less, bytes; 0: not known.
int64_t AvailableMemory() {
  const int64_t machine = static_cast<int64_t>(sysconf(_SC_PHYS_PAGES)) * sysconf(_SC_PAGESIZE);
  int64_t container = 0;
  for (const char* limit :
       {"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"}) {
    std::ifstream file(limit);
    if (int64_t bytes = 0; file >> bytes && bytes > 0) container = bytes;
  }
  return container > 0 ? std::min(container, machine) : std::max<int64_t>(0, machine);
}

struct Program {
  ServerOptions server;
  std::string port_file;
  std::string http_port_file;
  std::string web_port_file;
  std::string healthcheck;
  telemetry::LogLevel log_level = telemetry::LogLevel::kInfo;
  std::string data = DefaultDataFolder();
  bool in_memory = false;
  std::string backup_folder;
  const CLI::App* backup = nullptr;
  const CLI::App* restore = nullptr;
  const CLI::App* verify = nullptr;
  const CLI::App* salvage = nullptr;
  std::string salvaged_session;  // its id
  bool remove_salvaged = false;
  const CLI::App* token = nullptr;
  auth::Caller caller;  // that the token is for
  std::string caller_roles;
  int token_days = 365;
  FieldCommand field;
  size_t store_mib = 4096;
  size_t scan_mib = 512;
  size_t file_mib = 4096;
  int drain_seconds = 20;
  int keep_sessions_days = 0;
  int keep_withdrawn_days = 0;
  int backups_keep_days = 0;
  int quota_mib = 0;
  int memory_mib = 0;
  int evict_minutes = 30;
};

void Declare(CLI::App& app, Program& program) {
  app.set_config("--config", "", "read options from a TOML file; flags override it");
  app.set_version_flag("--version", "vantaged " VANTAGE_VERSION);
  app.add_option("--listen", program.server.listen,
                 "address and port, or unix:PATH, a socket for the server's user and group; port 0 "
                 "takes a free one. May be given several times")
      ->allow_extra_args(false)
      ->capture_default_str();
  app.add_option("--http", program.server.http_listen,
                 "address and port of metrics (/metrics), health (/healthz, /readyz) and a status "
                 "page (/); none: nowhere");
  app.add_flag("--http-allow-remote", program.server.http_allow_remote,
               "serve them to other machines too, to whoever asks; they name no session, tenant or "
               "caller");
  app.add_option("--http-port-file", program.http_port_file, "write the port of HTTP here");
  app.add_option("--web", program.server.web_listen,
                 "address and port, or unix:PATH, of the page for tablets, and of the API for "
                 "browsers (Connect protocol on HTTP/1.1); none: nowhere. Whoever calls there is "
                 "asked for the same as over gRPC");
  app.add_option("--web-root", program.server.web_root,
                 "folder of the page; by default what was installed, or built, with this program");
  app.add_option("--web-allow-origin", program.server.web_allowed_origins,
                 "origin whose pages may call, too ('https://crew.example'), or by whose name this "
                 "server is asked for where callers are not told apart; may be given several times")
      ->allow_extra_args(false);
  app.add_option("--web-port-file", program.web_port_file, "write the port of the web here");
  app.add_option("--port-file", program.port_file,
                 "write the port here once serving: that of the first address that has one");
  app.add_option("--threads", program.server.threads, "threads that compute; 0: one per core")
      ->check(CLI::Range(0, 256))
      ->capture_default_str();
  app.add_option("--request-threads", program.server.request_threads, "threads that answer")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  app.add_option("--max-sessions", program.server.limits.sessions, "sessions at most")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_option("--max-scan-mib", program.scan_mib, "encoded scan at most, MiB")
      ->check(CLI::Range(1, 65536))
      ->capture_default_str();
  app.add_option(
         "--max-file-mib", program.file_mib,
         "file that the server reads itself at most, MiB; while it is read, the disk has it "
         "twice")
      ->check(CLI::Range(1, 1 << 20))
      ->capture_default_str();
  app.add_option("--file-seconds", program.server.limits.file_seconds,
                 "seconds of a processor that reading a file may take; 0: 60, and two for each MB")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  CLI::Option* data = app.add_option("--data", program.data,
                                     "folder of sessions and scans; one server at a time uses it")
                          ->capture_default_str();
  app.add_flag("--in-memory", program.in_memory,
               "keep everything in memory: nothing survives the end of the server")
      ->excludes(data);
  app.add_option("--store-mib", program.store_mib,
                 "with --in-memory: memory for scans and logs at most, MiB")
      ->check(CLI::Range(1, 1 << 20))
      ->capture_default_str();
  app.add_option("--keep-sessions-days", program.keep_sessions_days,
                 "delete sessions that had no event for so many days while a server ran; 0: never")
      ->check(CLI::Range(0, 36500))
      ->capture_default_str();
  app.add_option("--keep-withdrawn-days", program.keep_withdrawn_days,
                 "erase the data of scans so many days after they were withdrawn, while a server "
                 "ran; 0: never")
      ->check(CLI::Range(0, 36500))
      ->capture_default_str();
  app.add_option("--backups-keep-days", program.backups_keep_days,
                 "how long you keep backups: whoever deletes a session is told when the last one "
                 "that holds it is gone; 0: not known, nothing is said")
      ->check(CLI::Range(0, 36500))
      ->capture_default_str();
  app.add_option("--quota-mib", program.quota_mib,
                 "what the sessions of one tenant may keep, MiB; 0: as much as there is room for")
      ->check(CLI::Range(0, 1 << 30))
      ->capture_default_str();
  app.add_option("--memory-mib", program.memory_mib,
                 "for models and plans, MiB; 0: 70 % of what this machine or its container has")
      ->check(CLI::Range(0, 1 << 24))
      ->capture_default_str();
  app.add_option("--evict-minutes", program.evict_minutes,
                 "models that nobody used for so long leave memory, and come back when they are "
                 "needed; 0: never")
      ->check(CLI::Range(0, 1 << 20))
      ->capture_default_str();
  app.add_option("--tries", program.server.limits.tries,
                 "work (a scan's merge, the loading of a model) that brought the server to its end "
                 "so often is set aside; 0: it is tried for ever")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  app.add_option("--drain-seconds", program.drain_seconds,
                 "how long a shutdown waits for plans and merges; it takes 2 s longer at most")
      ->check(CLI::Range(0, 3600))
      ->capture_default_str();
  const std::map<std::string, telemetry::LogLevel> levels = {
      {"debug", telemetry::LogLevel::kDebug},
      {"info", telemetry::LogLevel::kInfo},
      {"warning", telemetry::LogLevel::kWarning},
      {"error", telemetry::LogLevel::kError},
      {"off", telemetry::LogLevel::kOff}};
  app.add_option("--log-level", program.log_level, "debug, info, warning, error or off")
      ->transform(CLI::CheckedTransformer(levels, CLI::ignore_case));
  app.add_option("--healthcheck", program.healthcheck,
                 "don't serve: ask the server at this address whether it serves; "
                 "'http://HOST:PORT' asks its HTTP listener, which needs no credentials")
      ->configurable(false);
}

// Whose signed tokens name callers.
void DeclareJwts(CLI::App& app, auth::JwtOptions& jwt) {
  app.add_option("--jwt-keys", jwt.keys_file,
                 "file of an identity provider's public keys, a JSON Web Key Set: callers may show "
                 "its JWTs. Read again when it changes, and on SIGHUP");
  app.add_option("--jwt-issuer", jwt.issuer, "with --jwt-keys: what a JWT's claim 'iss' must be");
  app.add_option("--jwt-audience", jwt.audience,
                 "with --jwt-keys: what must be in a JWT's claim 'aud', this server's name at the "
                 "identity provider");
  app.add_option("--jwt-tenant-claim", jwt.tenant_claim, "claim that names the caller's tenant")
      ->capture_default_str();
  app.add_option("--jwt-roles-claim", jwt.roles_claim,
                 "claim that names the caller's roles (read, submit, plan, administer): an array, "
                 "or a string with spaces between, as 'scope' is")
      ->capture_default_str();
  app.add_option("--jwt-role-prefix", jwt.role_prefix,
                 "roles in that claim begin with this ('vantage:' for vantage:read); others don't "
                 "count");
}

// Who may reach the server.
void DeclareAccess(CLI::App& app, auth::AccessOptions& access) {
  app.add_flag(
      "--allow-insecure-remote", access.allow_insecure_remote,
      "serve other machines even where that is not encrypted or callers don't have to show "
      "who they are; anyone who reaches the port can read and delete every session");
  app.add_option("--tls-cert", access.tls_cert,
                 "PEM file of this server's certificate, with what leads to its root; read again "
                 "when it changes");
  app.add_option("--tls-key", access.tls_key, "PEM file of its key");
  app.add_option("--tls-client-ca", access.tls_client_ca,
                 "PEM file of what signs the certificates that clients must have");
  app.add_flag("--tls-optional-client-certificates", access.tls_optional_client_certificates,
               "let clients without a certificate show a token instead");
  app.add_option("--callers", access.callers_file,
                 "file of callers, one a line: NAME TENANT ROLES CREDENTIAL [EXPIRES]; "
                 "'vantaged token' makes lines. Read again when it changes, and on SIGHUP");
  DeclareJwts(app, access.jwt);
  const auto metadata_key = [](const std::string& key) {
    const bool plain =
        key.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-_.") == std::string::npos;
    return plain ? "" : "must be of lower-case letters, digits, '-', '_' and '.'";
  };
  app.add_option("--tenant-metadata", access.tenant_metadata,
                 "metadata key by which the proxy in front, which authenticates the callers, names "
                 "their tenant. With --callers it is heeded from callers of tenant '*' only")
      ->check(metadata_key);
  app.add_option("--certificate-metadata", access.certificate_metadata,
                 "metadata key in which the proxy in front passes on the certificate that a client "
                 "showed and it verified: DER in base64. Heeded in calls by unix:PATH only; needs "
                 "--callers")
      ->check(metadata_key);
  app.add_option("--address-metadata", access.address_metadata,
                 "metadata key in which it passes on the client's address, likewise")
      ->check(metadata_key);
  app.add_option("--calls-per-second", access.calls_per_second,
                 "calls of one caller, in the long run; 0: as many as come")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  app.add_option("--calls-at-once", access.calls_at_once, "calls of one caller after a rest")
      ->check(CLI::Range(1.0, 1e6))
      ->capture_default_str();
}

// Makes a token for a new line of the callers file.
void DeclareToken(CLI::App& app, Program& program) {
  CLI::App* token = app.add_subcommand(
      "token", "make a bearer token; prints it, and the line for the callers file");
  token->add_option("name", program.caller.name, "who gets it")->required();
  token
      ->add_option("tenant", program.caller.tenant,
                   "whose sessions it opens and sees; '-': those opened when callers were not "
                   "told apart; '*': a proxy's, which names the tenant of each call")
      ->required();
  token->add_option("roles", program.caller_roles, "of read,submit,plan,administer")->required();
  token->add_option("--days", program.token_days, "how long it is good for")
      ->check(CLI::Range(1, 3650))
      ->capture_default_str();
  program.token = token;
}

int MakeTokenLine(const Program& program) {
  const auth::NewToken made = auth::MakeToken();
  const absl::Time expires = absl::Now() + absl::Hours(24) * program.token_days;
  const std::string line = absl::StrCat(
      program.caller.name, " ", program.caller.tenant, " ", program.caller_roles, " ",
      made.credential, " ", absl::FormatTime("%Y-%m-%dT%H:%M:%SZ", expires, absl::UTCTimeZone()));
  const absl::Status valid = auth::CallerList::Parse(line).status();
  if (!valid.ok()) {
    std::fprintf(stderr, "vantaged: %s\n", std::string(valid.message()).c_str());
    return kExitUsage;
  }
  std::printf("%s\n%s\n", made.token.c_str(), line.c_str());
  return 0;
}

// Commands for the operator's work on the data; none but 'salvage --remove' needs the server to
// stop.
void DeclareOperations(CLI::App& app, Program& program) {
  app.require_subcommand(0, 1);
  app.fallthrough();
  CLI::App* backup = app.add_subcommand("backup",
                                        "copy the data, while a server uses them, to a "
                                        "new folder, and verify the copy");
  backup->add_option("folder", program.backup_folder, "new or empty folder")->required();
  CLI::App* restore =
      app.add_subcommand("restore", "copy a sound backup to --data, which must be new or empty");
  restore->add_option("folder", program.backup_folder, "the backup")->required();
  program.backup = backup;
  program.restore = restore;
  program.verify = app.add_subcommand(
      "verify", "read all data, in use or not, and say what is damaged or missing");
  CLI::App* salvage = app.add_subcommand(
      "salvage",
      "copy what can be read of one session, damaged or not, to a new folder: its log "
      "as text, its scans, its uploads under way");
  salvage->add_option("session", program.salvaged_session, "its id")->required();
  salvage->add_option("folder", program.backup_folder, "new or empty folder")->required();
  salvage->add_flag("--remove", program.remove_salvaged,
                    "then take the session out of the data, so that its id is free; no server may "
                    "be using them");
  program.salvage = salvage;
}

int Salvage(const Program& program) {
  const absl::StatusOr<store::Salvaged> salvaged =
      store::SalvageSession(program.data, program.salvaged_session, program.backup_folder);
  if (!salvaged.ok()) {
    std::fprintf(stderr, "vantaged: %s\n", std::string(salvaged.status().message()).c_str());
    return kExitFailed;
  }
  std::printf("%s: %lld log entries, %lld scans, %lld uploads under way\n",
              program.backup_folder.c_str(), static_cast<long long>(salvaged->entries),
              static_cast<long long>(salvaged->scans), static_cast<long long>(salvaged->uploads));
  for (const std::string& fault : salvaged->faults) {
    std::fprintf(stderr, "vantaged: not salvaged: %s\n", fault.c_str());
  }
  if (!program.remove_salvaged) return 0;
  const absl::Status removed = store::RemoveSession(program.data, program.salvaged_session);
  if (!removed.ok()) {
    std::fprintf(stderr, "vantaged: not removed: %s\n", std::string(removed.message()).c_str());
    return kExitFailed;
  }
  std::printf("removed from %s\n", program.data.c_str());
  return 0;
}

int Operate(const Program& program) {
  const absl::StatusOr<store::StoreReport> report =
      *program.backup    ? store::BackUpStore(program.data, program.backup_folder)
      : *program.restore ? store::RestoreStore(program.backup_folder, program.data)
                         : store::VerifyStore(program.data);
  if (!report.ok()) {
    std::fprintf(stderr, "vantaged: %s\n", std::string(report.status().message()).c_str());
    return kExitFailed;
  }
  const std::string& shown = *program.backup ? program.backup_folder : program.data;
  std::printf("%s: %lld sessions, %lld log entries, %lld blobs (%.1f MB), %lld uploads under way\n",
              shown.c_str(), static_cast<long long>(report->sessions),
              static_cast<long long>(report->entries), static_cast<long long>(report->blobs),
              static_cast<double>(report->blob_bytes) / 1e6,
              static_cast<long long>(report->uploads));
  for (const std::string& fault : report->faults) {
    std::fprintf(stderr, "vantaged: %s\n", fault.c_str());
  }
  if (!report->faults.empty()) return kExitFailed;
  std::printf("%s\n", *program.verify ? "sound" : "done, and sound");
  return 0;
}

// The file is complete or absent whenever it is read.
bool WritePortFile(const std::string& path, int port) {
  const std::string temporary = path + ".new";
  {
    std::ofstream file(temporary);
    file << port << "\n";
    if (!file.good()) return false;
  }
  return std::rename(temporary.c_str(), path.c_str()) == 0;
}

absl::StatusOr<std::unique_ptr<store::Store>> OpenStore(const Program& program) {
  if (program.in_memory) return std::make_unique<store::MemoryStore>(program.store_mib << 20);
  if (program.data.empty()) {
    return absl::InvalidArgumentError("name a folder to keep sessions in: --data, or --in-memory");
  }
  absl::StatusOr<std::unique_ptr<store::DiskStore>> store = store::DiskStore::Open(program.data);
  if (!store.ok()) {
    return absl::Status(
        store.status().code(),
        absl::StrCat(store.status().message(), " (--data ", program.data,
                     program.field.given() ? "; another folder would do. A server that runs there "
                                             "takes up devices by 'vantaged field pair NAME')"
                                           : "; another folder, or --in-memory, would do)"));
  }
  return *std::move(store);
}

bool WritePortFiles(const Program& program, const Server& server) {
  for (const auto& [path, port] : {std::pair(&program.http_port_file, server.http_port()),
                                   std::pair(&program.web_port_file, server.web_port()),
                                   std::pair(&program.port_file, server.port())}) {
    if (path->empty() || WritePortFile(*path, port)) continue;
    std::fprintf(stderr, "vantaged: cannot write %s\n", path->c_str());
    return false;
  }
  return true;
}

int Failed(const absl::Status& status) {
  std::fprintf(stderr, "vantaged: %s\n", std::string(status.message()).c_str());
  return absl::IsInvalidArgument(status) ? kExitUsage : kExitFailed;
}

// Returns when the server is to end; until then does what signals ask for. A site's network and log
// are looked at every few seconds; a terminal that is closed ends its server.
void AwaitEnd(const sigset_t& signals, Server& server, FieldServing* field, field::LogFile* log) {
  const bool ends_with_terminal = field != nullptr && isatty(STDOUT_FILENO) != 0;
  while (true) {
    const int received = field == nullptr ? sigwaitinfo(&signals, nullptr)
                                          : sigtimedwait(&signals, nullptr, &kLookEvery);
    if (received == SIGHUP && !ends_with_terminal) {
      server.RefreshCallers();
      server.RefreshJwtKeys();
      server.RefreshTlsFiles();
    } else if (received > 0) {
      return;
    }
    if (field != nullptr) field->Look(server);
    if (log != nullptr) log->TurnOver().IgnoreError();
  }
}

int Serve(Program& program, const sigset_t& signals) {
  std::unique_ptr<field::LogFile> log_file;
  if (program.field.given()) {
    absl::StatusOr<std::unique_ptr<field::LogFile>> opened = FieldLog(program.data);
    if (!opened.ok()) {
      return Failed(absl::UnavailableError(absl::StrCat(
          opened.status().message(), " (--data ", program.data, "; another folder would do)")));
    }
    log_file = *std::move(opened);
  }
  telemetry::LogWriter writer(log_file == nullptr ? STDERR_FILENO : log_file->descriptor());
  telemetry::Log log(program.log_level, writer);
  const GrpcLog grpc_log(log);
  absl::StatusOr<std::unique_ptr<store::Store>> store = OpenStore(program);
  if (!store.ok()) {
    std::fprintf(stderr, "vantaged: %s\n", std::string(store.status().message()).c_str());
    return kExitFailed;
  }
  std::unique_ptr<FieldServing> field;
  if (program.field.given()) {
    absl::StatusOr<std::unique_ptr<FieldServing>> opened =
        FieldServing::Open(program.field, program.data, program.server);
    if (!opened.ok()) return Failed(opened.status());
    field = *std::move(opened);
  }
  absl::StatusOr<std::unique_ptr<Server>> server = Server::Start(program.server, **store, log);
  if (!server.ok()) {
    return Failed(field == nullptr ? server.status() : field->Explain(server.status()));
  }
  for (const std::string& address : (*server)->addresses()) {
    if (field != nullptr && address == field->socket()) continue;
    std::printf("vantaged %s listening on %s\n", VANTAGE_VERSION, address.c_str());
  }
  std::fflush(stdout);
  if (field != nullptr) {
    if (absl::Status begun = field->Begin(**server); !begun.ok()) return Failed(begun);
  }
  if (!WritePortFiles(program, **server)) return kExitFailed;
  AwaitEnd(signals, **server, field.get(), log_file.get());
  // Whatever is still under way by then is in the log, and goes on after the next start.
  std::thread([at = std::chrono::steady_clock::now() + program.server.drain_patience +
                    kBeyondDrain] {
    std::this_thread::sleep_until(at);
    std::_Exit(0);
  }).detach();
  (*server)->Drain();
  return 0;
}

// Where the data of 'vantaged field' are: as given there or before, or where a crew's are. It
// prints commands for other terminals, which may be in other folders.
std::string FieldData(const CLI::App& app, const Program& program) {
  std::string data = program.field.data;
  if (data.empty()) {
    data = app.get_option("--data")->count() > 0 ? program.data : DefaultFieldData();
  }
  std::error_code error;
  const std::filesystem::path absolute = std::filesystem::absolute(data, error);
  // Without a slash at its end, whether it was given with one or not.
  return data.empty() || error ? data : (absolute / "").lexically_normal().parent_path().string();
}

int Main(int argc, char** argv) {
  Program program;
  CLI::App app("Vantage: plans where a scanner should stand next. Serves gRPC.", "vantaged");
  Declare(app, program);
  DeclareAccess(app, program.server.access);
  DeclareOperations(app, program);
  DeclareToken(app, program);
  DeclareField(app, program.field);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kExitUsage;
  }
  if (*program.backup || *program.restore || *program.verify) return Operate(program);
  if (*program.salvage) return Salvage(program);
  if (*program.token) return MakeTokenLine(program);
  if (program.field.given()) {
    if (absl::Status fits = CheckFieldOptions(app); !fits.ok()) return Failed(fits);
    program.data = FieldData(app, program);
    if (program.data.empty()) {
      return Failed(absl::InvalidArgumentError("name a folder to keep jobs in: --data"));
    }
    if (program.field.only_devices()) {
      const absl::Status done = RunOnDevices(program.field, program.data);
      return done.ok() ? 0 : Failed(done);
    }
    // Its own command line comes by a socket; what else is to be served has to be said.
    if (app.get_option("--listen")->count() == 0) program.server.listen.clear();
  }
  if (!program.healthcheck.empty()) {
    const absl::Status healthy = CheckHealth(program.healthcheck);
    if (healthy.ok()) return 0;
    std::fprintf(stderr, "vantaged: %s\n", std::string(healthy.message()).c_str());
    return kExitUnhealthy;
  }
  if (program.server.web_root.empty()) program.server.web_root = DefaultPageFolder();
  if (program.in_memory) {
    program.server.limits.snapshots_per_session = 0;
  } else {
    program.server.data_folder = program.data;
  }
  program.server.limits.encoded_scan_bytes = static_cast<int64_t>(program.scan_mib) << 20;
  program.server.limits.file_bytes = static_cast<int64_t>(program.file_mib) << 20;
  program.server.limits.file_bytes_per_session =
      std::max(program.server.limits.file_bytes_per_session, program.server.limits.file_bytes);
  program.server.limits.tenant_bytes = static_cast<int64_t>(program.quota_mib) << 20;
  program.server.memory_bytes = program.memory_mib > 0
                                    ? static_cast<int64_t>(program.memory_mib) << 20
                                    : AvailableMemory() / 10 * 7;
  if (program.evict_minutes > 0) {
    program.server.limits.evict_after = absl::Minutes(program.evict_minutes);
  }
  if (program.keep_sessions_days > 0) {
    program.server.limits.keep_sessions = absl::Hours(24) * program.keep_sessions_days;
  }
  if (program.keep_withdrawn_days > 0) {
    program.server.limits.keep_withdrawn_scans = absl::Hours(24) * program.keep_withdrawn_days;
  }
  program.server.limits.keep_backups = absl::Hours(24) * program.backups_keep_days;
  program.server.drain_patience = std::chrono::seconds(program.drain_seconds);

  // A reader of our output that goes away ends no work.
  std::signal(SIGPIPE, SIG_IGN);
  // Every thread inherits the mask, so only sigwait sees these.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return Serve(program, signals);
}

}  // namespace
}  // namespace vantage::server

int main(int argc, char** argv) {
  vantage::confinement::RunIfReader(
      argc, argv, {vantage::sensor::ScanFileReader(), vantage::site_prior::SitePriorReader()});
  const int code = vantage::server::Main(argc, argv);
#ifndef VANTAGE_SANITIZED
  // Without static destructors, which threads of gRPC 1.51 may still meet: they go on after the
  // last call. Sanitizers look for leaks at an orderly end.
  std::fflush(nullptr);
  std::_Exit(code);
#endif
  return code;
}

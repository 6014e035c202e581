#include "server/field/devices.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "server/auth/callers.h"
#include "server/auth/guarded_file.h"
#include "server/auth/plain_name.h"
#include "server/store/durable_file.h"

namespace vantage::field {
namespace {

// That of sessions which were opened while callers were not told apart: the same data serve with
// and without devices, and all of a crew see the same jobs.
constexpr char kTenant[] = "-";
constexpr char kHeading[] =
    "# Devices of 'vantaged field': NAME TENANT ROLES CREDENTIAL [EXPIRES]. 'vantaged field pair' "
    "and 'revoke' change it.";

std::vector<absl::string_view> WordsOf(absl::string_view line) {
  return absl::StrSplit(line.substr(0, line.find('#')), absl::ByAnyChar(" \t\r"),
                        absl::SkipEmpty());
}

bool IsOf(absl::string_view line, absl::string_view name) {
  const std::vector<absl::string_view> words = WordsOf(line);
  return !words.empty() && words[0] == name;
}

bool Remove(std::vector<std::string>& lines, absl::string_view name) {
  const auto gone = std::remove_if(lines.begin(), lines.end(),
                                   [name](const std::string& line) { return IsOf(line, name); });
  const bool any = gone != lines.end();
  lines.erase(gone, lines.end());
  return any;
}

// While it is held, no other process changes the file.
absl::StatusOr<store::FileDescriptor> Lock(const std::string& folder) {
  const std::string path = folder + "/devices.lock";
  store::FileDescriptor lock(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));
  if (!lock.ok()) return store::FileError("cannot open", path);
  while (::flock(lock.get(), LOCK_EX) != 0) {
    if (errno != EINTR) return store::FileError("cannot lock", path);
  }
  return lock;
}

}  // namespace

absl::StatusOr<std::vector<std::string>> Devices::Lines() const {
  struct stat there {};
  if (stat(file().c_str(), &there) != 0 && errno == ENOENT) return std::vector<std::string>();
  const absl::StatusOr<std::string> text = auth::ReadGuardedFile(file(), "list of devices");
  if (!text.ok()) return text.status();
  if (const auto list = auth::CallerList::Parse(*text); !list.ok()) {
    return absl::Status(list.status().code(), absl::StrCat(file(), ", ", list.status().message()));
  }
  return std::vector<std::string>(absl::StrSplit(*text, '\n', absl::SkipEmpty()));
}

absl::Status Devices::Write(const std::vector<std::string>& lines) const {
  std::vector<std::string> all = lines;
  if (all.empty() || !absl::StartsWith(all.front(), "#")) all.insert(all.begin(), kHeading);
  return store::ReplaceFile(file(), file() + ".new", absl::StrCat(absl::StrJoin(all, "\n"), "\n"));
}

absl::StatusOr<std::vector<Device>> Devices::List() const {
  const absl::StatusOr<std::vector<std::string>> lines = Lines();
  if (!lines.ok()) return lines.status();
  std::vector<Device> devices;
  for (const std::string& line : *lines) {
    const std::vector<absl::string_view> words = WordsOf(line);
    if (words.size() < 4 || words[0] == kLaptop) continue;
    Device device{std::string(words[0]), std::string(words[2])};
    if (words.size() > 4) {
      absl::ParseTime(absl::RFC3339_full, words[4], &device.expires, nullptr);
    }
    devices.push_back(std::move(device));
  }
  return devices;
}

absl::StatusOr<std::string> Devices::Pair(const Pairing& pairing, absl::Time now) {
  if (pairing.name == kLaptop) {
    return absl::InvalidArgumentError(
        absl::StrCat("'", kLaptop, "' is this computer's own command line: take another name"));
  }
  const auth::NewToken made = auth::MakeToken();
  const std::string line = absl::StrCat(
      pairing.name, " ", kTenant, " ", pairing.roles, " ", made.credential, " ",
      absl::FormatTime("%Y-%m-%dT%H:%M:%SZ", now + pairing.good_for, absl::UTCTimeZone()));
  if (!auth::IsPlainName(pairing.name) || !auth::CallerList::Parse(line).ok()) {
    return absl::InvalidArgumentError(absl::StrCat(
        "'", pairing.name, "' with the roles '", pairing.roles,
        "' cannot be paired: a name has 1 to 63 of letters, digits and -_.@, roles are of "
        "read,submit,plan,administer"));
  }
  const absl::StatusOr<store::FileDescriptor> lock = Lock(folder_);
  if (!lock.ok()) return lock.status();
  absl::StatusOr<std::vector<std::string>> lines = Lines();
  if (!lines.ok()) return lines.status();
  if (Remove(*lines, pairing.name) && !pairing.replace) {
    return absl::AlreadyExistsError(absl::StrCat(
        "a device is called '", pairing.name,
        "' already: take another name, or say --replace, and whoever has it has it no more"));
  }
  lines->push_back(line);
  if (absl::Status written = Write(*lines); !written.ok()) return written;
  return made.token;
}

absl::Status Devices::Revoke(const std::string& name) {
  if (name == kLaptop) {
    return absl::InvalidArgumentError(
        absl::StrCat("'", kLaptop,
                     "' is this computer's own command line; it gets a new token "
                     "whenever the server starts"));
  }
  const absl::StatusOr<store::FileDescriptor> lock = Lock(folder_);
  if (!lock.ok()) return lock.status();
  absl::StatusOr<std::vector<std::string>> lines = Lines();
  if (!lines.ok()) return lines.status();
  if (!Remove(*lines, name)) {
    return absl::NotFoundError(absl::StrCat("no device is called '", name, "'"));
  }
  return Write(*lines);
}

absl::StatusOr<std::string> Devices::RenewLaptop() {
  const auth::NewToken made = auth::MakeToken();
  const absl::StatusOr<store::FileDescriptor> lock = Lock(folder_);
  if (!lock.ok()) return lock.status();
  absl::StatusOr<std::vector<std::string>> lines = Lines();
  if (!lines.ok()) return lines.status();
  Remove(*lines, kLaptop);
  lines->push_back(absl::StrCat(kLaptop, " ", kTenant, " administer ", made.credential));
  if (absl::Status written = Write(*lines); !written.ok()) return written;
  const std::string path = folder_ + "/laptop.token";
  if (absl::Status kept = store::ReplaceFile(path, path + ".new", made.token + "\n"); !kept.ok()) {
    return kept;
  }
  return path;
}

}  // namespace vantage::field

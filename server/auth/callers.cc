#include "server/auth/callers.h"

#include <openssl/rand.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "core/bytes/checksum.h"
#include "server/auth/guarded_file.h"
#include "server/auth/plain_name.h"

namespace vantage::auth {
namespace {

constexpr size_t kHashDigits = 64;
constexpr char kTokenPrefix[] = "vantage_";

absl::StatusOr<Roles> ParseRoles(absl::string_view text) {
  Roles roles;
  for (const absl::string_view name : absl::StrSplit(text, ',')) {
    bool known = false;
    for (const Role role : {Role::kRead, Role::kSubmit, Role::kPlan, Role::kAdminister}) {
      if (name != RoleName(role)) continue;
      roles = roles.With(role);
      known = true;
    }
    if (!known) {
      return absl::InvalidArgumentError("the roles must be of read, submit, plan and administer");
    }
  }
  return roles;
}

absl::StatusOr<Caller> ParseCaller(const std::vector<absl::string_view>& words) {
  if (words.size() != 4 && words.size() != 5) {
    return absl::InvalidArgumentError("must be NAME TENANT ROLES CREDENTIAL [EXPIRES]");
  }
  Caller caller;
  caller.name = std::string(words[0]);
  if (!IsPlainName(words[0])) {
    return absl::InvalidArgumentError("the name must be 1 to 63 of letters, digits and -_.@");
  }
  caller.names_tenant = words[1] == "*";
  if (!caller.names_tenant && words[1] != "-") {
    caller.tenant = std::string(words[1]);
    if (!IsPlainName(words[1])) {
      return absl::InvalidArgumentError(
          "the tenant must be '*', '-', or 1 to 63 of letters, digits and -_.@");
    }
  }
  absl::StatusOr<Roles> roles = ParseRoles(words[2]);
  if (!roles.ok()) return roles.status();
  caller.roles = *roles;
  if (words.size() == 5 &&
      !absl::ParseTime(absl::RFC3339_full, words[4], &caller.expires, nullptr)) {
    return absl::InvalidArgumentError("the expiry must be as in 2027-01-31T00:00:00Z");
  }
  return caller;
}

}  // namespace

absl::StatusOr<CallerList> CallerList::Parse(absl::string_view text) {
  CallerList list;
  int number = 0;
  for (absl::string_view line : absl::StrSplit(text, '\n')) {
    ++number;
    line = line.substr(0, line.find('#'));
    const std::vector<absl::string_view> words =
        absl::StrSplit(line, absl::ByAnyChar(" \t\r"), absl::SkipEmpty());
    if (words.empty()) continue;
    const auto wrong = [number](absl::string_view what) {
      return absl::InvalidArgumentError(absl::StrCat("line ", number, ": ", what));
    };
    absl::StatusOr<Caller> caller = ParseCaller(words);
    if (!caller.ok()) return wrong(caller.status().message());
    absl::string_view credential = words[3];
    bool fresh = false;
    if (absl::ConsumePrefix(&credential, "certificate:")) {
      if (credential.empty()) return wrong("the certificate needs a name");
      caller->credential = std::string(credential);
      fresh = list.by_certificate_.emplace(credential, *std::move(caller)).second;
    } else if (absl::ConsumePrefix(&credential, "token:")) {
      if (credential.size() != kHashDigits ||
          !std::all_of(credential.begin(), credential.end(), absl::ascii_isxdigit)) {
        return wrong("the token must be 64 hexadecimal digits, the SHA-256 of it");
      }
      caller->credential = absl::HexStringToBytes(credential);
      fresh = list.by_token_.emplace(caller->credential, *caller).second;
    } else {
      return wrong("the credential must begin with 'token:' or 'certificate:'");
    }
    if (!fresh) return wrong("an earlier line has the same credential");
  }
  return list;
}

const Caller* CallerList::ByToken(absl::string_view token) const {
  const auto it = by_token_.find(bytes::Sha256::Of(token));
  return it == by_token_.end() ? nullptr : &it->second;
}

const Caller* CallerList::ByCertificate(const std::string& name) const {
  const auto it = by_certificate_.find(name);
  return it == by_certificate_.end() ? nullptr : &it->second;
}

const Caller* CallerList::ByCredential(const std::string& credential) const {
  const auto it = by_token_.find(credential);
  return it == by_token_.end() ? ByCertificate(credential) : &it->second;
}

bool CallerList::any_proxy() const {
  const auto is_proxy = [](const auto& entry) { return entry.second.names_tenant; };
  return std::any_of(by_token_.begin(), by_token_.end(), is_proxy) ||
         std::any_of(by_certificate_.begin(), by_certificate_.end(), is_proxy);
}

absl::StatusOr<std::unique_ptr<CallersFile>> CallersFile::Open(const std::string& path) {
  std::unique_ptr<CallersFile> file(new CallersFile(path));
  const absl::StatusOr<bool> read = file->Refresh();
  if (!read.ok()) return read.status();
  return file;
}

std::shared_ptr<const CallerList> CallersFile::list() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return list_;
}

absl::StatusOr<bool> CallersFile::Refresh() {
  std::lock_guard<std::mutex> refreshing(refresh_mutex_);
  absl::StatusOr<std::string> text = ReadGuardedFile(path_, "callers file");
  if (!text.ok()) return text.status();
  if (list() != nullptr && *text == text_) return false;
  absl::StatusOr<CallerList> parsed = CallerList::Parse(*text);
  if (!parsed.ok()) {
    return absl::Status(parsed.status().code(),
                        absl::StrCat(path_, ", ", parsed.status().message()));
  }
  text_ = *std::move(text);
  std::lock_guard<std::mutex> lock(mutex_);
  list_ = std::make_shared<const CallerList>(*std::move(parsed));
  return true;
}

NewToken MakeToken() {
  std::array<unsigned char, 32> random{};
  if (RAND_bytes(random.data(), static_cast<int>(random.size())) != 1) std::abort();
  NewToken made;
  made.token = absl::StrCat(kTokenPrefix, absl::WebSafeBase64Escape(absl::string_view(
                                              reinterpret_cast<const char*>(random.data()),
                                              random.size())));  // NOLINT: bytes
  made.credential = absl::StrCat("token:", absl::BytesToHexString(bytes::Sha256::Of(made.token)));
  return made;
}

}  // namespace vantage::auth

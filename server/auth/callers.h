// The callers that a server knows, from a file that can change while it runs.
#ifndef VANTAGE_SERVER_AUTH_CALLERS_H_
#define VANTAGE_SERVER_AUTH_CALLERS_H_

#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "server/auth/role.h"

namespace vantage::auth {

struct Caller {
  std::string name;
  std::string tenant;         // empty: the one of sessions opened while callers were not told apart
  bool names_tenant = false;  // a proxy, which names the tenant of each call itself
  Roles roles;
  absl::Time expires = absl::InfiniteFuture();
  // For CallerList::ByCredential: the token's SHA-256 or a certificate's name. Where a JWT names
  // the caller, the thumbprint of the key that vouches for it (JwtIssuer::HasKey).
  std::string credential;
  bool by_jwt = false;
};

// One caller a line, '#' begins a comment:
//
//   # name    tenant  roles             credential                  expires
//   tablet-7  museum  submit,plan,read  token:<SHA-256 as hex>      2027-01-31T00:00:00Z
//   office    museum  administer        certificate:office.example
//   proxy     *       administer        certificate:proxy.example
//
// The tenant '-' has the sessions that were opened while callers were not told apart; '*' is for
// proxies. A certificate is known by one of its subject alternative names or its common name. A
// caller may have several lines. Immutable.
class CallerList {
 public:
  // INVALID_ARGUMENT names the line, but never quotes it.
  static absl::StatusOr<CallerList> Parse(absl::string_view text);

  // Null: unknown. Does not check whether it has expired.
  const Caller* ByToken(absl::string_view token) const;
  const Caller* ByCertificate(const std::string& name) const;
  // The caller with the credential of a caller of this or of an earlier list.
  const Caller* ByCredential(const std::string& credential) const;

  size_t size() const { return by_token_.size() + by_certificate_.size(); }
  bool any_proxy() const;

 private:
  std::map<std::string, Caller> by_token_;  // by SHA-256, 32 bytes
  std::map<std::string, Caller> by_certificate_;
};

// The list in a file, as it was when the file was last readable. Thread safe.
class CallersFile {
 public:
  // NOT_FOUND, PERMISSION_DENIED (others than its owner can write it), INVALID_ARGUMENT.
  static absl::StatusOr<std::unique_ptr<CallersFile>> Open(const std::string& path);

  std::shared_ptr<const CallerList> list() const;

  // Reads the file if it changed; true when there is a new list. On an error the list stays.
  absl::StatusOr<bool> Refresh();

 private:
  explicit CallersFile(std::string path) : path_(std::move(path)) {}

  const std::string path_;
  std::mutex refresh_mutex_;
  std::string text_ ABSL_GUARDED_BY(refresh_mutex_);
  mutable std::mutex mutex_;
  std::shared_ptr<const CallerList> list_ ABSL_GUARDED_BY(mutex_);
};

// A new bearer token, 256 random bits, and its credential for the file.
struct NewToken {
  std::string token;
  std::string credential;
};
NewToken MakeToken();

}  // namespace vantage::auth

#endif  // VANTAGE_SERVER_AUTH_CALLERS_H_

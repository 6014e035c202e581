// The identity provider whose tokens a server takes, by a file of its keys that can change while
// the server runs.
#ifndef VANTAGE_SERVER_AUTH_JWT_ISSUER_H_
#define VANTAGE_SERVER_AUTH_JWT_ISSUER_H_

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "server/auth/access_options.h"
#include "server/auth/callers.h"
#include "server/auth/jwt_keys.h"
#include "server/auth/rate_limits.h"

namespace vantage::auth {

// Thread safe.
class JwtIssuer {
 public:
  // NOT_FOUND, PERMISSION_DENIED (others than its owner can write the file), INVALID_ARGUMENT: the
  // file of keys cannot be used, and why.
  static absl::StatusOr<std::unique_ptr<JwtIssuer>> Open(const JwtOptions& options);

  // The caller of a token, as CheckJwt() has it, which was checked before or is now. `address` is
  // whose it is: RESOURCE_EXHAUSTED where more forged tokens came from there than are worth the
  // time to check another one.
  absl::StatusOr<Caller> Check(absl::string_view token, const std::string& address, absl::Time now,
                               RateLimits::Time steady_now);

  // Whether the key with that thumbprint is still among the keys.
  bool HasKey(const std::string& thumbprint) const;

  // Reads the file if it changed; true when there are new keys. On an error the keys stay.
  absl::StatusOr<bool> Refresh();

 private:
  explicit JwtIssuer(JwtOptions options);
  std::shared_ptr<const JwtKeys> keys() const;

  const JwtOptions options_;
  RateLimits forgeries_;  // by address
  std::mutex refresh_mutex_;
  std::string text_ ABSL_GUARDED_BY(refresh_mutex_);
  mutable std::mutex mutex_;
  std::shared_ptr<const JwtKeys> keys_ ABSL_GUARDED_BY(mutex_);
  // What was checked by keys_, by the token's SHA-256: a caller shows the same token with every
  // call.
  std::map<std::string, Caller> checked_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage::auth

#endif  // VANTAGE_SERVER_AUTH_JWT_ISSUER_H_

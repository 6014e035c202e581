// Identifies callers and checks what they may do: the one place where every RPC is admitted or
// refused.
#ifndef VANTAGE_SERVER_RPC_CALL_AUTHORIZER_H_
#define VANTAGE_SERVER_RPC_CALL_AUTHORIZER_H_

#include <grpcpp/server_context.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "server/auth/access_options.h"
#include "server/auth/callers.h"
#include "server/auth/jwt_issuer.h"
#include "server/auth/rate_limits.h"
#include "server/rpc/call/arrival.h"
#include "server/rpc/call/rules.h"

namespace vantage::rpc {

// The authorizer's decision about a call.
struct Admission {
  absl::Status status;  // OK: let in
  // As the callers file names it, 'jwt:' and a JWT's subject, or its address; for logs and limits.
  std::string caller;
  // Where the call comes from: what gRPC or the web listener says, or the address that a proxy
  // passed on.
  std::string peer;
  // The tenant whose sessions it may see; nullopt: all, where callers are not told apart.
  std::optional<std::string> tenant;
  std::string credential;  // Caller::credential; empty where callers are not told apart
  bool by_jwt = false;     // Caller::by_jwt
  absl::Time expires = absl::InfiniteFuture();  // of the JWT
  bool administers = false;
};

// Thread safe.
class Authorizer {
 public:
  // `callers`: null where the options have no callers file; `jwts`: where they have no JWT keys;
  // `web`: the seal of this process's gateway, where there is one.
  Authorizer(auth::AccessOptions options, std::unique_ptr<auth::CallersFile> callers,
             std::unique_ptr<auth::JwtIssuer> jwts = nullptr, WebSeal web = {});

  // UNAUTHENTICATED (CREDENTIALS_MISSING, TOKEN_UNKNOWN, TOKEN_EXPIRED, TOKEN_UNFIT,
  // CERTIFICATE_UNKNOWN, CERTIFICATE_INVALID, TENANT_MISSING), RESOURCE_EXHAUSTED (RATE_LIMITED),
  // PERMISSION_DENIED
  // (ROLE_MISSING).
  Admission Admit(const RpcRule& rule, const grpc::ServerContextBase& context);

  // Checks again a call that was admitted, by what is known now. Streams ask for this, since they
  // may outlive the credential that their caller showed. UNAUTHENTICATED (CREDENTIALS_WITHDRAWN,
  // TOKEN_EXPIRED), PERMISSION_DENIED (ROLE_MISSING).
  absl::Status StillLetsIn(const RpcRule& rule, const Admission& admission) const;

  // Reads the callers file if it changed; true when it had. On an error the callers known before
  // stay.
  absl::StatusOr<bool> RefreshCallers();
  // The same of the file of JWT keys.
  absl::StatusOr<bool> RefreshJwtKeys();

 private:
  // What is known of a call before it is known who calls.
  struct Call {
    const grpc::ServerContextBase& context;
    const Arrival arrival;
  };
  struct Identity {
    std::string name;
    std::optional<std::string> tenant;
    auth::Roles roles;
    std::string credential;
    bool by_jwt = false;
    absl::Time expires = absl::InfiniteFuture();
  };
  absl::StatusOr<Identity> Identify(const Call& call) const;
  absl::StatusOr<Identity> IdentifyOpenly(const Call& call) const;
  absl::StatusOr<auth::Caller> FindCaller(const Call& call) const;
  std::optional<std::string> ForwardedAddress(const Call& call) const;
  absl::StatusOr<std::optional<std::vector<std::string>>> CertificateNamesOf(
      const Call& call) const;
  absl::StatusOr<auth::Caller> FindByToken(const auth::CallerList& list, absl::string_view token,
                                           const Call& call) const;
  absl::StatusOr<std::optional<std::string>> NamedTenant(const Call& call) const;

  const auth::AccessOptions options_;
  const std::unique_ptr<auth::CallersFile> callers_;
  const std::unique_ptr<auth::JwtIssuer> jwts_;
  const WebSeal web_;
  auth::RateLimits calls_;
  auth::RateLimits failures_;
};

}  // namespace vantage::rpc

#endif  // VANTAGE_SERVER_RPC_CALL_AUTHORIZER_H_

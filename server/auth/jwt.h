// Tokens that an identity provider signs, and whom they make of their bearer.
#ifndef VANTAGE_SERVER_AUTH_JWT_H_
#define VANTAGE_SERVER_AUTH_JWT_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "server/auth/access_options.h"
#include "server/auth/callers.h"
#include "server/auth/jwt_keys.h"

namespace vantage::auth {

// By so much the clocks of provider and server may differ where a token is not good yet. Nothing is
// added to the end of its time.
inline constexpr absl::Duration kJwtLeeway = absl::Seconds(60);

// Three parts between dots, as a signed JWT has and no token of the callers file.
bool HasFormOfJwt(absl::string_view token);

// The caller that a JWT (RFC 7519, 7515) names: 'jwt:' and its subject, its tenant and roles as
// `options` say, until it expires, which is for the caller of this to check. `credential` is the
// thumbprint of the key. Nothing in an error is from the token.
//   UNAUTHENTICATED: no key vouches for it: no JWT of 8 KiB at most, no key of that id, another
//     algorithm than the key's, critical extensions, a signature that is not the key's.
//   FAILED_PRECONDITION: it is genuine, but not for this server, not yet good or without what is
//     needed; the message names the claim.
absl::StatusOr<Caller> CheckJwt(absl::string_view token, const JwtKeys& keys,
                                const JwtOptions& options, absl::Time now);

}  // namespace vantage::auth

#endif  // VANTAGE_SERVER_AUTH_JWT_H_

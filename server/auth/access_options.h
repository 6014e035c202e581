// Who may reach the server, and how.
#ifndef VANTAGE_SERVER_AUTH_ACCESS_OPTIONS_H_
#define VANTAGE_SERVER_AUTH_ACCESS_OPTIONS_H_

#include <string>

namespace vantage::auth {

// An identity provider whose signed tokens (JWT) name callers.
struct JwtOptions {
  // File of its keys (jwt_keys.h), read again when it changes. Empty: no JWTs are taken.
  std::string keys_file;
  std::string issuer;    // what the claim 'iss' must be
  std::string audience;  // what must be in the claim 'aud': this server
  std::string tenant_claim = "tenant";
  std::string roles_claim = "roles";
  std::string role_prefix;  // roles begin with it; other values of the claim don't count
};

struct AccessOptions {
  // PEM files, read again when they change. Empty: no encryption.
  std::string tls_cert;
  std::string tls_key;
  // Certificates of clients must be signed by one of these. Empty: clients are not asked for any.
  std::string tls_client_ca;
  // Clients without a certificate pass the handshake; they then need a token.
  bool tls_optional_client_certificates = false;
  // File of the known callers (callers.h), read again when it changes. Empty, and no `jwt`: callers
  // are not told apart, except by tenant_metadata.
  std::string callers_file;
  JwtOptions jwt;
  // Metadata key in which a proxy that authenticates callers names their tenant. With a callers
  // file it counts only from callers whose tenant is '*'. Empty: it never counts.
  std::string tenant_metadata;
  // Metadata keys in which a proxy on the same machine passes on the certificate that a client
  // showed (forwarded.h) and the client's address. They count only in calls that came by a socket
  // of the file system, which only the proxy may open. Empty: they never count.
  std::string certificate_metadata;
  std::string address_metadata;
  bool allow_insecure_remote = false;  // serve other machines even without any of the above
  double calls_per_second = 500;       // of one caller; 0: no limit
  double calls_at_once = 1000;         // of one caller, after a rest

  // True when a proxy is trusted to say who its clients are.
  bool proxied() const { return !certificate_metadata.empty() || !address_metadata.empty(); }
  bool encrypted() const { return !tls_cert.empty(); }
  // True when callers have to identify themselves.
  bool identified() const { return tells_callers_apart() || !tls_client_ca.empty(); }
  // True when it is known who each of them is, and for whom.
  bool tells_callers_apart() const { return !callers_file.empty() || !jwt.keys_file.empty(); }
};

}  // namespace vantage::auth

#endif  // VANTAGE_SERVER_AUTH_ACCESS_OPTIONS_H_

// Who may reach the server, and how.
#ifndef VANTAGE_SERVER_AUTH_ACCESS_OPTIONS_H_
#define VANTAGE_SERVER_AUTH_ACCESS_OPTIONS_H_

#include <string>

namespace vantage::auth {

struct AccessOptions {
  // PEM files, read again when they change. Empty: no encryption.
  std::string tls_cert;
  std::string tls_key;
  // Certificates of clients must be signed by one of these. Empty: clients are not asked for any.
  std::string tls_client_ca;
  // Clients without a certificate get as far as the callers file.
  bool tls_optional_client_certificates = false;
  // The callers that there are, see callers.h; read again when it changes. Empty: callers are not
  // told apart, unless by tenant_metadata.
  std::string callers_file;
  // Metadata key by which what authenticates the callers names their tenant. With a callers file,
  // heeded only from callers whose tenant is '*'. Empty: never heeded.
  std::string tenant_metadata;
  bool allow_insecure_remote = false;  // serve other machines whatever the above
  double calls_per_second = 500;       // of one caller; 0: as many as come
  double calls_at_once = 1000;         // of one caller, after a rest

  bool encrypted() const { return !tls_cert.empty(); }
  // Whether callers have to show who they are.
  bool identified() const { return !callers_file.empty() || !tls_client_ca.empty(); }
};

}  // namespace vantage::auth

#endif  // VANTAGE_SERVER_AUTH_ACCESS_OPTIONS_H_

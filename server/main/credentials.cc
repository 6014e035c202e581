#include "server/main/credentials.h"

#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>

#include <algorithm>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "server/auth/tls_files.h"
#include "server/main/socket_file.h"
#include "server/rpc/call/arrival.h"

namespace vantage::server {
namespace {

// The interval at which gRPC looks at what TlsFiles has loaded, s.
constexpr unsigned kReloadSeconds = 5;

absl::Status Unprotected(const std::string& listen, absl::string_view lack) {
  return absl::InvalidArgumentError(absl::StrCat(
      "listen address '", listen, "' is not loopback, and ", lack,
      ": use 127.0.0.1:PORT, protect it with --tls-cert, --tls-key and --tls-client-ca, "
      "--callers or --jwt-keys, or say --allow-insecure-remote"));
}

// Without issuer and audience, every token that the provider ever signs for anybody's service would
// be let in.
absl::Status CheckJwtOptions(const auth::JwtOptions& jwt) {
  if (jwt.keys_file.empty() && jwt.issuer.empty() && jwt.audience.empty()) return absl::OkStatus();
  if (jwt.keys_file.empty() || jwt.issuer.empty() || jwt.audience.empty()) {
    return absl::InvalidArgumentError(
        "--jwt-keys, --jwt-issuer and --jwt-audience need one another: a JWT is taken only from "
        "whom, and for whom, it is meant");
  }
  if (jwt.tenant_claim.empty() || jwt.roles_claim.empty()) {
    return absl::InvalidArgumentError("--jwt-tenant-claim and --jwt-roles-claim must name a claim");
  }
  return absl::OkStatus();
}

absl::Status CheckProxied(const auth::AccessOptions& access,
                          const std::vector<std::string>& listen) {
  if (!access.proxied()) return absl::OkStatus();
  if (!access.tells_callers_apart()) {
    return absl::InvalidArgumentError(
        "--certificate-metadata and --address-metadata need --callers or --jwt-keys: whoever "
        "reached the proxy could do everything");
  }
  if (std::all_of(listen.begin(), listen.end(),
                  [](const std::string& address) { return SocketPath(address).empty(); })) {
    return absl::InvalidArgumentError(
        "--certificate-metadata and --address-metadata count only in calls by a socket: add "
        "--listen unix:PATH for the proxy");
  }
  return absl::OkStatus();
}

absl::Status CheckTogether(const auth::AccessOptions& access,
                           const std::vector<std::string>& listen, const std::string& web_listen) {
  if (listen.empty()) return absl::InvalidArgumentError("--listen needs an address");
  if (access.tls_cert.empty() != access.tls_key.empty()) {
    return absl::InvalidArgumentError("--tls-cert and --tls-key need one another");
  }
  if (!access.tls_client_ca.empty() && !access.encrypted()) {
    return absl::InvalidArgumentError("--tls-client-ca needs --tls-cert and --tls-key");
  }
  if (access.tls_optional_client_certificates &&
      (access.tls_client_ca.empty() || !access.tells_callers_apart())) {
    return absl::InvalidArgumentError(
        "--tls-optional-client-certificates needs --tls-client-ca, and --callers or --jwt-keys to "
        "tell the others by their tokens");
  }
  for (const std::string& key :
       {access.tenant_metadata, access.certificate_metadata, access.address_metadata}) {
    if (absl::StartsWith(key, rpc::kWebPrefix)) {
      return absl::InvalidArgumentError(
          absl::StrCat("metadata keys that begin with '", rpc::kWebPrefix, "' are the server's"));
    }
  }
  std::vector<std::string> addresses = listen;
  if (!web_listen.empty()) addresses.push_back(web_listen);
  if (absl::Status jwt = CheckJwtOptions(access.jwt); !jwt.ok()) return jwt;
  if (absl::Status fit = CheckProxied(access, addresses); !fit.ok()) return fit;
  if (access.allow_insecure_remote) return absl::OkStatus();
  for (const std::string& address : addresses) {
    if (IsLoopback(address)) continue;
    if (!access.encrypted()) return Unprotected(address, "nothing would be encrypted");
    if (!access.identified()) return Unprotected(address, "anyone could call");
  }
  return absl::OkStatus();
}

}  // namespace

bool IsLoopback(const std::string& address) {
  if (absl::StartsWith(address, "unix:")) return true;
  if (absl::StartsWith(address, "[::1]") || address == "::1") return true;
  const std::string host = address.substr(0, address.rfind(':'));
  if (host == "localhost") return true;
  const std::vector<std::string> parts = absl::StrSplit(host, '.');
  int number = 0;
  return parts.size() == 4 && parts[0] == "127" &&
         std::all_of(parts.begin(), parts.end(), [&](const std::string& part) {
           return absl::SimpleAtoi(part, &number) && number >= 0 && number <= 255;
         });
}

absl::StatusOr<Credentials> MakeCredentials(const auth::AccessOptions& access,
                                            const std::vector<std::string>& listen,
                                            const std::string& web_listen) {
  if (absl::Status fit = CheckTogether(access, listen, web_listen); !fit.ok()) return fit;
  const std::shared_ptr<grpc::ServerCredentials> plain = grpc::InsecureServerCredentials();
  if (!access.encrypted()) return Credentials{plain, plain, nullptr};
  absl::StatusOr<std::unique_ptr<auth::TlsFiles>> files = auth::TlsFiles::Open(access);
  if (!files.ok()) return files.status();
  namespace tls = grpc::experimental;
  const std::string key = (*files)->key_path();
  const std::string certificate = (*files)->certificate_path();
  auto watched =
      access.tls_client_ca.empty()
          ? std::make_shared<tls::FileWatcherCertificateProvider>(key, certificate, kReloadSeconds)
          : std::make_shared<tls::FileWatcherCertificateProvider>(
                key, certificate, (*files)->client_ca_path(), kReloadSeconds);
  tls::TlsServerCredentialsOptions options(watched);
  options.watch_identity_key_cert_pairs();
  if (!access.tls_client_ca.empty()) {
    options.watch_root_certs();
    options.set_cert_request_type(access.tls_optional_client_certificates
                                      ? GRPC_SSL_REQUEST_CLIENT_CERTIFICATE_AND_VERIFY
                                      : GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  return Credentials{tls::TlsServerCredentials(options), plain, *std::move(files)};
}

}  // namespace vantage::server

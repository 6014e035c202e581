#include "client/library/credentials.h"

#include <fstream>
#include <sstream>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/library/address.h"

namespace vantage::client {
namespace {

absl::StatusOr<std::string> ReadText(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file.good()) return absl::NotFoundError(absl::StrCat("cannot read ", path));
  return std::move(text).str();
}

}  // namespace

absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> MakeChannelCredentials(
    const ClientOptions& options) {
  if (options.tls_cert.empty() != options.tls_key.empty()) {
    return absl::InvalidArgumentError("--tls-cert and --tls-key need one another");
  }
  if (options.tls_ca.empty()) {
    if (!options.tls_cert.empty()) {
      return absl::InvalidArgumentError("--tls-cert needs --tls-ca, to know the server by");
    }
    if (!options.token_file.empty() && !StaysOnThisMachine(options.server)) {
      return absl::InvalidArgumentError(
          absl::StrCat("the token would travel to ", options.server,
                       " for everyone to read: name the server's --tls-ca"));
    }
    return grpc::InsecureChannelCredentials();
  }
  grpc::SslCredentialsOptions tls;
  for (const auto& [path, text] : {std::pair(&options.tls_ca, &tls.pem_root_certs),
                                   std::pair(&options.tls_cert, &tls.pem_cert_chain),
                                   std::pair(&options.tls_key, &tls.pem_private_key)}) {
    if (path->empty()) continue;
    absl::StatusOr<std::string> read = ReadText(*path);
    if (!read.ok()) return read.status();
    *text = *std::move(read);
  }
  return grpc::SslCredentials(tls);
}

absl::Status AddToken(const ClientOptions& options, grpc::ClientContext& context) {
  if (options.token_file.empty()) return absl::OkStatus();
  absl::StatusOr<std::string> text = ReadText(options.token_file);
  if (!text.ok()) return text.status();
  const std::string token(absl::StripAsciiWhitespace(*text));
  for (const char c : token) {
    if (!absl::ascii_isgraph(c)) {
      return absl::InvalidArgumentError(
          absl::StrCat(options.token_file, " holds more than one token"));
    }
  }
  context.AddMetadata("authorization", absl::StrCat("Bearer ", token));
  return absl::OkStatus();
}

}  // namespace vantage::client

// What the web listener shows and asks of connections that are encrypted.
#ifndef VANTAGE_SERVER_WEB_TLS_CONTEXT_H_
#define VANTAGE_SERVER_WEB_TLS_CONTEXT_H_

#include <memory>

#include <boost/asio/ssl/context.hpp>

#include "absl/status/statusor.h"
#include "server/auth/tls_files.h"

namespace vantage::web {

struct ClientCertificates {
  bool asked_for = false;  // one that is shown must be signed by an authority of the files
  bool required = false;
};

// TLS 1.2 or later with the certificate that `files` have now; who is connected keeps what there
// was. INVALID_ARGUMENT: OpenSSL does not take them.
absl::StatusOr<std::shared_ptr<boost::asio::ssl::context>> MakeTlsContext(
    const auth::TlsFiles& files, ClientCertificates clients);

}  // namespace vantage::web

#endif  // VANTAGE_SERVER_WEB_TLS_CONTEXT_H_

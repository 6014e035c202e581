#include "server/web/tls_context.h"

#include <openssl/ssl.h>

#include <utility>

#include "absl/strings/str_cat.h"

namespace vantage::web {
namespace {

namespace ssl = boost::asio::ssl;

// The protocol's name with its length, as the handshake has it (RFC 7301).
constexpr unsigned char kProtocols[] = "\x08http/1.1";

// Clients that name other protocols alone get none, and may go on without.
int ChooseProtocol(SSL*, const unsigned char** chosen, unsigned char* size,
                   const unsigned char* offered, unsigned offered_size, void*) {
  unsigned char* found = nullptr;
  if (SSL_select_next_proto(&found, size, kProtocols, sizeof kProtocols - 1, offered,
                            offered_size) != OPENSSL_NPN_NEGOTIATED) {
    return SSL_TLSEXT_ERR_NOACK;
  }
  *chosen = found;
  return SSL_TLSEXT_ERR_OK;
}

}  // namespace

absl::StatusOr<std::shared_ptr<ssl::context>> MakeTlsContext(const auth::TlsFiles& files,
                                                             ClientCertificates clients) {
  auto context = std::make_shared<ssl::context>(ssl::context::tls_server);
  SSL_CTX* raw = context->native_handle();
  boost::system::error_code error;
  context->use_certificate_chain_file(files.certificate_path(), error);
  if (!error) context->use_private_key_file(files.key_path(), ssl::context::pem, error);
  if (!error && clients.asked_for) {
    context->load_verify_file(files.client_ca_path(), error);
    SSL_CTX_set_client_CA_list(raw, SSL_load_client_CA_file(files.client_ca_path().c_str()));
    context->set_verify_mode(ssl::verify_peer |
                             (clients.required ? ssl::verify_fail_if_no_peer_cert : 0));
  }
  if (error) {
    return absl::InvalidArgumentError(
        absl::StrCat("the certificates cannot be used for the web: ", error.message()));
  }
  SSL_CTX_set_min_proto_version(raw, TLS1_2_VERSION);
  // A resumed session would bring along a certificate that was checked by an authority of before.
  SSL_CTX_set_session_cache_mode(raw, SSL_SESS_CACHE_OFF);
  SSL_CTX_set_options(raw, SSL_OP_NO_TICKET | SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION |
                               SSL_OP_CIPHER_SERVER_PREFERENCE);
  SSL_CTX_set_alpn_select_cb(raw, &ChooseProtocol, nullptr);
  return context;
}

}  // namespace vantage::web

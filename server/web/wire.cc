#include "server/web/wire.h"

#include <openssl/ssl.h>
#include <openssl/x509.h>

#include <utility>

#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/write.hpp>

#include "absl/strings/escaping.h"

namespace vantage::web {

namespace asio = boost::asio;

struct Wire::Tls {
  Tls(Socket& socket, std::shared_ptr<asio::ssl::context> from)
      : context(std::move(from)), stream(socket, *context) {}
  // Outlives the connection, also where new ones get other certificates.
  const std::shared_ptr<asio::ssl::context> context;
  asio::ssl::stream<Socket&> stream;
};

Wire::Wire(Socket socket, std::shared_ptr<asio::ssl::context> tls) : socket_(std::move(socket)) {
  if (tls != nullptr) tls_ = std::make_unique<Tls>(socket_, std::move(tls));
}

Wire::~Wire() = default;

bool Wire::encrypted() const { return tls_ != nullptr; }

void Wire::Handshake(std::function<void(boost::system::error_code)> done) {
  tls_->stream.async_handshake(asio::ssl::stream_base::server, std::move(done));
}

std::optional<std::string> Wire::PeerCertificate() const {
  if (tls_ == nullptr) return std::nullopt;
  X509* shown = SSL_get1_peer_certificate(tls_->stream.native_handle());
  if (shown == nullptr) return std::nullopt;
  unsigned char* der = nullptr;
  const int size = i2d_X509(shown, &der);
  X509_free(shown);
  if (size <= 0) return std::nullopt;
  std::string text = absl::Base64Escape(
      {reinterpret_cast<const char*>(der), static_cast<size_t>(size)});  // NOLINT: bytes
  OPENSSL_free(der);
  return text;
}

void Wire::Read(char* to, size_t bytes, Done done) {
  const auto room = asio::buffer(to, bytes);
  if (tls_ != nullptr) return tls_->stream.async_read_some(room, std::move(done));
  socket_.async_read_some(room, std::move(done));
}

void Wire::Write(absl::string_view bytes, Done done) {
  const auto all = asio::buffer(bytes.data(), bytes.size());
  if (tls_ != nullptr) return asio::async_write(tls_->stream, all, std::move(done));
  asio::async_write(socket_, all, std::move(done));
}

void Wire::EndWriting(std::function<void()> done) {
  boost::system::error_code ignored;
  if (tls_ == nullptr) {
    socket_.shutdown(Socket::shutdown_send, ignored);
    return asio::post(socket_.get_executor(), std::move(done));
  }
  // Says so, and waits for the client to say it, too; whoever calls has a deadline for that.
  tls_->stream.async_shutdown(
      [done = std::move(done)](const boost::system::error_code&) { done(); });
}

void Wire::Close() {
  boost::system::error_code ignored;
  socket_.close(ignored);
}

}  // namespace vantage::web

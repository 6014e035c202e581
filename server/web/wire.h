// One connection's bytes: a socket, encrypted or not.
#ifndef VANTAGE_SERVER_WEB_WIRE_H_
#define VANTAGE_SERVER_WEB_WIRE_H_

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/system/error_code.hpp>

#include "absl/strings/string_view.h"

namespace vantage::web {

using Socket = boost::asio::generic::stream_protocol::socket;

// Everything runs on the socket's executor, and is used from there alone. At most one Read() and
// one Write() are under way at a time.
class Wire {
 public:
  using Done = std::function<void(boost::system::error_code, size_t)>;

  // `tls`: null where nothing is encrypted.
  Wire(Socket socket, std::shared_ptr<boost::asio::ssl::context> tls);
  ~Wire();
  Wire(const Wire&) = delete;
  Wire& operator=(const Wire&) = delete;

  bool encrypted() const;
  // To be called first where it is encrypted.
  void Handshake(std::function<void(boost::system::error_code)> done);
  // The certificate that the client showed, after the handshake: DER in base64.
  std::optional<std::string> PeerCertificate() const;

  // What comes next, some of it.
  void Read(char* to, size_t bytes, Done done);
  // All of it. The bytes stay where they are until it is done.
  void Write(absl::string_view bytes, Done done);
  // Says that nothing follows; what the client still sends can be read.
  void EndWriting(std::function<void()> done);
  // Ends whatever is under way with an error.
  void Close();

 private:
  struct Tls;
  Socket socket_;
  std::unique_ptr<Tls> tls_;
};

}  // namespace vantage::web

#endif  // VANTAGE_SERVER_WEB_WIRE_H_

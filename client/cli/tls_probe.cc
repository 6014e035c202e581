#include "client/cli/tls_probe.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netdb.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <memory>
#include <thread>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "absl/synchronization/notification.h"
#include "absl/time/time.h"

namespace vantage::cli {
namespace {

using Clock = std::chrono::steady_clock;

class Socket {
 public:
  explicit Socket(int descriptor) : descriptor_(descriptor) {}
  Socket(Socket&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  Socket& operator=(Socket&&) = delete;
  ~Socket() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  int get() const { return descriptor_; }

 private:
  int descriptor_;
};

using Found = std::unique_ptr<addrinfo, decltype(&freeaddrinfo)>;

// What a look-up comes to, shared with the thread that waits for it.
struct LookedUp {
  absl::Notification done;
  int failed = 0;
  Found first{nullptr, &freeaddrinfo};
};

// The resolver takes its own time where name servers are silent, and cannot be stopped: after
// `seconds` it is left alone.
absl::StatusOr<Found> LookUp(const HostPort& address, double seconds) {
  const auto found = std::make_shared<LookedUp>();
  std::thread([found, address] {
    addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* first = nullptr;
    found->failed = getaddrinfo(address.host.c_str(), address.port.c_str(), &hints, &first);
    if (found->failed == 0) found->first.reset(first);
    found->done.Notify();
  }).detach();
  if (!found->done.WaitForNotificationWithTimeout(absl::Seconds(seconds))) {
    return absl::NotFoundError(
        absl::StrCat("nobody says what the name ", address.host, " stands for: no answer"));
  }
  if (found->failed != 0) {
    return absl::NotFoundError(
        absl::StrCat("the name ", address.host, " is not known: ", gai_strerror(found->failed)));
  }
  return std::move(found->first);
}

Clock::time_point After(double seconds) {
  return Clock::now() +
         std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

bool Wait(int descriptor, short events, Clock::time_point until) {  // NOLINT(google-runtime-int)
  const auto left =
      std::chrono::duration_cast<std::chrono::milliseconds>(until - Clock::now()).count();
  pollfd waits{descriptor, events, 0};
  return poll(&waits, 1, static_cast<int>(std::max<int64_t>(0, left))) > 0;
}

absl::StatusOr<Socket> ConnectTo(int family, const sockaddr* to, socklen_t size,
                                 Clock::time_point until) {
  Socket socket(::socket(family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (socket.get() < 0) return absl::UnavailableError(std::strerror(errno));
  if (connect(socket.get(), to, size) == 0) return socket;
  if (errno != EINPROGRESS) return absl::UnavailableError(std::strerror(errno));
  if (!Wait(socket.get(), POLLOUT, until)) {
    return absl::UnavailableError("nothing answers there: a firewall may drop what is sent");
  }
  int error = 0;
  socklen_t length = sizeof error;
  getsockopt(socket.get(), SOL_SOCKET, SO_ERROR, &error, &length);
  if (error != 0) return absl::UnavailableError(std::strerror(error));
  return socket;
}

// Each of a name's addresses has its share of the patience: the first may be a dead end.
absl::StatusOr<Socket> Connect(const HostPort& address, double seconds) {
  if (address.port.empty()) {
    sockaddr_un to{};
    to.sun_family = AF_UNIX;
    if (address.host.size() >= sizeof to.sun_path) {
      return absl::UnavailableError("the path of the socket is too long");
    }
    std::copy(address.host.begin(), address.host.end(), to.sun_path);
    return ConnectTo(AF_UNIX, reinterpret_cast<const sockaddr*>(&to), sizeof to, After(seconds));
  }
  const absl::StatusOr<Found> found = LookUp(address, seconds);
  if (!found.ok()) return found.status();
  int addresses = 0;
  for (const addrinfo* at = found->get(); at != nullptr; at = at->ai_next) ++addresses;
  absl::Status why = absl::UnavailableError("it has no address");
  for (const addrinfo* at = found->get(); at != nullptr; at = at->ai_next) {
    absl::StatusOr<Socket> socket =
        ConnectTo(at->ai_family, at->ai_addr, at->ai_addrlen, After(seconds / addresses));
    if (socket.ok()) return socket;
    why = socket.status();
  }
  return why;
}

std::string LastTlsError() {
  const unsigned long error = ERR_get_error();  // NOLINT(google-runtime-int)
  const char* words = error == 0 ? nullptr : ERR_reason_error_string(error);
  ERR_clear_error();
  return words == nullptr ? "no reason is given" : words;
}

enum class Handshaken { kDone, kNoTls, kSilent, kHungUp };

// One step of the handshake after the other.
Handshaken Handshake(SSL* tls, int descriptor, Clock::time_point until) {
  while (true) {
    const int done = SSL_connect(tls);
    if (done == 1) return Handshaken::kDone;
    const int wants = SSL_get_error(tls, done);
    if (wants == SSL_ERROR_WANT_READ) {
      if (!Wait(descriptor, POLLIN, until)) return Handshaken::kSilent;
    } else if (wants == SSL_ERROR_WANT_WRITE) {
      if (!Wait(descriptor, POLLOUT, until)) return Handshaken::kSilent;
    } else {
      // A server without TLS says something else, ours the beginning of HTTP/2.
      return BIO_number_read(SSL_get_rbio(tls)) == 0 ? Handshaken::kHungUp : Handshaken::kNoTls;
    }
  }
}

std::vector<std::string> NamesOf(X509* certificate) {
  std::vector<std::string> names;
  auto* all = static_cast<GENERAL_NAMES*>(
      X509_get_ext_d2i(certificate, NID_subject_alt_name, nullptr, nullptr));
  for (int i = 0; i < sk_GENERAL_NAME_num(all); ++i) {
    const GENERAL_NAME* name = sk_GENERAL_NAME_value(all, i);
    if (name->type == GEN_DNS) {
      names.emplace_back(reinterpret_cast<const char*>(ASN1_STRING_get0_data(name->d.dNSName)),
                         static_cast<size_t>(ASN1_STRING_length(name->d.dNSName)));
    } else if (name->type == GEN_IPADD) {
      const unsigned char* bytes = ASN1_STRING_get0_data(name->d.iPAddress);
      const bool four = ASN1_STRING_length(name->d.iPAddress) == 4;
      if (four) {
        names.push_back(absl::StrCat(bytes[0], ".", bytes[1], ".", bytes[2], ".", bytes[3]));
      } else {
        names.emplace_back("an IPv6 address");
      }
    }
  }
  GENERAL_NAMES_free(all);
  return names;
}

}  // namespace

absl::StatusOr<HostPort> ParseAddress(const std::string& server) {
  absl::string_view text = server;
  if (absl::ConsumePrefix(&text, "unix:")) {
    absl::ConsumePrefix(&text, "//");
    if (!text.empty()) return HostPort{std::string(text), ""};
  } else if (const size_t colon = text.rfind(':'); colon != absl::string_view::npos) {
    absl::string_view host = text.substr(0, colon);
    const absl::string_view port = text.substr(colon + 1);
    if (absl::StartsWith(host, "[") && absl::EndsWith(host, "]")) {
      host = host.substr(1, host.size() - 2);
    }
    const bool number = !port.empty() && port.find_first_not_of("0123456789") == port.npos;
    if (!host.empty() && number) return HostPort{std::string(host), std::string(port)};
  }
  return absl::InvalidArgumentError(absl::StrCat("'", server, "' is no address"));
}

absl::StatusOr<std::vector<std::string>> Resolve(const HostPort& address, double seconds) {
  const absl::StatusOr<Found> found = LookUp(address, seconds);
  if (!found.ok()) return found.status();
  std::vector<std::string> addresses;
  for (const addrinfo* at = found->get(); at != nullptr; at = at->ai_next) {
    char text[NI_MAXHOST] = {};
    if (getnameinfo(at->ai_addr, at->ai_addrlen, text, sizeof text, nullptr, 0, NI_NUMERICHOST) ==
        0) {
      addresses.emplace_back(text);
    }
  }
  return addresses;
}

absl::Status Reach(const HostPort& address, double seconds) {
  return Connect(address, seconds).status();
}

absl::StatusOr<std::optional<Certificate>> ShakeHands(const HostPort& address,
                                                      const client::ClientOptions& options,
                                                      double seconds) {
  const std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> context(SSL_CTX_new(TLS_client_method()),
                                                                  &SSL_CTX_free);
  if (!options.tls_ca.empty() &&
      SSL_CTX_load_verify_locations(context.get(), options.tls_ca.c_str(), nullptr) != 1) {
    return absl::InvalidArgumentError(
        absl::StrCat(options.tls_ca, " cannot be read as certificates: ", LastTlsError()));
  }
  if (!options.tls_cert.empty() &&
      SSL_CTX_use_certificate_chain_file(context.get(), options.tls_cert.c_str()) != 1) {
    return absl::InvalidArgumentError(
        absl::StrCat(options.tls_cert, " cannot be read as a certificate: ", LastTlsError()));
  }
  if (!options.tls_key.empty() &&
      SSL_CTX_use_PrivateKey_file(context.get(), options.tls_key.c_str(), SSL_FILETYPE_PEM) != 1) {
    return absl::InvalidArgumentError(absl::StrCat(
        options.tls_key, " is no key, or not that of the certificate: ", LastTlsError()));
  }
  // What is wrong with the certificate is looked at afterwards.
  SSL_CTX_set_verify(context.get(), SSL_VERIFY_NONE, nullptr);
  const unsigned char http2[] = {2, 'h', '2'};
  SSL_CTX_set_alpn_protos(context.get(), http2, sizeof http2);
  const absl::StatusOr<Socket> socket = Connect(address, seconds);
  if (!socket.ok()) return socket.status();
  const std::unique_ptr<SSL, decltype(&SSL_free)> tls(SSL_new(context.get()), &SSL_free);
  in6_addr numeric{};
  const bool is_numeric = inet_pton(AF_INET, address.host.c_str(), &numeric) == 1 ||
                          inet_pton(AF_INET6, address.host.c_str(), &numeric) == 1;
  const bool asked = is_numeric ? X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(tls.get()),
                                                                address.host.c_str()) == 1
                                : SSL_set_tlsext_host_name(tls.get(), address.host.c_str()) == 1 &&
                                      SSL_set1_host(tls.get(), address.host.c_str()) == 1;
  if (!asked) {
    return absl::InvalidArgumentError(
        absl::StrCat("no certificate can be for '", address.host, "'"));
  }
  SSL_set_fd(tls.get(), socket->get());
  const Handshaken outcome = Handshake(tls.get(), socket->get(), After(seconds));
  ERR_clear_error();
  if (outcome == Handshaken::kSilent) {
    return absl::UnavailableError("whoever listens there takes connections and says nothing");
  }
  if (outcome == Handshaken::kHungUp) {
    return absl::UnavailableError("whoever listens there takes connections and hangs up at once");
  }
  if (outcome == Handshaken::kNoTls) return std::optional<Certificate>();
  const std::unique_ptr<X509, decltype(&X509_free)> shown(SSL_get1_peer_certificate(tls.get()),
                                                          &X509_free);
  if (shown == nullptr) return std::optional<Certificate>();
  Certificate certificate;
  char subject[256] = {};
  X509_NAME_oneline(X509_get_subject_name(shown.get()), subject, sizeof subject - 1);
  certificate.subject = subject;
  certificate.names = NamesOf(shown.get());
  int days = 0;
  int rest = 0;
  ASN1_TIME_diff(&days, &rest, nullptr, X509_get0_notAfter(shown.get()));
  certificate.days_left = days + rest / 86400.0;
  const long verdict = SSL_get_verify_result(tls.get());  // NOLINT(google-runtime-int)
  if (verdict != X509_V_OK) {
    certificate.trusted = absl::UnauthenticatedError(X509_verify_cert_error_string(verdict));
  }
  return std::optional<Certificate>(std::move(certificate));
}

}  // namespace vantage::cli

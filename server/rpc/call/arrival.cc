#include "server/rpc/call/arrival.h"

#include <array>
#include <utility>

#include <openssl/crypto.h>
#include <openssl/rand.h>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace vantage::rpc {
namespace {

constexpr size_t kSecretBytes = 32;

std::string KeyOf(const char* what) { return absl::StrCat(kWebPrefix, what); }

// nullopt: there is none, or several.
std::optional<std::string> Told(const grpc::ServerContextBase& context, const std::string& key) {
  if (context.client_metadata().count(key) != 1) return std::nullopt;
  const grpc::string_ref& value = context.client_metadata().find(key)->second;
  return std::string(value.data(), value.size());
}

}  // namespace

WebSeal WebSeal::New() {
  std::array<unsigned char, kSecretBytes> bits{};
  WebSeal seal;
  // Without random bits nobody comes in by the web.
  if (RAND_bytes(bits.data(), static_cast<int>(bits.size())) == 1) {
    seal.secret_ = absl::BytesToHexString({reinterpret_cast<char*>(bits.data()),  // NOLINT: bytes
                                           bits.size()});
  }
  return seal;
}

std::multimap<std::string, std::string> WebSeal::Metadata(const Arrival& arrival) const {
  std::multimap<std::string, std::string> metadata{{KeyOf("seal"), secret_},
                                                   {KeyOf("peer"), arrival.peer}};
  if (arrival.certificate.has_value()) {
    metadata.emplace(KeyOf("certificate"), *arrival.certificate);
  }
  return metadata;
}

Arrival WebSeal::Read(const grpc::ServerContextBase& context) const {
  Arrival arrival;
  arrival.peer = context.peer();
  if (secret_.empty() || absl::StartsWith(arrival.peer, "ip") ||
      absl::StartsWith(arrival.peer, "unix:")) {
    return arrival;
  }
  const std::optional<std::string> shown = Told(context, KeyOf("seal"));
  if (!shown.has_value() || shown->size() != secret_.size() ||
      CRYPTO_memcmp(shown->data(), secret_.data(), secret_.size()) != 0) {
    return arrival;
  }
  arrival.peer = Told(context, KeyOf("peer")).value_or("");
  arrival.certificate = Told(context, KeyOf("certificate"));
  arrival.by_web = true;
  return arrival;
}

}  // namespace vantage::rpc

#include "server/auth/forwarded.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <openssl/err.h>
#include <openssl/objects.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include <array>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "server/auth/openssl_owned.h"

namespace vantage::auth {
namespace {

constexpr size_t kIpv4Bytes = 4;
constexpr size_t kIpv6Bytes = 16;

absl::Status NoCertificate() {
  ERR_clear_error();
  return absl::InvalidArgumentError("not a certificate as DER in base64");
}

std::string BytesOf(const ASN1_STRING& text) {
  const unsigned char* data = ASN1_STRING_get0_data(&text);
  return {data, data + ASN1_STRING_length(&text)};
}

// As people write it; empty: neither IPv4 nor IPv6.
std::string AddressOf(const ASN1_OCTET_STRING& bytes) {
  const auto size = static_cast<size_t>(ASN1_STRING_length(&bytes));
  if (size != kIpv4Bytes && size != kIpv6Bytes) return "";
  std::array<char, INET6_ADDRSTRLEN> text{};
  const char* written = inet_ntop(size == kIpv4Bytes ? AF_INET : AF_INET6,
                                  ASN1_STRING_get0_data(&bytes), text.data(), text.size());
  return written == nullptr ? "" : written;
}

// Empty: of a kind by which nobody is known.
std::string TextOf(const GENERAL_NAME& name) {
  switch (name.type) {
    case GEN_DNS:
      return BytesOf(*name.d.dNSName);
    case GEN_EMAIL:
      return BytesOf(*name.d.rfc822Name);
    case GEN_URI:
      return BytesOf(*name.d.uniformResourceIdentifier);
    case GEN_IPADD:
      return AddressOf(*name.d.iPAddress);
    default:
      return "";
  }
}

// Empty: it has none.
std::string CommonName(const X509& certificate) {
  const X509_NAME* subject = X509_get_subject_name(&certificate);
  const int at = X509_NAME_get_index_by_NID(subject, NID_commonName, -1);
  if (at < 0) return "";
  const ASN1_STRING* value = X509_NAME_ENTRY_get_data(X509_NAME_get_entry(subject, at));
  unsigned char* utf8 = nullptr;
  const int size = ASN1_STRING_to_UTF8(&utf8, value);
  if (size < 0) return "";
  std::string name(utf8, utf8 + size);
  OPENSSL_free(utf8);
  return name;
}

}  // namespace

absl::StatusOr<std::vector<std::string>> CertificateNames(absl::string_view text) {
  std::string der;
  if (!absl::Base64Unescape(text, &der)) return NoCertificate();
  const auto* at = reinterpret_cast<const unsigned char*>(der.data());  // NOLINT: bytes
  const auto* const begin = at;
  const OwnedCertificate certificate(d2i_X509(nullptr, &at, static_cast<long>(der.size())));
  if (certificate == nullptr || static_cast<size_t>(at - begin) != der.size()) {
    return NoCertificate();
  }
  std::vector<std::string> names;
  const OwnedNames alternatives(static_cast<GENERAL_NAMES*>(
      X509_get_ext_d2i(certificate.get(), NID_subject_alt_name, nullptr, nullptr)));
  for (int i = 0; alternatives != nullptr && i < sk_GENERAL_NAME_num(alternatives.get()); ++i) {
    names.push_back(TextOf(*sk_GENERAL_NAME_value(alternatives.get(), i)));
  }
  names.push_back(CommonName(*certificate));
  std::erase(names, "");
  ERR_clear_error();
  return names;
}

std::optional<std::string> ClientAddress(absl::string_view text) {
  const std::string given(text);
  in_addr four{};
  if (inet_pton(AF_INET, given.c_str(), &four) == 1) return absl::StrCat("ipv4:", given);
  in6_addr six{};
  if (inet_pton(AF_INET6, given.c_str(), &six) != 1) return std::nullopt;
  std::array<char, INET6_ADDRSTRLEN> written{};
  if (IN6_IS_ADDR_V4MAPPED(&six)) {
    inet_ntop(AF_INET, &six.s6_addr[kIpv6Bytes - kIpv4Bytes], written.data(), written.size());
    return absl::StrCat("ipv4:", written.data());
  }
  inet_ntop(AF_INET6, &six, written.data(), written.size());
  return absl::StrCat("ipv6:[", written.data(), "]");
}

}  // namespace vantage::auth

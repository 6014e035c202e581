// Keys and certificates as they are made and read here, by OpenSSL.
#ifndef VANTAGE_SERVER_FIELD_X509_H_
#define VANTAGE_SERVER_FIELD_X509_H_

#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "server/auth/openssl_owned.h"

namespace vantage::field {

// What a certificate is to say, beside its key.
struct CertificateText {
  std::string common_name;
  absl::Time begins;
  absl::Time ends;
  // Extensions by OpenSSL's numbers, with their values as OpenSSL's configuration files have them.
  std::vector<std::pair<int, std::string>> extensions;
};

// A new key on P-256, which every browser takes. INTERNAL.
absl::StatusOr<auth::OwnedKey> NewKey();

// A certificate of `key`, signed with `issuer_key` for `issuer`; null: for itself. INTERNAL.
absl::StatusOr<auth::OwnedCertificate> Certify(const CertificateText& text, EVP_PKEY& key,
                                               EVP_PKEY& issuer_key, const X509* issuer);

std::string PemOf(const X509& certificate);
std::string PemOf(const EVP_PKEY& key);
std::string DerOf(const X509& certificate);
// Null: it is none.
auth::OwnedCertificate CertificateOfPem(const std::string& pem);
auth::OwnedKey KeyOfPem(const std::string& pem);

absl::Time BeginOf(const X509& certificate);
absl::Time EndOf(const X509& certificate);
// Its DNS names and addresses, in order of the alphabet.
std::vector<std::string> NamesOf(const X509& certificate);
// SHA-256 as browsers show it: 'AB:CD:...'.
std::string FingerprintOf(const X509& certificate);

}  // namespace vantage::field

#endif  // VANTAGE_SERVER_FIELD_X509_H_

#include "server/auth/tls_files.h"

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <ctime>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"

namespace vantage::auth {
namespace {

template <auto kFree>
struct Freed {
  template <typename T>
  void operator()(T* it) const {
    kFree(it);
  }
};
using Bio = std::unique_ptr<BIO, Freed<BIO_free>>;
using Certificate = std::unique_ptr<X509, Freed<X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, Freed<EVP_PKEY_free>>;

absl::Status Wrong(const std::string& path, const char* what) {
  ERR_clear_error();
  return absl::InvalidArgumentError(absl::StrCat(path, " ", what));
}

absl::StatusOr<Certificate> ReadCertificate(const std::string& path) {
  const Bio file(BIO_new_file(path.c_str(), "r"));
  if (file == nullptr) return Wrong(path, "cannot be read");
  Certificate read(PEM_read_bio_X509(file.get(), nullptr, nullptr, nullptr));
  if (read == nullptr) return Wrong(path, "holds no certificate in PEM");
  return read;
}

absl::StatusOr<absl::Time> EndOf(const X509& certificate, const std::string& path) {
  std::tm end{};
  if (ASN1_TIME_to_tm(X509_get0_notAfter(&certificate), &end) != 1) {
    return Wrong(path, "has no end of validity that can be read");
  }
  const absl::Time expires = absl::FromTM(end, absl::UTCTimeZone());
  if (expires <= absl::Now()) return Wrong(path, "has expired");
  return expires;
}

}  // namespace

absl::StatusOr<absl::Time> CheckTlsFiles(const AccessOptions& options) {
  const absl::StatusOr<Certificate> certificate = ReadCertificate(options.tls_cert);
  if (!certificate.ok()) return certificate.status();
  const Bio file(BIO_new_file(options.tls_key.c_str(), "r"));
  if (file == nullptr) return Wrong(options.tls_key, "cannot be read");
  const Key key(PEM_read_bio_PrivateKey(file.get(), nullptr, nullptr, nullptr));
  if (key == nullptr) return Wrong(options.tls_key, "holds no key in PEM without a passphrase");
  if (X509_check_private_key(certificate->get(), key.get()) != 1) {
    return Wrong(options.tls_key, "is not the key of the certificate");
  }
  absl::StatusOr<absl::Time> expires = EndOf(**certificate, options.tls_cert);
  if (!expires.ok() || options.tls_client_ca.empty()) return expires;
  const absl::StatusOr<Certificate> ca = ReadCertificate(options.tls_client_ca);
  if (!ca.ok()) return ca.status();
  const absl::StatusOr<absl::Time> ca_expires = EndOf(**ca, options.tls_client_ca);
  if (!ca_expires.ok()) return ca_expires.status();
  return expires;
}

}  // namespace vantage::auth

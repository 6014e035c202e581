#include "server/field/x509.h"

#include <openssl/bio.h>
#include <openssl/ec.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include <algorithm>
#include <array>
#include <ctime>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/bytes/checksum.h"
#include "server/field/addresses.h"

namespace vantage::field {
namespace {

// RFC 5280 allows 20; the first bit is 0, since the number must be positive.
constexpr size_t kSerialBytes = 16;

absl::Status Failed(absl::string_view what) {
  ERR_clear_error();
  return absl::InternalError(absl::StrCat("OpenSSL cannot make ", what));
}

std::string TextIn(BIO* bio) {
  char* data = nullptr;
  const auto size = BIO_get_mem_data(bio, &data);
  return {data, static_cast<size_t>(size)};
}

auth::OwnedBio Writing() { return auth::OwnedBio(BIO_new(BIO_s_mem())); }

auth::OwnedBio ReadingPem(const std::string& text) {
  return auth::OwnedBio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

bool SetSerial(X509& certificate) {
  std::array<unsigned char, kSerialBytes> random{};
  if (RAND_bytes(random.data(), static_cast<int>(random.size())) != 1) return false;
  random[0] = static_cast<unsigned char>((random[0] & 0x7F) | 0x40);
  const std::unique_ptr<BIGNUM, auth::FreedBy<BN_free>> number(
      BN_bin2bn(random.data(), static_cast<int>(random.size()), nullptr));
  return number != nullptr &&
         BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(&certificate)) != nullptr;
}

bool AddExtension(X509& certificate, const X509& issuer, int nid, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, const_cast<X509*>(&issuer), &certificate,  // NOLINT: OpenSSL's type
                 nullptr, nullptr, 0);
  const std::unique_ptr<X509_EXTENSION, auth::FreedBy<X509_EXTENSION_free>> extension(
      X509V3_EXT_conf_nid(nullptr, &context, nid, value.c_str()));
  return extension != nullptr && X509_add_ext(&certificate, extension.get(), -1) == 1;
}

absl::Time TimeOf(const ASN1_TIME* time) {
  std::tm read{};
  if (ASN1_TIME_to_tm(time, &read) != 1) return absl::InfinitePast();
  return absl::FromTM(read, absl::UTCTimeZone());
}

}  // namespace

absl::StatusOr<auth::OwnedKey> NewKey() {
  auth::OwnedKey key(EVP_EC_gen("P-256"));
  if (key == nullptr) return Failed("a key");
  return key;
}

absl::StatusOr<auth::OwnedCertificate> Certify(const CertificateText& text, EVP_PKEY& key,
                                               EVP_PKEY& issuer_key, const X509* issuer) {
  auth::OwnedCertificate made(X509_new());
  if (made == nullptr || X509_set_version(made.get(), X509_VERSION_3) != 1 || !SetSerial(*made) ||
      ASN1_TIME_set(X509_getm_notBefore(made.get()), absl::ToTimeT(text.begins)) == nullptr ||
      ASN1_TIME_set(X509_getm_notAfter(made.get()), absl::ToTimeT(text.ends)) == nullptr ||
      X509_set_pubkey(made.get(), &key) != 1) {
    return Failed("a certificate");
  }
  X509_NAME* name = X509_get_subject_name(made.get());
  const auto* common = reinterpret_cast<const unsigned char*>(text.common_name.data());  // NOLINT
  if (X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_UTF8, common,
                                 static_cast<int>(text.common_name.size()), -1, 0) != 1) {
    return Failed("a certificate's name");
  }
  const X509& issued_by = issuer == nullptr ? std::as_const(*made) : *issuer;
  if (X509_set_issuer_name(made.get(), X509_get_subject_name(&issued_by)) != 1) {
    return Failed("a certificate's issuer");
  }
  for (const auto& [nid, value] : text.extensions) {
    if (!AddExtension(*made, issued_by, nid, value)) {
      return Failed(absl::StrCat("a certificate that says '", value, "'"));
    }
  }
  if (X509_sign(made.get(), &issuer_key, EVP_sha256()) == 0) return Failed("a signature");
  return made;
}

std::string PemOf(const X509& certificate) {
  const auth::OwnedBio bio = Writing();
  PEM_write_bio_X509(bio.get(), &certificate);
  return TextIn(bio.get());
}

std::string PemOf(const EVP_PKEY& key) {
  const auth::OwnedBio bio = Writing();
  PEM_write_bio_PKCS8PrivateKey(bio.get(), &key, nullptr, nullptr, 0, nullptr, nullptr);
  return TextIn(bio.get());
}

std::string DerOf(const X509& certificate) {
  const auth::OwnedBio bio = Writing();
  i2d_X509_bio(bio.get(), &certificate);
  return TextIn(bio.get());
}

auth::OwnedCertificate CertificateOfPem(const std::string& pem) {
  auth::OwnedCertificate read(PEM_read_bio_X509(ReadingPem(pem).get(), nullptr, nullptr, nullptr));
  ERR_clear_error();
  return read;
}

auth::OwnedKey KeyOfPem(const std::string& pem) {
  auth::OwnedKey read(PEM_read_bio_PrivateKey(ReadingPem(pem).get(), nullptr, nullptr, nullptr));
  ERR_clear_error();
  return read;
}

absl::Time BeginOf(const X509& certificate) { return TimeOf(X509_get0_notBefore(&certificate)); }
absl::Time EndOf(const X509& certificate) { return TimeOf(X509_get0_notAfter(&certificate)); }

std::vector<std::string> NamesOf(const X509& certificate) {
  std::vector<std::string> names;
  const auth::OwnedNames listed(static_cast<GENERAL_NAMES*>(
      X509_get_ext_d2i(&certificate, NID_subject_alt_name, nullptr, nullptr)));
  for (int i = 0; listed != nullptr && i < sk_GENERAL_NAME_num(listed.get()); ++i) {
    int type = 0;
    const void* value = GENERAL_NAME_get0_value(sk_GENERAL_NAME_value(listed.get(), i), &type);
    if (type != GEN_DNS && type != GEN_IPADD) continue;
    const auto* string = static_cast<const ASN1_STRING*>(value);
    const std::string bytes(reinterpret_cast<const char*>(ASN1_STRING_get0_data(string)),  // NOLINT
                            static_cast<size_t>(ASN1_STRING_length(string)));
    names.push_back(type == GEN_DNS ? bytes : AddressOfBytes(bytes));
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::string FingerprintOf(const X509& certificate) {
  const std::string hash = bytes::Sha256::Of(DerOf(certificate));
  std::string shown;
  for (const char byte : hash) {
    absl::StrAppend(&shown, shown.empty() ? "" : ":",
                    absl::AsciiStrToUpper(absl::BytesToHexString(absl::string_view(&byte, 1))));
  }
  return shown;
}

}  // namespace vantage::field

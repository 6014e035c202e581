// OpenSSL's objects as values that are freed with their owner.
#ifndef VANTAGE_SERVER_AUTH_OPENSSL_OWNED_H_
#define VANTAGE_SERVER_AUTH_OPENSSL_OWNED_H_

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include <memory>

namespace vantage::auth {

template <auto kFree>
struct FreedBy {
  template <typename T>
  void operator()(T* it) const {
    kFree(it);
  }
};
using OwnedBio = std::unique_ptr<BIO, FreedBy<BIO_free>>;
using OwnedCertificate = std::unique_ptr<X509, FreedBy<X509_free>>;
using OwnedKey = std::unique_ptr<EVP_PKEY, FreedBy<EVP_PKEY_free>>;
using OwnedNames = std::unique_ptr<GENERAL_NAMES, FreedBy<GENERAL_NAMES_free>>;

}  // namespace vantage::auth

#endif  // VANTAGE_SERVER_AUTH_OPENSSL_OWNED_H_

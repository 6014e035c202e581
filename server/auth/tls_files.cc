#include "server/auth/tls_files.h"

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "server/auth/openssl_owned.h"

namespace vantage::auth {
namespace {

absl::Status Wrong(const std::string& path, const char* what) {
  ERR_clear_error();
  return absl::InvalidArgumentError(absl::StrCat(path, " ", what));
}

absl::StatusOr<std::string> ReadText(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file.good() && !file.eof()) return Wrong(path, "cannot be read");
  return text;
}

OwnedBio Reading(const std::string& text) {
  return OwnedBio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

absl::StatusOr<OwnedCertificate> ReadCertificate(const std::string& text, const std::string& path) {
  const OwnedBio bio = Reading(text);
  OwnedCertificate read(PEM_read_bio_X509(bio.get(), nullptr, nullptr, nullptr));
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

absl::Status NoRoom(const char* doing) {
  return absl::InternalError(absl::StrCat(doing, ": ", std::strerror(errno)));
}

}  // namespace

TlsFiles::MemoryFile::~MemoryFile() {
  if (file_ >= 0) close(file_);
}

absl::Status TlsFiles::MemoryFile::Create(const char* name) {
  file_ = memfd_create(name, MFD_CLOEXEC);
  return file_ >= 0 ? absl::OkStatus() : NoRoom("memfd_create");
}

// gRPC compares the times before and after it read the files, and reads again where one changed
// meanwhile. Those times are whole seconds, and this is called every few.
absl::Status TlsFiles::MemoryFile::Replace(const std::string& text) {
  if (ftruncate(file_, 0) != 0) return NoRoom("ftruncate");
  size_t done = 0;
  while (done < text.size()) {
    const ssize_t written =
        pwrite(file_, text.data() + done, text.size() - done, static_cast<off_t>(done));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return NoRoom("pwrite");
    done += static_cast<size_t>(written);
  }
  return absl::OkStatus();
}

std::string TlsFiles::MemoryFile::path() const {
  return file_ < 0 ? "" : absl::StrCat("/proc/self/fd/", file_);
}

absl::StatusOr<std::unique_ptr<TlsFiles>> TlsFiles::Open(const AccessOptions& options) {
  std::unique_ptr<TlsFiles> files(new TlsFiles(options));
  if (absl::Status s = files->certificate_.Create("tls-cert"); !s.ok()) return s;
  if (absl::Status s = files->key_.Create("tls-key"); !s.ok()) return s;
  if (!options.tls_client_ca.empty()) {
    if (absl::Status s = files->client_ca_.Create("tls-client-ca"); !s.ok()) return s;
  }
  if (const absl::StatusOr<bool> loaded = files->Refresh(); !loaded.ok()) return loaded.status();
  return files;
}

TlsFiles::~TlsFiles() = default;

absl::StatusOr<TlsFiles::Texts> TlsFiles::Read() const {
  Texts texts;
  absl::StatusOr<std::string> text = ReadText(options_.tls_cert);
  if (!text.ok()) return text.status();
  texts.certificate = *std::move(text);
  text = ReadText(options_.tls_key);
  if (!text.ok()) return text.status();
  texts.key = *std::move(text);
  if (options_.tls_client_ca.empty()) return texts;
  text = ReadText(options_.tls_client_ca);
  if (!text.ok()) return text.status();
  texts.client_ca = *std::move(text);
  return texts;
}

absl::StatusOr<absl::Time> TlsFiles::Check(const Texts& texts) const {
  const absl::StatusOr<OwnedCertificate> certificate =
      ReadCertificate(texts.certificate, options_.tls_cert);
  if (!certificate.ok()) return certificate.status();
  const OwnedBio bio = Reading(texts.key);
  const OwnedKey key(PEM_read_bio_PrivateKey(bio.get(), nullptr, nullptr, nullptr));
  if (key == nullptr) return Wrong(options_.tls_key, "holds no key in PEM without a passphrase");
  if (X509_check_private_key(certificate->get(), key.get()) != 1) {
    return Wrong(options_.tls_key, "is not the key of the certificate");
  }
  absl::StatusOr<absl::Time> expires = EndOf(**certificate, options_.tls_cert);
  if (!expires.ok() || options_.tls_client_ca.empty()) return expires;
  const absl::StatusOr<OwnedCertificate> ca =
      ReadCertificate(texts.client_ca, options_.tls_client_ca);
  if (!ca.ok()) return ca.status();
  const absl::StatusOr<absl::Time> ca_expires = EndOf(**ca, options_.tls_client_ca);
  if (!ca_expires.ok()) return ca_expires.status();
  return expires;
}

absl::StatusOr<bool> TlsFiles::Load() {
  const absl::StatusOr<Texts> texts = Read();
  if (!texts.ok()) return texts.status();
  if (*texts == loaded_) {
    if (expires_ <= absl::Now()) return Wrong(options_.tls_cert, "has expired");
    return false;
  }
  const absl::StatusOr<absl::Time> expires = Check(*texts);
  if (!expires.ok()) return expires.status();
  if (absl::Status s = key_.Replace(texts->key); !s.ok()) return s;
  if (absl::Status s = certificate_.Replace(texts->certificate); !s.ok()) return s;
  if (!options_.tls_client_ca.empty()) {
    if (absl::Status s = client_ca_.Replace(texts->client_ca); !s.ok()) return s;
  }
  loaded_ = *texts;
  expires_ = *expires;
  return true;
}

absl::StatusOr<bool> TlsFiles::Refresh() {
  const std::lock_guard<std::mutex> lock(mutex_);
  absl::StatusOr<bool> loaded = Load();
  fault_ = loaded.ok() ? "" : std::string(loaded.status().message());
  return loaded;
}

absl::Time TlsFiles::expires() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return expires_;
}

std::string TlsFiles::fault() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return fault_;
}

}  // namespace vantage::auth

// Certificates and keys on disk, which change while the server runs.
#ifndef VANTAGE_SERVER_AUTH_TLS_FILES_H_
#define VANTAGE_SERVER_AUTH_TLS_FILES_H_

#include <memory>
#include <mutex>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "server/auth/access_options.h"

namespace vantage::auth {

// The files as they were when they last fitted one another. Who renews a certificate writes two
// files one after the other, and a server that read one new and one old would refuse every new
// connection. Thread safe.
class TlsFiles {
 public:
  // Reads and checks the files of `options`, which are encrypted. INVALID_ARGUMENT names the file
  // that gRPC would stumble over only when a client connects: it cannot be read, is no PEM, the key
  // is not the certificate's, or the certificate has expired. INTERNAL: there is no room to keep
  // them.
  static absl::StatusOr<std::unique_ptr<TlsFiles>> Open(const AccessOptions& options);
  ~TlsFiles();
  TlsFiles(const TlsFiles&) = delete;
  TlsFiles& operator=(const TlsFiles&) = delete;

  // Files of this process's memory that hold what was last found to fit; gRPC watches them.
  std::string certificate_path() const { return certificate_.path(); }
  std::string key_path() const { return key_.path(); }
  std::string client_ca_path() const { return client_ca_.path(); }  // empty where none is asked for

  // Reads the files on disk; true when they fit and are others than before. On an error, as of
  // Open(), what was loaded stays.
  absl::StatusOr<bool> Refresh();

  // When the loaded certificate expires.
  absl::Time expires() const;
  // What is wrong with the files on disk; empty: they are those that are loaded.
  std::string fault() const;

 private:
  // A file that has no name on any disk, so that keys are written to none.
  class MemoryFile {
   public:
    MemoryFile() = default;
    ~MemoryFile();
    MemoryFile(const MemoryFile&) = delete;
    MemoryFile& operator=(const MemoryFile&) = delete;
    absl::Status Create(const char* name);
    absl::Status Replace(const std::string& text);
    std::string path() const;

   private:
    int file_ = -1;
  };
  struct Texts {
    std::string certificate;
    std::string key;
    std::string client_ca;
    bool operator==(const Texts&) const = default;
  };

  explicit TlsFiles(const AccessOptions& options) : options_(options) {}
  absl::StatusOr<Texts> Read() const;
  // When the certificate expires. Errors as of Open().
  absl::StatusOr<absl::Time> Check(const Texts& texts) const;
  absl::StatusOr<bool> Load() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const AccessOptions options_;
  MemoryFile certificate_;
  MemoryFile key_;
  MemoryFile client_ca_;
  mutable std::mutex mutex_;
  Texts loaded_ ABSL_GUARDED_BY(mutex_);
  absl::Time expires_ ABSL_GUARDED_BY(mutex_);
  std::string fault_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage::auth

#endif  // VANTAGE_SERVER_AUTH_TLS_FILES_H_

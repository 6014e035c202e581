// Immutable bytes in files named by their SHA-256: as they are, or as the records of the upload
// that brought them, compressed, in a file with the ending ".pieces".
#ifndef VANTAGE_SERVER_STORE_BLOB_FOLDER_H_
#define VANTAGE_SERVER_STORE_BLOB_FOLDER_H_

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace vantage::store {

// Thread safe. Methods as the store's (store.h).
class BlobFolder {
 public:
  explicit BlobFolder(std::string path) : path_(std::move(path)) {}

  // Makes the folder, and removes files that were only half written.
  absl::Status Open();

  absl::StatusOr<std::string> Put(absl::string_view bytes);
  // Keeps the pieces in a file of records, which was synced and is linked, not copied. They are
  // known to have this SHA-256.
  absl::Status PutRecords(const std::string& records, const std::string& sha256);
  absl::StatusOr<int64_t> Size(const std::string& sha256) const;
  // DATA_LOSS: the file is not what its name says.
  absl::StatusOr<std::string> Get(const std::string& sha256) const;
  absl::Status Release(const std::string& sha256);
  absl::Status Keep(const std::map<std::string, int>& holders);
  absl::Status KeepAll(const std::map<std::string, int>& holders);

  // SHA-256 of every blob there is, sorted.
  absl::StatusOr<std::vector<std::string>> List() const;

 private:
  // With either ending.
  std::string FileOf(const std::string& sha256, bool records) const;
  absl::Status Unlink(const std::string& sha256) const;

  const std::string path_;
  std::mutex mutex_;
  std::map<std::string, int> holders_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage::store

#endif  // VANTAGE_SERVER_STORE_BLOB_FOLDER_H_

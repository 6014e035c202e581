// One append-only file for each upload on its way: records of size, checksums and bytes.
#ifndef VANTAGE_SERVER_STORE_SPOOL_FOLDER_H_
#define VANTAGE_SERVER_STORE_SPOOL_FOLDER_H_

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "server/store/durable_file.h"

namespace vantage::store {

// Thread safe. Methods as the store's (store.h). After a power cut, records that were not synced
// may be there, missing or cut short: reading ends before the first record that is not whole.
class SpoolFolder {
 public:
  explicit SpoolFolder(std::string path) : path_(std::move(path)) {}

  absl::Status Open();

  absl::Status Append(const std::string& spool, absl::string_view record);
  absl::Status Sync(const std::string& spool);
  absl::Status Cut(const std::string& spool, size_t records);
  absl::Status Read(const std::string& spool,
                    absl::FunctionRef<absl::Status(absl::string_view)> visit) const;
  absl::StatusOr<FileDescriptor> OpenBytes(const std::string& spool) const;
  absl::StatusOr<int64_t> FreeBytes() const;
  // DATA_LOSS: a record that others follow is damaged.
  absl::Status Check(const std::string& spool) const;
  absl::Status Drop(const std::string& spool);
  absl::StatusOr<std::vector<std::string>> List() const;
  // The file that a spool is in.
  std::string FileOf(const std::string& spool) const;

 private:
  static constexpr int64_t kUnknown = -1;
  struct Spool {
    std::mutex mutex;
    int64_t size ABSL_GUARDED_BY(mutex) = kUnknown;  // of whole records, bytes
    bool tail ABSL_GUARDED_BY(mutex) = false;        // other bytes may follow these
    bool named ABSL_GUARDED_BY(mutex) = false;       // the file's name was synced
  };

  std::shared_ptr<Spool> Find(const std::string& spool);

  const std::string path_;
  std::mutex mutex_;
  std::map<std::string, std::shared_ptr<Spool>> open_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage::store

#endif  // VANTAGE_SERVER_STORE_SPOOL_FOLDER_H_

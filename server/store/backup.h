// Copies of a disk store's folder, and whether one is sound. All three work while a server uses the
// folder that they read.
#ifndef VANTAGE_SERVER_STORE_BACKUP_H_
#define VANTAGE_SERVER_STORE_BACKUP_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace vantage::store {

// The contents of a folder, and its faults.
struct StoreReport {
  int64_t sessions = 0;
  int64_t entries = 0;  // of all logs
  int64_t blobs = 0;
  int64_t blob_bytes = 0;
  int64_t uploads = 0;              // under way
  std::vector<std::string> faults;  // in words, each with its file or session; empty: sound
};

// Reads everything: the database's own check, every entry's checksum and order, every blob's
// SHA-256, every upload's records, and that no scan lacks its blob; and that it is no copy that was
// broken off. NOT_FOUND: no store is there. FAILED_PRECONDITION: a newer release wrote it.
absl::StatusOr<StoreReport> VerifyStore(const std::string& folder);

// Copies the store in `from`, as it was at one moment, to `to`, and verifies the copy. Every byte
// is copied, also within a file system, so that damage to a file reaches only one of the two.
// FAILED_PRECONDITION: `to` is not empty. DATA_LOSS: the copy is not sound.
absl::StatusOr<StoreReport> BackUpStore(const std::string& from, const std::string& to);

// Copies a backup to `to`, where a server can then be started, and verifies the copy. Refuses a
// backup that is not sound (DATA_LOSS) and a folder that is not empty (FAILED_PRECONDITION), but
// for one in which a restore of this backup was broken off: that one is finished. Until it is, no
// server starts there.
absl::StatusOr<StoreReport> RestoreStore(const std::string& from, const std::string& to);

}  // namespace vantage::store

#endif  // VANTAGE_SERVER_STORE_BACKUP_H_

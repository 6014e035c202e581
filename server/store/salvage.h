// What can still be read of one session of a store's folder, damaged or not.
#ifndef VANTAGE_SERVER_STORE_SALVAGE_H_
#define VANTAGE_SERVER_STORE_SALVAGE_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace vantage::store {

struct Salvaged {
  int64_t entries = 0;              // of the log
  int64_t scans = 0;                // whose range images are whole
  int64_t uploads = 0;              // under way, of which something is there
  std::vector<std::string> faults;  // what could not be read, in words
};

// Copies it to the folder `to`, which is new or empty, also while a server uses `folder`:
//
//   log.jsonl           the entries of its log that are sound, as JSON, one a line
//   scans/scan-1.vrim   the range images that the entries name, encoded as in upload.proto
//   uploads/upload-3.vrim  the beginnings of those under way
//
// NOT_FOUND: there is no such session. FAILED_PRECONDITION: `to` is not empty.
absl::StatusOr<Salvaged> SalvageSession(const std::string& folder, const std::string& session,
                                        const std::string& to);

// Takes a session out of a folder that no server uses, so that its id is free. Its scans are
// removed by the next start at which every session can be loaded. NOT_FOUND. FAILED_PRECONDITION: a
// server uses it.
absl::Status RemoveSession(const std::string& folder, const std::string& session);

}  // namespace vantage::store

#endif  // VANTAGE_SERVER_STORE_SALVAGE_H_

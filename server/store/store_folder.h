// What a disk store's folder holds, by name, and whether a server may use what is there.
#ifndef VANTAGE_SERVER_STORE_STORE_FOLDER_H_
#define VANTAGE_SERVER_STORE_STORE_FOLDER_H_

#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace vantage::store {

std::string DatabaseIn(const std::string& folder);
std::string BlobsIn(const std::string& folder);
std::string SpoolsIn(const std::string& folder);

// FAILED_PRECONDITION: there is something in it.
absl::Status CheckNewFolder(const std::string& folder);

// FAILED_PRECONDITION: scans or uploads are there and no logs that say whose they are. A server
// that began anew would remove them, since no log refers to them.
absl::Status CheckNotWithoutLogs(const std::string& folder);

// A copy of a store (`what`: 'backup' or 'restore') is marked until it is whole. Durable.
absl::Status BeginCopy(const std::string& to, absl::string_view what, const std::string& from);
absl::Status EndCopy(const std::string& to);
// Whether such a copy from there was begun in `to` and not ended.
bool IsCopyOf(const std::string& to, absl::string_view what, const std::string& from);
// FAILED_PRECONDITION: a copy was begun and not ended.
absl::Status CheckFinished(const std::string& folder);

}  // namespace vantage::store

#endif  // VANTAGE_SERVER_STORE_STORE_FOLDER_H_

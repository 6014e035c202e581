// Whether an entry of a log that comes from elsewhere says what a server could have logged. The
// fold of a log trusts it, and whoever made an archive is not trusted.
#ifndef VANTAGE_SERVER_SESSION_IMPORTED_ENTRY_H_
#define VANTAGE_SERVER_SESSION_IMPORTED_ENTRY_H_

#include <string>

#include "absl/status/status.h"
#include "server/contract/limits.h"
#include "vantage/storage/v1/log.pb.h"

namespace vantage::session {

// By itself, whatever came before: everything that it makes is in the session `id`, and has the
// values that a request may have. INVALID_ARGUMENT: it has not.
absl::Status CheckImportedEntry(const storage::v1::LogEntry& entry, const std::string& id,
                                const contract::Limits& limits);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_IMPORTED_ENTRY_H_

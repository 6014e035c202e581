// Reading the files that say who may call.
#ifndef VANTAGE_SERVER_AUTH_GUARDED_FILE_H_
#define VANTAGE_SERVER_AUTH_GUARDED_FILE_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace vantage::auth {

// The text of a file that nobody but its owner can write; `what` names it in errors ('callers
// file'). NOT_FOUND: it is not there, or cannot be read. PERMISSION_DENIED: others can write it.
// INVALID_ARGUMENT: it is larger than 4 MiB.
absl::StatusOr<std::string> ReadGuardedFile(const std::string& path, absl::string_view what);

}  // namespace vantage::auth

#endif  // VANTAGE_SERVER_AUTH_GUARDED_FILE_H_

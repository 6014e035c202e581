// Finding what a request names, and pages of lists.
#ifndef VANTAGE_SERVER_RPC_LOOKUP_H_
#define VANTAGE_SERVER_RPC_LOOKUP_H_

#include <cstddef>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "server/session/tenant_sessions.h"

namespace vantage {

// The session named 'sessions/{session}' in `field`.
absl::StatusOr<std::shared_ptr<Session>> FindSession(const TenantSessions& sessions,
                                                     const std::string& name,
                                                     absl::string_view field);
// The session that 'sessions/{session}/{collection}/{id}' in `field` belongs to.
absl::StatusOr<std::shared_ptr<Session>> FindParent(const TenantSessions& sessions,
                                                    const std::string& name,
                                                    absl::string_view collection,
                                                    absl::string_view field);

// A page of a list in order of creation.
struct Page {
  size_t skip = 0;
  size_t limit = 50;
};
// `size` 0 is `default_size`; INVALID_ARGUMENT beyond `max_size`, or for a token that no list
// called `list` gave.
absl::StatusOr<Page> ReadPage(int size, const std::string& token, absl::string_view list,
                              int default_size, int max_size, absl::string_view size_field,
                              absl::string_view token_field);
std::string NextPageToken(absl::string_view list, size_t skip);

}  // namespace vantage

#endif  // VANTAGE_SERVER_RPC_LOOKUP_H_

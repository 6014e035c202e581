// A session's rejections: places that people refused. Their whole state is in the log.
#ifndef VANTAGE_SERVER_SESSION_REJECTIONS_H_
#define VANTAGE_SERVER_SESSION_REJECTIONS_H_

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "server/session/session_context.h"
#include "vantage/v1/session.pb.h"

namespace vantage::session {

// Thread safe: the log's locks are all that it needs.
class Rejections {
 public:
  explicit Rejections(SessionContext& context) : context_(context) {}

  // `wanted` has position, radius and reason; its message is what the log stores. It holds for
  // `ttl`, without one for good. RESOURCE_EXHAUSTED (TOO_MANY_REJECTIONS).
  absl::StatusOr<v1::Rejection> Create(const v1::Rejection& wanted,
                                       std::optional<absl::Duration> ttl, const RequestKey& key);
  // Those that have not expired, in pages, as in Scans::List().
  absl::StatusOr<std::vector<v1::Rejection>> List(absl::string_view after, size_t limit,
                                                  bool& more) const;
  // NOT_FOUND: there is none of that name, or it has expired.
  absl::Status Delete(const std::string& name, const RequestKey& key);

 private:
  SessionContext& context_;
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_REJECTIONS_H_
